#include "asperity/io/mesh_io.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "asperity/geometry/generators.h"
#include "asperity/io/atomic_file.h"

namespace asperity::mesh_io_test {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for each test.
class MeshFiles : public testing::Test {
 protected:
  MeshFiles() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("asperity-mesh-io-" + std::string(test->name()) + "-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~MeshFiles() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path file(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }
  static std::string content(const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] std::size_t files_in_folder() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }

  fs::path folder_;
};

template <class Number>
void put(std::string& bytes, Number number, bool big = false) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), &number, sizeof number);
  if (big) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

MeshSource read(const std::string& bytes, const std::string& name) {
  auto source = read_mesh_bytes(bytes, name);
  EXPECT_TRUE(source.ok()) << (source.ok() ? "" : source.error().message());
  return source.ok() ? std::move(source).value() : MeshSource{};
}

Error error_of(const std::string& bytes, const std::string& name) {
  const auto source = read_mesh_bytes(bytes, name);
  EXPECT_FALSE(source.ok()) << name << " was accepted:\n" << bytes.substr(0, 300);
  if (source.ok()) return {};
  EXPECT_EQ(source.error().file, name);
  EXPECT_FALSE(source.error().what.empty());
  EXPECT_FALSE(source.error().accepted.empty()) << source.error().message();
  return source.error();
}

#define EXPECT_ERROR(bytes, name, expected_code, expected_place)           \
  do {                                                                     \
    const Error error_found = error_of(bytes, name);                       \
    EXPECT_EQ(error_found.code, expected_code) << error_found.message();   \
    EXPECT_EQ(error_found.place, expected_place) << error_found.message(); \
  } while (false)

const std::string triangle_obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

// ---- OBJ

TEST(ObjReader, ReadsPositionsExactlyWithEveryIndexStyle) {
  const MeshSource source = read(
      "# comment\r\n  v 0.1 -2.5e-3 +3\n\tv 1 0 0 1.0\nv 0 1 0 0.5 0.5 0.5\nvt 0.25 0.5\nvt 1\nvt 0 1 0\nvn 0 0 1\n"
      "o thing\ng a b\nusemtl none\ns 1\nmtllib missing.mtl\nf 1/1/1 2/2/1 3/3/1\nf -1/-1 -2/-2 -3/-3 # turned\nf 2/1 "
      "\\\n 3/2 \\\n1/3\n",
      "a.obj");
  ASSERT_EQ(source.positions.size(), 3U);
  EXPECT_EQ(source.positions[0], Vec3(0.1, -2.5e-3, 3.0));
  ASSERT_EQ(source.triangles.size(), 3U);
  EXPECT_EQ(source.triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
  EXPECT_EQ(source.triangles[1], (std::array<std::uint32_t, 3>{2, 1, 0}));
  EXPECT_EQ(source.triangles[2], (std::array<std::uint32_t, 3>{1, 2, 0}));
  ASSERT_EQ(source.corner_uvs.size(), 3U);
  EXPECT_EQ(source.corner_uvs[0][0], Vec2f(0.25F, 0.5F));
  EXPECT_EQ(source.corner_uvs[0][1], Vec2f(1.0F, 0.0F));
  EXPECT_EQ(source.corner_uvs[1][0], Vec2f(0.0F, 1.0F));
}

TEST(ObjReader, TriangulatesPolygonsConvexAndNot) {
  // An arrowhead: a fan from its first corner would leave the outline; the area tells.
  const MeshSource source = read("v 0 0 0\nv 2 -1 0\nv 0 3 0\nv -2 -1 0\nv 0 1 0\nf 2 3 4 1\nf 1 2 5 3 4\n", "a.obj");
  EXPECT_EQ(source.triangles.size(), 5U);
  const MeshSource pentagon = read("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\n", "a.obj");
  const auto mesh = TriangleMesh::build(pentagon);
  ASSERT_TRUE(mesh.ok());
  EXPECT_NEAR(mesh->report().area, 2.5, 1e-6);
}

TEST(ObjReader, PartialUvsAreLeftOutWithANote) {
  const MeshSource source = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 2 4 3\n", "a.obj");
  EXPECT_TRUE(source.corner_uvs.empty());
  ASSERT_EQ(source.notes.size(), 1U);
  EXPECT_NE(source.notes[0].find("1 of 2"), std::string::npos);
}

TEST(ObjReader, FacesMayNameLaterVertices) {
  EXPECT_EQ(read("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", "a.obj").triangles.size(), 1U);
}

TEST(ObjReader, EveryBadInputNamesItsLine) {
  EXPECT_ERROR("", "a.obj", ErrorCode::file_empty, "");
  EXPECT_ERROR("# nothing\n", "a.obj", ErrorCode::bad_mesh, "");
  EXPECT_ERROR("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "a.obj", ErrorCode::bad_mesh, "");
  EXPECT_ERROR("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "a.obj", ErrorCode::bad_mesh, "");
  EXPECT_ERROR("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "a.obj", ErrorCode::bad_mesh, "line 2");
  EXPECT_ERROR("v 0 0 0\nv 1 0 0\nv 0 -inf 0\nf 1 2 3\n", "a.obj", ErrorCode::bad_mesh, "line 3");
  EXPECT_ERROR("v 0 0 1e999\nf 1 1 1\n", "a.obj", ErrorCode::bad_mesh, "line 1");
  EXPECT_ERROR("v 0 0\nf 1 1 1\n", "a.obj", ErrorCode::file_malformed, "line 1");
  EXPECT_ERROR("v 0 zero 0\n", "a.obj", ErrorCode::file_malformed, "line 1");
  EXPECT_ERROR(triangle_obj + "f 1 2 4\n", "a.obj", ErrorCode::bad_mesh, "line 5");
  EXPECT_ERROR(triangle_obj + "f 0 1 2\n", "a.obj", ErrorCode::bad_mesh, "line 5");
  EXPECT_ERROR(triangle_obj + "f -4 1 2\n", "a.obj", ErrorCode::bad_mesh, "line 5");
  EXPECT_ERROR(triangle_obj + "f 1/1 2/1 3/1\n", "a.obj", ErrorCode::bad_mesh, "line 5");
  EXPECT_ERROR(triangle_obj + "f a b c\n", "a.obj", ErrorCode::file_malformed, "line 5");
  EXPECT_ERROR(triangle_obj + "f 1/1/1/1 2 3\n", "a.obj", ErrorCode::file_malformed, "line 5");
  EXPECT_ERROR(triangle_obj + "f 99999999999999999999 2 3\n", "a.obj", ErrorCode::file_malformed, "line 5");
  EXPECT_ERROR(triangle_obj + "vt nan 0\n", "a.obj", ErrorCode::bad_mesh, "line 5");
  std::string huge = triangle_obj + "f";
  for (int i = 0; i < 1100; ++i) huge += " 1";
  EXPECT_ERROR(huge + "\n", "a.obj", ErrorCode::file_unsupported, "line 5");
}

// ---- PLY

std::string ply_header(const std::string& format, const std::string& vertices, const std::string& faces,
                       const std::string& list = "list uchar int vertex_indices") {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\nelement vertex " + vertices +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces + "\nproperty " + list +
         "\nend_header\n";
}
const std::string three_vertices = "0 0 0\n1 0 0\n0 1 0\n";

template <class Count, class Index>
std::string binary_quad_ply(bool big, const std::string& list) {
  std::string bytes = ply_header(big ? "binary_big_endian" : "binary_little_endian", "4", "1", list);
  for (const float value : {0.0F, 0.0F, 0.5F, 1.0F, 0.0F, 0.5F, 1.0F, 1.0F, 0.5F, 0.0F, 1.0F, 0.5F})
    put(bytes, value, big);
  put(bytes, Count{4}, big);
  for (const int index : {0, 1, 2, 3}) put(bytes, static_cast<Index>(index), big);
  return bytes;
}

TEST(PlyReader, ReadsAsciiWithUvsPolygonsAndOtherElements) {
  const MeshSource source = read(
      "ply\r\nformat ascii 1.0\r\nobj_info x\r\nelement camera 1\r\nproperty list int float view\r\nelement vertex "
      "4\r\n"
      "property uchar red\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\nproperty float s\r\n"
      "property float t\r\nelement face 2\r\nproperty float quality\r\nproperty list uchar uint vertex_index\r\n"
      "end_header\r\n2 0.5 0.5\r\n9 0.1 0 0 0 0\r\n9 1 0 0 1 0\r\n9 1 1 0 1 1\r\n9 0 1 0 0 1\r\n0.5 3 0 1 2\r\n0.5 4 0 "
      "1 2 3\r\n",
      "a.ply");
  ASSERT_EQ(source.positions.size(), 4U);
  EXPECT_EQ(source.positions[0].x(), 0.1);
  ASSERT_EQ(source.triangles.size(), 3U);
  EXPECT_EQ(source.triangles[2], (std::array<std::uint32_t, 3>{0, 2, 3}));
  ASSERT_EQ(source.corner_uvs.size(), 3U);
  EXPECT_EQ(source.corner_uvs[2][1], Vec2f(1.0F, 1.0F));
}

TEST(PlyReader, ReadsBothByteOrdersAndEveryListType) {
  for (const bool big : {false, true}) {
    for (const std::string& bytes :
         {binary_quad_ply<std::uint8_t, std::int32_t>(big, "list uchar int vertex_indices"),
          binary_quad_ply<std::int8_t, std::uint32_t>(big, "list char uint vertex_indices"),
          binary_quad_ply<std::uint16_t, std::uint16_t>(big, "list ushort uint16 vertex_index"),
          binary_quad_ply<std::int32_t, std::uint8_t>(big, "list int32 uint8 vertex_index"),
          binary_quad_ply<std::uint32_t, std::int16_t>(big, "list uint short vertex_index")}) {
      const MeshSource source = read(bytes, "a.ply");
      ASSERT_EQ(source.triangles.size(), 2U);
      EXPECT_EQ(source.positions[2], Vec3(1.0, 1.0, 0.5));
      EXPECT_EQ(source.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
    }
  }
}

TEST(PlyReader, FacesMayComeBeforeVertices) {
  const MeshSource source = read(
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\nproperty float "
      "x\n"
      "property float y\nproperty float z\nend_header\n3 0 1 2\n" +
          three_vertices,
      "a.ply");
  EXPECT_EQ(source.triangles.size(), 1U);
}

TEST(PlyReader, EveryBadInputNamesItsPlace) {
  const std::string good = ply_header("ascii", "3", "1") + three_vertices + "3 0 1 2\n";
  EXPECT_EQ(read(good, "a.ply").triangles.size(), 1U);
  EXPECT_ERROR("", "a.ply", ErrorCode::file_empty, "");
  EXPECT_ERROR("solid\n", "a.ply", ErrorCode::file_malformed, "line 1");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement vertex 3\n", "a.ply", ErrorCode::file_truncated, "line 3");
  EXPECT_ERROR("ply\nformat ascii 2.0\n", "a.ply", ErrorCode::file_malformed, "line 2");
  EXPECT_ERROR("ply\nformat morse 1.0\n", "a.ply", ErrorCode::file_malformed, "line 2");
  EXPECT_ERROR("ply\nelement vertex -3\n", "a.ply", ErrorCode::file_malformed, "line 2");
  EXPECT_ERROR("ply\nproperty float x\n", "a.ply", ErrorCode::file_malformed, "line 2");
  EXPECT_ERROR("ply\nelement vertex 1\nproperty real x\n", "a.ply", ErrorCode::file_malformed, "line 3");
  EXPECT_ERROR("ply\nelement vertex 1\nproperty list float int x\n", "a.ply", ErrorCode::file_malformed, "line 3");
  EXPECT_ERROR("ply\nend_header\n", "a.ply", ErrorCode::file_malformed, "line 2");
  EXPECT_ERROR(ply_header("ascii", "3", "0") + three_vertices, "a.ply", ErrorCode::bad_mesh, "");
  EXPECT_ERROR(ply_header("ascii", "3", "1") + three_vertices, "a.ply", ErrorCode::file_truncated, "line 14");
  EXPECT_ERROR(ply_header("ascii", "3", "1") + three_vertices + "3 0 1", "a.ply", ErrorCode::file_truncated, "line 14");
  EXPECT_ERROR(ply_header("ascii", "3", "1") + three_vertices + "3 0 1 3\n", "a.ply", ErrorCode::bad_mesh, "line 14");
  EXPECT_ERROR(ply_header("ascii", "3", "1") + three_vertices + "3 0 1 -1\n", "a.ply", ErrorCode::bad_mesh, "line 14");
  EXPECT_ERROR(ply_header("ascii", "3", "1") + three_vertices + "2 0 1\n", "a.ply", ErrorCode::bad_mesh, "");
  EXPECT_ERROR(ply_header("ascii", "3", "1") + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", "a.ply", ErrorCode::bad_mesh,
               "line 12");
  EXPECT_ERROR(ply_header("ascii", "3", "1") + "0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n", "a.ply", ErrorCode::file_malformed,
               "line 12");
  EXPECT_ERROR(ply_header("ascii", "3", "1", "list uchar float vertex_indices") + three_vertices + "3 0 1 2\n", "a.ply",
               ErrorCode::file_malformed, "");
  EXPECT_ERROR(ply_header("ascii", "3", "1", "list uint int vertex_indices") + three_vertices + "4000000000 0 1 2\n",
               "a.ply", ErrorCode::file_unsupported, "line 14");
}

TEST(PlyReader, HugePromisesCostNoMemory) {
  EXPECT_ERROR(ply_header("ascii", "9000000000000000000", "1") + "0 0 0\n", "a.ply", ErrorCode::file_truncated,
               "line 11");
  EXPECT_EQ(error_of(ply_header("binary_little_endian", "4000000000", "4000000000"), "a.ply").code,
            ErrorCode::file_truncated);
  EXPECT_EQ(
      error_of("ply\nformat ascii 1.0\nelement nothing 9000000000000000000\nelement vertex 3\nproperty float x\n"
               "property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n",
               "a.ply")
          .code,
      ErrorCode::file_malformed);
}

TEST(PlyReader, EveryTruncationOfABinaryFileIsAnError) {
  const std::string good = binary_quad_ply<std::uint8_t, std::int32_t>(false, "list uchar int vertex_indices");
  for (std::size_t size = 1; size < good.size(); ++size)
    EXPECT_FALSE(read_mesh_bytes(good.substr(0, size), "a.ply").ok()) << size;
}

// ---- STL

std::string binary_stl(std::uint32_t promised, std::uint32_t present, const std::string& start = {}) {
  std::string bytes = start;
  bytes.resize(80, ' ');
  put(bytes, promised);
  for (std::uint32_t i = 0; i < present; ++i) {
    for (const float value : {0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.25F})
      put(bytes, value);
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}
const std::string facet =
    "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1e-1 0\n endloop\nendfacet\n";

TEST(StlReader, ReadsAsciiAndBinaryAlsoWhenBinaryBeginsWithSolid) {
  EXPECT_EQ(read("solid name of it\n" + facet + facet + "endsolid name\nsolid\n" + facet + "endsolid\n", "a.stl")
                .triangles.size(),
            3U);
  EXPECT_EQ(
      read("solid\nFACET NORMAL 0 0 1 OUTER LOOP VERTEX 0 0 0 VERTEX 1 0 0 VERTEX 0 1 0 ENDLOOP ENDFACET ENDSOLID",
           "a.stl")
          .triangles.size(),
      1U);
  for (const std::string start : {"", "solid of a program that lies"}) {
    const MeshSource source = read(binary_stl(2, 2, start), "a.stl");
    ASSERT_EQ(source.triangles.size(), 2U);
    EXPECT_EQ(source.positions[5], Vec3(0.0, 1.0, 0.25));
  }
  EXPECT_EQ(read(binary_stl(1, 2), "a.stl").notes.size(), 1U);
}

TEST(StlReader, EveryBadInputNamesItsPlace) {
  EXPECT_ERROR("", "a.stl", ErrorCode::file_empty, "");
  EXPECT_ERROR("some text", "a.stl", ErrorCode::file_truncated, "");
  EXPECT_ERROR(binary_stl(0, 0), "a.stl", ErrorCode::bad_mesh, "byte 80");
  EXPECT_ERROR(binary_stl(3, 2), "a.stl", ErrorCode::file_truncated, "byte 184");
  EXPECT_ERROR(binary_stl(4000000000U, 1), "a.stl", ErrorCode::file_truncated, "byte 134");
  std::string with_nan = binary_stl(2, 2);
  const float nan = std::nanf("");
  std::memcpy(with_nan.data() + 84 + 50 + 24, &nan, 4);
  EXPECT_ERROR(with_nan, "a.stl", ErrorCode::bad_mesh, "byte 158");
  EXPECT_ERROR("solid a\nendsolid\n", "a.stl", ErrorCode::bad_mesh, "");
  EXPECT_ERROR("solid a\n" + facet, "a.stl", ErrorCode::file_truncated, "line 9");
  EXPECT_ERROR("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0\nvertex 1 0 0\n", "a.stl",
               ErrorCode::file_malformed, "line 5");
  EXPECT_ERROR("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 nan 0\n", "a.stl", ErrorCode::bad_mesh, "line 4");
  EXPECT_ERROR("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0", "a.stl", ErrorCode::file_truncated, "line 4");
  EXPECT_ERROR("solid a\nfaucet\n", "a.stl", ErrorCode::file_malformed, "line 2");
}

// ---- which reader, and the file itself

TEST_F(MeshFiles, ContentAndExtensionChooseTheReader) {
  const std::string ply = ply_header("ascii", "3", "1") + three_vertices + "3 0 1 2\n";
  for (const std::string name : {"a.PLY", "a.stl", "a.obj", "a", "a.txt"})
    EXPECT_TRUE(read_mesh(file(name, ply)).ok()) << name;
  for (const std::string name : {"b.OBJ", "b", "b.txt"}) EXPECT_TRUE(read_mesh(file(name, triangle_obj)).ok()) << name;
  for (const std::string name : {"c.STL", "c", "c.obj"})
    EXPECT_TRUE(read_mesh(file(name, binary_stl(2, 2))).ok()) << name;
  const auto unknown = read_mesh(file("d.fbx", "{\"asset\": {}}"));
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::file_unsupported);
  EXPECT_EQ(unknown.error().file, (folder_ / "d.fbx").string());
}

TEST_F(MeshFiles, MissingFileFolderAndEmptyFileAreNamed) {
  const auto code = [](const fs::path& path) {
    const auto source = read_mesh(path);
    EXPECT_FALSE(source.ok());
    EXPECT_EQ(source.error().file, path.string());
    return source.error().code;
  };
  EXPECT_EQ(code(folder_ / "none.obj"), ErrorCode::file_missing);
  EXPECT_EQ(code(folder_ / "none.obj" / "deeper.obj"), ErrorCode::file_missing);
  EXPECT_EQ(code(folder_), ErrorCode::file_missing);
  EXPECT_EQ(code(file("empty.obj", "")), ErrorCode::file_empty);
  EXPECT_EQ(code(""), ErrorCode::file_missing);
  EXPECT_EQ(code("/dev/null"), ErrorCode::file_missing);
}

TEST_F(MeshFiles, WrittenMeshesReadBackAsTheyWere) {
  const MeshSource blob = random_closed_mesh(11, 2, 0.03, 0.5);
  const auto original = TriangleMesh::build(blob);
  ASSERT_TRUE(original.ok());
  ASSERT_TRUE(write_obj(folder_ / "a.obj", *original).ok());
  ASSERT_TRUE(write_ply(folder_ / "a.ply", *original).ok());
  ASSERT_TRUE(write_stl(folder_ / "a.stl", *original).ok());
  for (const std::string name : {"a.obj", "a.ply"}) {
    auto source = read_mesh(folder_ / name);
    ASSERT_TRUE(source.ok()) << source.error().message();
    const auto copy = TriangleMesh::build(std::move(source).value());
    ASSERT_TRUE(copy.ok());
    ASSERT_EQ(copy->triangles().size(), original->triangles().size());
    EXPECT_EQ(copy->report().vertices, original->report().vertices);
    for (std::uint32_t face = 0; face < copy->triangles().size(); ++face) {
      EXPECT_EQ(copy->corners(face), original->corners(face));
      EXPECT_EQ(copy->uvs(face), original->uvs(face));
    }
  }
  const auto rounded = read_mesh(folder_ / "a.stl");
  ASSERT_TRUE(rounded.ok());
  const auto copy = TriangleMesh::build(*rounded);
  ASSERT_TRUE(copy.ok());
  EXPECT_TRUE(copy->report().closed());
  EXPECT_NEAR(copy->report().signed_volume, original->report().signed_volume, 1e-6 * original->report().signed_volume);
  MeshSource plain = blob;
  plain.corner_uvs.clear();
  ASSERT_TRUE(write_ply(folder_ / "b.ply", plain).ok());
  EXPECT_EQ(read_mesh(folder_ / "b.ply")->positions, blob.positions);
  EXPECT_EQ(files_in_folder(), 4U);
}

RC_GTEST_PROP(MeshIo, ObjKeepsEveryDoubleToTheLastBit, ()) {
  MeshSource source;
  for (int i = 0; i < 3; ++i) {
    const auto number = [] {
      return std::ldexp(static_cast<double>(*rc::gen::inRange<std::int64_t>(-(1LL << 53), 1LL << 53)),
                        *rc::gen::inRange(-80, 20));
    };
    const double x = number();
    const double y = number();
    source.positions.emplace_back(x, y, number());
  }
  source.triangles = {{0, 1, 2}};
  const fs::path path = fs::temp_directory_path() / ("asperity-obj-bits-" + std::to_string(::getpid()) + ".obj");
  RC_ASSERT(write_obj(path, source).ok());
  const auto copy = read_mesh(path);
  fs::remove(path);
  RC_ASSERT(copy.ok());
  RC_ASSERT(copy->positions == source.positions);
}

TEST(MeshIo, RealMeshes) {
  const fs::path folder = fs::path(ASPERITY_SHARED_DATA) / "meshes";
  if (!fs::exists(folder / "bunny-28k.obj")) GTEST_SKIP() << "shared data absent: " << folder;
  auto bunny = read_mesh(folder / "bunny-28k.obj");
  ASSERT_TRUE(bunny.ok()) << bunny.error().message();
  EXPECT_TRUE(bunny->corner_uvs.empty());
  const auto mesh = TriangleMesh::build(std::move(bunny).value());
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->report().triangles, 28576U);
  EXPECT_EQ(mesh->report().vertices, 14290U);
  EXPECT_TRUE(mesh->report().closed());
  EXPECT_GT(mesh->report().signed_volume, 0.0);
  auto spot = read_mesh(folder / "spot.obj");
  ASSERT_TRUE(spot.ok()) << spot.error().message();
  const auto cow = TriangleMesh::build(std::move(spot).value());
  ASSERT_TRUE(cow.ok());
  EXPECT_TRUE(cow->has_uvs());
  EXPECT_TRUE(cow->report().closed());  // its UV seams do not break adjacency
}

// ---- writing

TEST_F(MeshFiles, AtomicWriteReplacesAndLeavesNothingBeside) {
  const fs::path path = file("out.txt", "old");
  ASSERT_TRUE(write_file_atomically(path, std::string("new\0text", 8)).ok());
  EXPECT_EQ(content(path), std::string("new\0text", 8));
  ASSERT_TRUE(write_file_atomically(folder_ / "fresh", "").ok());
  EXPECT_EQ(content(folder_ / "fresh"), "");
  EXPECT_EQ(files_in_folder(), 2U);
}

TEST_F(MeshFiles, AtomicWriteFollowsLinksAndSparesDevices) {
  const fs::path path = file("out.txt", "old");
  fs::create_symlink(path, folder_ / "link");
  ASSERT_TRUE(write_file_atomically(folder_ / "link", "new").ok());
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(content(path), "new");
  ASSERT_TRUE(write_file_atomically("/dev/null", "gone").ok());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(MeshFiles, UnwritableOutputIsNamedAndTheOldFileStays) {
  const auto expect_unwritable = [](const fs::path& path) {
    const Status status = write_file_atomically(path, "text");
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::file_unwritable);
    EXPECT_EQ(status.error().file, path.string());
    EXPECT_FALSE(status.error().accepted.empty());
  };
  expect_unwritable(folder_);
  expect_unwritable(folder_ / "no such folder" / "out.txt");
  expect_unwritable("");
  expect_unwritable(file("plain", "old") / "below a file");
  EXPECT_EQ(content(folder_ / "plain"), "old");
  if (fs::exists("/dev/full")) {
    expect_unwritable("/dev/full");
  }
  EXPECT_EQ(files_in_folder(), 1U);
}

}  // namespace
}  // namespace asperity::mesh_io_test
