#include "bench/embree_peer.h"

#include <cmath>

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

}  // namespace asperity::bench
