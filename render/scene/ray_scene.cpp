#include "render/scene/ray_scene.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "render/scene/embree_device.h"

namespace touchstone::render {

RTCDevice embree_device() {
  static const RTCDevice shared = [] {
    const RTCDevice made = rtcNewDevice(nullptr);
    if (made == nullptr) fail("Embree can't start on this processor (error {})", int(rtcGetDeviceError(nullptr)));
    return made;
  }();
  return shared;
}

namespace {

/// Between which heights there is something to meet. What only touches such a height from outside meets nothing: a wall
/// that stands on a flat face is no matter of the layer below.
struct HeightRange {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double from, double to) {
    constexpr double kFlat = 1e-3;  // what lies flat is met from both sides, wherever single precision puts it
    const double pad = to - from < kFlat ? kFlat : 0.0;
    low = std::min(low, from - pad);
    high = std::max(high, to + pad);
  }
  bool misses(double z0, double z1) const { return std::max(z0, z1) <= low || std::min(z0, z1) >= high; }
};

bool finite(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::isfinite(a.x() + a.y() + a.z() + b.x() + b.y() + b.z());
}

RTCRay embree_ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most) {
  RTCRay ray;
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.tnear = 0.0f;
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.time = 0.0f;
  ray.tfar = static_cast<float>(most);
  ray.mask = 0xffffffffu;
  ray.id = 0;
  ray.flags = 0;
  return ray;
}

/// How light gets on through a thing.
enum class Passage { kNone, kRefracted, kFilm };

Passage passage_of(const Material& material, const std::vector<Medium>& media) {
  if (std::holds_alternative<Refractive>(material)) return Passage::kRefracted;
  if (const auto* rough = std::get_if<RoughRefractive>(&material)) {
    // Between equal indices there is no face, rough or smooth.
    if (media[rough->medium_inside].index == media[rough->medium_outside].index) return Passage::kRefracted;
  }
  return std::holds_alternative<ThinFilm>(material) ? Passage::kFilm : Passage::kNone;
}

}  // namespace

struct RayScene::State {
  struct Mesh {
    TriangleMesh mesh;
    std::vector<Eigen::Vector3d> normals;  // at the vertices; empty: shade with the triangle's normal
    bool lifts = false;                    // light leaves it where the curved surface is
  };
  /// From a point of a triangle to the mean, weighted as the point is, of its feet on the corners' tangent planes. Of
  /// those that lie on the side `outside`.
  static Eigen::Vector3d lift_of(const Mesh& mesh, const std::array<int, 3>& triangle, const double* weights,
                                 const Eigen::Vector3d& point, bool outside) {
    Eigen::Vector3d lift = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& normal = mesh.normals[triangle[k]];
      const double above = (mesh.mesh.vertices[triangle[k]] - point).dot(normal);
      if ((above > 0.0) == outside) lift += weights[k] * above * normal;
    }
    return lift;
  }

  std::vector<Mesh> meshes;
  std::vector<Ball> balls;
  std::array<std::vector<int>, 3> balls_by_passage;  // Embree's primitive number -> ball
  RTCScene all = nullptr, opaque = nullptr, refractive = nullptr, films = nullptr;
  bool has_films = false, has_refractive = false;
  HeightRange all_heights, opaque_heights;
  Eigen::AlignedBox3d bounds;
  std::vector<RecordedRay>* recorded = nullptr;

  void keep(const RTCRay& ray, bool shadow) const {
    recorded->push_back({{ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z}, ray.tfar, shadow});
  }

  ~State() {
    for (RTCScene scene : {all, opaque, refractive, films}) {
      if (scene != nullptr) rtcReleaseScene(scene);
    }
  }

  bool nearest(RTCScene scene, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most,
               RayHit& hit) const;

  void attach(RTCGeometry geometry, unsigned id, Passage passage) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(all, geometry, id);
    const RTCScene own = passage == Passage::kNone ? opaque : passage == Passage::kFilm ? films : refractive;
    rtcAttachGeometryByID(own, geometry, id);
    has_films = has_films || passage == Passage::kFilm;
    has_refractive = has_refractive || passage == Passage::kRefracted;
    rtcReleaseGeometry(geometry);
  }

  void add_mesh(unsigned id, Passage passage) {
    const TriangleMesh& mesh = meshes[id].mesh;
    if (mesh.triangles.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(embree_device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.vertices.size()));
    auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), mesh.triangles.size()));
    if (vertices == nullptr || corners == nullptr) fail("surface {}: no memory for its triangles", id);
    for (const Eigen::Vector3d& vertex : mesh.vertices) {
      for (int a = 0; a < 3; ++a) *vertices++ = static_cast<float>(vertex[a]);
    }
    for (const auto& triangle : mesh.triangles) {
      HeightRange own;
      for (int corner : triangle) {
        *corners++ = static_cast<unsigned>(corner);
        const double z = mesh.vertices[corner].z();
        own.low = std::min(own.low, z);
        own.high = std::max(own.high, z);
        bounds.extend(mesh.vertices[corner]);
      }
      all_heights.add(own.low, own.high);
      if (passage == Passage::kNone) opaque_heights.add(own.low, own.high);
    }
    attach(geometry, id, passage);
  }

  void add_balls(unsigned id, Passage passage) {
    const std::vector<int>& which = balls_by_passage[static_cast<std::size_t>(passage)];
    if (which.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(embree_device(), RTC_GEOMETRY_TYPE_SPHERE_POINT);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                                               4 * sizeof(float), which.size()));
    if (points == nullptr) fail("no memory for {} balls", which.size());
    for (int index : which) {
      const Ball& ball = balls[index];
      for (int a = 0; a < 3; ++a) *points++ = static_cast<float>(ball.centre[a]);
      *points++ = static_cast<float>(ball.radius);
      all_heights.add(ball.centre.z() - ball.radius, ball.centre.z() + ball.radius);
      bounds.extend((ball.centre.array() - ball.radius).matrix());
      bounds.extend((ball.centre.array() + ball.radius).matrix());
      if (passage == Passage::kNone) opaque_heights.add(ball.centre.z() - ball.radius, ball.centre.z() + ball.radius);
    }
    attach(geometry, id, passage);
  }
};

RayScene::RayScene(const Scene& scene) : state_(std::make_unique<State>()) {
  State& state = *state_;
  for (RTCScene* made : {&state.all, &state.opaque, &state.refractive, &state.films}) {
    *made = rtcNewScene(embree_device());
    // Robust: no ray slips through the common edge of two triangles.
    rtcSetSceneFlags(*made, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(*made, RTC_BUILD_QUALITY_MEDIUM);
  }
  for (const Surface& surface : scene.surfaces) {
    const bool refracts = passage_of(surface.material, scene.media) == Passage::kRefracted;
    state.meshes.push_back({surface.mesh,
                            refracts && surface.normals.empty() ? vertex_normals(surface.mesh) : surface.normals,
                            !refracts && !surface.normals.empty()});
  }
  state.balls = scene.balls;
  for (int i = 0; i < static_cast<int>(scene.balls.size()); ++i) {
    state.balls_by_passage[static_cast<std::size_t>(passage_of(scene.balls[i].material, scene.media))].push_back(i);
  }
  for (unsigned i = 0; i < state.meshes.size(); ++i) {
    state.add_mesh(i, passage_of(scene.surfaces[i].material, scene.media));
  }
  const auto first_ball = static_cast<unsigned>(state.meshes.size());
  for (Passage passage : {Passage::kNone, Passage::kRefracted, Passage::kFilm}) {
    state.add_balls(first_ball + static_cast<unsigned>(passage), passage);
  }
  // Built by one thread: the same tree, and so the same choice among equal hits, for any number of threads.
  tbb::task_arena alone(1);
  alone.execute([&] {
    for (RTCScene made : {state.all, state.opaque, state.refractive, state.films}) rtcCommitScene(made);
  });
  const RTCError error = rtcGetDeviceError(embree_device());
  if (error != RTC_ERROR_NONE) fail("Embree can't take the scene (error {})", static_cast<int>(error));
}

RayScene::~RayScene() = default;

bool RayScene::State::nearest(RTCScene scene, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                              double most, RayHit& hit) const {
  RTCRayHit found;
  found.ray = embree_ray(origin, direction, most);
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  if (recorded != nullptr) keep(found.ray, false);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &found);
  if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;

  const unsigned geometry = found.hit.geomID;
  if (geometry < meshes.size()) {
    const Mesh& mesh = meshes[geometry];
    const auto& t = mesh.mesh.triangles[found.hit.primID];
    const Eigen::Vector3d& a = mesh.mesh.vertices[t[0]];
    const Eigen::Vector3d ab = mesh.mesh.vertices[t[1]] - a;
    const Eigen::Vector3d ac = mesh.mesh.vertices[t[2]] - a;
    hit.position = a + double(found.hit.u) * ab + double(found.hit.v) * ac;
    hit.normal = ab.cross(ac).normalized();
    hit.distance = (hit.position - origin).dot(direction);
    hit.object = static_cast<int>(geometry);
    hit.triangle = static_cast<int>(found.hit.primID);
    hit.weight_1 = double(found.hit.u);
    hit.weight_2 = double(found.hit.v);
    hit.shading_normal = hit.normal;
    hit.lift.setZero();
    if (!mesh.normals.empty()) {
      const double weights[3] = {1.0 - hit.weight_1 - hit.weight_2, hit.weight_1, hit.weight_2};
      const Eigen::Vector3d smooth =
          weights[0] * mesh.normals[t[0]] + weights[1] * mesh.normals[t[1]] + weights[2] * mesh.normals[t[2]];
      const double length = smooth.norm();
      // A fold sharper than that isn't a smooth surface.
      if (length > 0.1 && smooth.dot(hit.normal) > 0.5 * length) {
        hit.shading_normal = smooth / length;
        if (mesh.lifts) hit.lift = lift_of(mesh, t, weights, hit.position, direction.dot(hit.normal) < 0.0);
      }
    }
    return true;
  }

  const auto& which = balls_by_passage[geometry - meshes.size()];
  const int index = which[found.hit.primID];
  const Ball& ball = balls[index];
  const Eigen::Vector3d to_centre = ball.centre - origin;
  const double nearest = to_centre.dot(direction);
  const double half2 = ball.radius * ball.radius - (to_centre - nearest * direction).squaredNorm();
  const double half = std::sqrt(std::max(0.0, half2));
  const double first = nearest - half;
  const double t = std::abs(first - double(found.ray.tfar)) <= half ? first : nearest + half;
  const Eigen::Vector3d radial = origin + t * direction - ball.centre;
  hit.normal = radial.normalized();
  hit.shading_normal = hit.normal;
  hit.lift.setZero();
  hit.position = ball.centre + ball.radius * hit.normal;
  hit.distance = t;
  hit.object = static_cast<int>(meshes.size()) + index;
  hit.triangle = -1;
  return std::isfinite(hit.position.sum());
}

bool RayScene::intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most,
                         RayHit& hit) const {
  const State& state = *state_;
  const double end = std::isinf(most) ? (direction.z() == 0.0 ? origin.z() : std::copysign(1e30, direction.z()))
                                      : origin.z() + most * direction.z();
  if (!(most > 0.0) || state.all_heights.misses(origin.z(), end) || !finite(origin, direction)) return false;

  return state.nearest(state.all, origin, direction, most, hit);
}

const Eigen::AlignedBox3d& RayScene::bounds() const {
  return state_->bounds;
}

bool RayScene::has_films() const {
  return state_->has_films;
}

bool RayScene::intersect_film(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most,
                              RayHit& hit) const {
  if (!(most > 0.0) || !finite(origin, direction)) return false;
  return state_->nearest(state_->films, origin, direction, most, hit);
}

bool RayScene::occluded(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const State& state = *state_;
  if (state.opaque_heights.misses(from.z(), to.z()) || !finite(from, to)) return false;
  const Eigen::Vector3d offset = to - from;
  const double length = offset.norm();
  if (!(length > 0.0)) return false;
  RTCRay ray = embree_ray(from, offset / length, length * (1.0 - 1e-6));
  if (state.recorded != nullptr) state.keep(ray, true);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(state.opaque, &context, &ray);
  return ray.tfar < 0.0f;
}

void RayScene::record(std::vector<RecordedRay>* into) const {
  state_->recorded = into;
}

std::uint64_t RayScene::trace_bare(std::span<const RecordedRay> rays) const {
  std::uint64_t met = 0;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (const RecordedRay& one : rays) {
    RTCRayHit found;
    found.ray = {one.origin[0],
                 one.origin[1],
                 one.origin[2],
                 0.0f,
                 one.direction[0],
                 one.direction[1],
                 one.direction[2],
                 0.0f,
                 one.far,
                 0xffffffffu,
                 0,
                 0};
    if (one.shadow) {
      rtcOccluded1(state_->opaque, &context, &found.ray);
      met += found.ray.tfar < 0.0f ? 1 : 0;
    } else {
      found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(state_->all, &context, &found);
      met += found.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    }
  }
  return met;
}

namespace {

/// Squared distance of a point from a triangle: from its plane where the foot lies inside, else from the nearest edge.
double squared_distance(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c) {
  const auto from_edge = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    const Eigen::Vector3d edge = q - p;
    const double along = std::clamp((point - p).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    return (point - p - along * edge).squaredNorm();
  };
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const auto inside = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    return normal.dot((q - p).cross(point - p)) >= 0.0;
  };
  if (inside(a, b) && inside(b, c) && inside(c, a)) {
    const double height = (point - a).dot(normal);
    return height * height / normal.squaredNorm();
  }
  return std::min({from_edge(a, b), from_edge(b, c), from_edge(c, a)});
}

}  // namespace

double RayScene::clearance(const Eigen::Vector3d& point, double most) const {
  const State& state = *state_;
  double nearest = most;
  for (const Ball& ball : state.balls) {
    nearest = std::min(nearest, std::abs((point - ball.centre).norm() - ball.radius));
  }
  if (state.all_heights.misses(point.z() - nearest, point.z() + nearest) || !point.allFinite()) return nearest;

  struct Search {
    const State& state;
    Eigen::Vector3d point;
    double nearest;
  } search{state, point, nearest};
  RTCPointQuery query;
  query.x = static_cast<float>(point.x());
  query.y = static_cast<float>(point.y());
  query.z = static_cast<float>(point.z());
  query.time = 0.0f;
  query.radius = static_cast<float>(nearest);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(
      state.all, &query, &context,
      [](RTCPointQueryFunctionArguments* arguments) {
        Search& found = *static_cast<Search*>(arguments->userPtr);
        if (arguments->geomID >= found.state.meshes.size()) return false;  // a ball
        const TriangleMesh& mesh = found.state.meshes[arguments->geomID].mesh;
        const auto& t = mesh.triangles[arguments->primID];
        const double distance =
            std::sqrt(squared_distance(found.point, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
        if (!(distance < found.nearest)) return false;
        found.nearest = distance;
        arguments->query->radius = static_cast<float>(distance);
        return true;
      },
      &search);
  return search.nearest;
}

bool RayScene::nothing_beyond(double z, bool up) const {
  return state_->all_heights.misses(z, std::copysign(1e30, up ? 1.0 : -1.0));
}

bool RayScene::has_refractive() const {
  return state_->has_refractive;
}

bool RayScene::meets_refractive(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  if (!finite(from, to)) return false;
  RTCRay ray = embree_ray(from, to - from, 1.0);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(state_->refractive, &context, &ray);
  return ray.tfar < 0.0f;
}

double RayScene::refractive_along_z(const Eigen::Vector3d& origin, bool up, double most) const {
  const Eigen::Vector3d direction(0.0, 0.0, up ? 1.0 : -1.0);
  if (!finite(origin, direction) || !(most > 0.0)) return -1.0;
  RTCRayHit found;
  found.ray = embree_ray(origin, direction, most);
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(state_->refractive, &context, &found);
  return found.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1.0 : double(found.ray.tfar);
}

}  // namespace touchstone::render
