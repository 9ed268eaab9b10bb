#include "asperity/io/trace_export.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "asperity/io/recorded_path.h"

namespace asperity::trace_export_test {
namespace {

namespace fs = std::filesystem;

class TraceExport : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "asperity-export-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_;
};

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

Trace some_trace() {
  Trace trace;
  trace.complete = true;
  trace.metadata.device = "omega.7";
  for (std::uint64_t n = 0; n < 4; ++n) {
    TraceRecord record;
    record.tick = n;
    record.dt = Seconds(1e-3);
    record.probe.time = Seconds(2.0 + 0.1 * static_cast<double>(n));
    record.probe.pose.position = Vec3(std::sqrt(2.0) * static_cast<double>(n), 1.0 / 3.0, -1e-300);
    record.rendered.wrench.force = Vec3(0.1, 0.2, 0.3);
    trace.records.push_back(record);
  }
  return trace;
}

TEST_F(TraceExport, TableHasAHeaderWithUnitsAndExactNumbers) {
  const Trace trace = some_trace();
  const std::vector<std::string> lines = split(trace_csv(trace), '\n');
  ASSERT_EQ(lines.size(), 5U);
  const std::vector<std::string> header = split(lines[0], ',');
  ASSERT_EQ(header.size(), trace_columns().size());
  EXPECT_EQ(header[0], "tick");
  EXPECT_EQ(header[1], "time [s]");
  EXPECT_EQ(header[3], "position_x [m]");
  for (std::size_t n = 0; n < 4; ++n) {
    const std::vector<std::string> cells = split(lines[n + 1], ',');
    ASSERT_EQ(cells.size(), header.size());
    double x = 0.0;
    std::from_chars(cells[3].data(), cells[3].data() + cells[3].size(), x);
    EXPECT_EQ(x, trace.records[n].probe.pose.position.x());
  }
}

TEST_F(TraceExport, ColumnNamesAreUnique) {
  std::set<std::string> names;
  for (const TraceColumn& column : trace_columns()) EXPECT_TRUE(names.insert(column.name).second) << column.name;
}

TEST_F(TraceExport, IdsWithoutAValueAreEmpty) {
  const std::vector<TraceColumn> columns = trace_columns();
  const auto cells = split(split(trace_csv(some_trace()), '\n')[1], ',');
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].name == "instance" || columns[i].name == "element") {
      EXPECT_EQ(cells[i], "");
    }
  }
}

TEST_F(TraceExport, WritesTableAndSidecarBesideIt) {
  ASSERT_TRUE(export_trace(some_trace(), at("run.csv")).ok());
  EXPECT_EQ(text_of(at("run.csv")), trace_csv(some_trace()));
  const std::string sidecar = text_of(at("run.json"));
  EXPECT_NE(sidecar.find("\"force_hash\": \"" + format_hash(force_hash(some_trace().records)) + "\""),
            std::string::npos);
  EXPECT_NE(sidecar.find("\"omega.7\""), std::string::npos);
  for (const TraceColumn& column : trace_columns())
    EXPECT_NE(sidecar.find("\"" + column.name + "\""), std::string::npos);
}

TEST_F(TraceExport, EachUnusableNameHasItsError) {
  EXPECT_EQ(export_trace(some_trace(), at("run.json")).error().code, ErrorCode::bad_value);
  EXPECT_EQ(export_trace(some_trace(), at("no/folder/run.csv")).error().code, ErrorCode::file_unwritable);
  EXPECT_FALSE(fs::exists(at("run.json")));
}

TEST_F(TraceExport, ExportedTableIsARecordedPath) {
  ASSERT_TRUE(export_trace(some_trace(), at("run.csv")).ok());
  const auto points = read_recorded_path(at("run.csv")).value();
  ASSERT_EQ(points.size(), 4U);
  EXPECT_EQ(points[0].time.count(), 0.0);
  EXPECT_NEAR(points[3].time.count(), 0.3, 1e-12);
  for (std::size_t n = 0; n < 4; ++n) EXPECT_EQ(points[n].position, some_trace().records[n].probe.pose.position);
}

TEST_F(TraceExport, TraceFileIsARecordedPath) {
  ASSERT_TRUE(write_trace(at("run.trace"), {}, some_trace().records).ok());
  const auto points = read_recorded_path(at("run.trace")).value();
  ASSERT_EQ(points.size(), 4U);
  EXPECT_EQ(points[2].position, some_trace().records[2].probe.pose.position);
}

TEST(RecordedPath, ReadsUnitsAnyOrderCommentsAndBlankLines) {
  const auto points =
      parse_recorded_path(
          "\xEF\xBB\xBF# hand\n\nz [um], x [mm] ,time [ms],note,y\r\n1000,2,0,a,0.5\r\n\n0,-2.5,20,b,1e-3\n")
          .value();
  ASSERT_EQ(points.size(), 2U);
  EXPECT_NEAR((points[0].position - Vec3(2e-3, 0.5, 1e-3)).norm(), 0.0, 1e-15);
  EXPECT_NEAR(points[1].time.count(), 0.02, 1e-15);
  EXPECT_NEAR((points[1].position - Vec3(-2.5e-3, 1e-3, 0.0)).norm(), 0.0, 1e-15);
}

TEST(RecordedPath, EachBadLineIsNamed) {
  const auto error_of = [](const char* text) {
    const auto result = parse_recorded_path(text);
    EXPECT_FALSE(result.ok()) << text;
    return result ? Error{} : result.error();
  };
  EXPECT_EQ(error_of("").code, ErrorCode::file_empty);
  EXPECT_EQ(error_of("time,x,y\n").place, "line 1");
  EXPECT_NE(error_of("time,x,y\n").what.find("\"z\""), std::string::npos);
  EXPECT_EQ(error_of("time [kg],x,y,z\n").place, "line 1");
  EXPECT_NE(error_of("time [kg],x,y,z\n").accepted.find("ms"), std::string::npos);
  EXPECT_EQ(error_of("time,x [s],y,z\n").place, "line 1");
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,3\n").code, ErrorCode::file_malformed);
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,3\n1,2,3\n").place, "line 3");
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,3\n1,2,fast,3\n").place, "line 3");
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,nan\n").place, "line 2");
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,inf\n").place, "line 2");
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,3x\n").place, "line 2");
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,\n").place, "line 2");
  EXPECT_EQ(error_of("time,x,y,z\n0,1,2,3\n0,1,2,3\n").place, "line 3");
}

TEST(RecordedPath, EachBadTraceIsNamed) {
  Trace trace = some_trace();
  trace.records[2].probe.time = Seconds(0.0);
  EXPECT_EQ(recorded_path_from(trace).error().place, "tick 2");
  trace = some_trace();
  trace.records[1].probe.pose.position.x() = infinity;
  EXPECT_EQ(recorded_path_from(trace).error().place, "tick 1");
  trace.records.resize(1);
  EXPECT_EQ(recorded_path_from(trace).error().code, ErrorCode::mismatch);
}

TEST(RecordedPath, MissingFileAndFolderAreErrorsWithTheirName) {
  EXPECT_EQ(read_recorded_path("no/such/file.csv").error().code, ErrorCode::file_missing);
  EXPECT_EQ(read_recorded_path("no/such/file.csv").error().file, "no/such/file.csv");
  EXPECT_EQ(read_recorded_path(fs::temp_directory_path().string()).error().code, ErrorCode::file_unsupported);
}

}  // namespace
}  // namespace asperity::trace_export_test
