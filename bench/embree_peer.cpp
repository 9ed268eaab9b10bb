#include "bench/embree_peer.h"

#include <cmath>
#include <cstring>

#include "asperity/geometry/closest_point.h"
#include "bench/measure.h"

namespace asperity::bench {

namespace {

struct Search {
  const TriangleMesh* mesh;
  Vec3 p;
  double squared_distance;
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  Search& search = *static_cast<Search*>(arguments->userPtr);
  const std::array<Vec3, 3> corners = search.mesh->corners(arguments->primID);
  const TrianglePoint nearest = closest_point_on_triangle(search.p, corners[0], corners[1], corners[2]);
  if (nearest.squared_distance >= search.squared_distance) return false;
  search.squared_distance = nearest.squared_distance;
  // Rounded up, so that the smaller ball still holds everything that is as near.
  arguments->query->radius = std::nextafter(static_cast<float>(std::sqrt(nearest.squared_distance)), 1e30F);
  return true;
}

void fill(RTCGeometry geometry, const TriangleMesh& mesh) {
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.positions().size()));
  for (const Vec3& position : mesh.positions()) {
    for (int axis = 0; axis < 3; ++axis) *vertices++ = static_cast<float>(position[axis]);
  }
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), mesh.triangles().size()));
  for (const TriangleMesh::Triangle& triangle : mesh.triangles()) {
    for (const std::uint32_t corner : triangle) *indices++ = corner;
  }
}

bool count_bytes(void* total, ssize_t bytes, bool /*post*/) {
  *static_cast<std::int64_t*>(total) += bytes;
  return true;
}

}  // namespace

EmbreePeer::EmbreePeer(const TriangleMesh& mesh)
    : mesh_(mesh), device_(rtcNewDevice("threads=1,start_threads=0")), scene_(rtcNewScene(device_)) {
  const Clock::time_point start = Clock::now();
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  fill(geometry, mesh);
  rtcSetGeometryPointQueryFunction(geometry, visit_triangle);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  build_seconds_ = std::chrono::duration<double>(Clock::now() - start).count();
}

EmbreePeer::~EmbreePeer() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

double EmbreePeer::closest(const Vec3& p, double bound) const {
  Search search{&mesh_, p, bound * bound};
  RTCPointQuery query{};
  query.x = static_cast<float>(p.x());
  query.y = static_cast<float>(p.y());
  query.z = static_cast<float>(p.z());
  query.radius = static_cast<float>(bound);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_, &query, &context, nullptr, &search);
  return search.squared_distance < bound * bound ? std::sqrt(search.squared_distance) : infinity;
}

EmbreeRays::EmbreeRays(std::span<const Vertex> vertices, std::span<const std::array<std::uint32_t, 3>> triangles)
    : device_(rtcNewDevice("threads=1,start_threads=0")) {
  rtcSetDeviceMemoryMonitorFunction(device_, count_bytes, &bytes_);
  const Clock::time_point start = Clock::now();
  scene_ = rtcNewScene(device_);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  const auto copy = [&](RTCBufferType type, RTCFormat format, const auto& items) {
    void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(items[0]), items.size());
    std::memcpy(buffer, items.data(), items.size_bytes());
  };
  copy(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertices);
  copy(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  build_seconds_ = std::chrono::duration<double>(Clock::now() - start).count();
}

EmbreeRays::~EmbreeRays() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

double EmbreeRays::first_hit(const Segment& segment) const {
  const Eigen::Vector3f from = segment.from.cast<float>();
  const Eigen::Vector3f along = (segment.to - segment.from).cast<float>();
  RTCRayHit query{};
  query.ray.org_x = from.x();
  query.ray.org_y = from.y();
  query.ray.org_z = from.z();
  query.ray.dir_x = along.x();
  query.ray.dir_y = along.y();
  query.ray.dir_z = along.z();
  query.ray.tfar = 1.0F;
  query.ray.mask = ~0U;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_, &context, &query);
  return query.hit.geomID != RTC_INVALID_GEOMETRY_ID ? static_cast<double>(query.ray.tfar) : infinity;
}

}  // namespace asperity::bench
