#include "render/scene/packet_scene.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "core/error.h"
#include "render/scene/embree_device.h"
#include "render/scene/film_screen.h"

namespace touchstone::render {

struct PacketScene::State {
  struct Mesh {
    std::vector<std::array<int, 3>> triangles;
    std::size_t vertex_count = 0;
    RTCGeometry geometry = nullptr;  // none for a mesh without triangles
    float* vertices = nullptr;
    std::vector<Eigen::Vector3f> normals;  // at the vertices; empty: triangles are flat

    void take_normals(const std::vector<Eigen::Vector3d>& from) {
      normals.resize(from.size());
      for (std::size_t k = 0; k < from.size(); ++k) normals[k] = from[k].cast<float>();
    }
  };
  std::vector<Mesh> meshes;
  std::size_t ball_count = 0;
  RTCGeometry ball_geometry = nullptr;
  float* ball_points = nullptr;
  RTCScene scene = nullptr;

  ~State() {
    for (const Mesh& mesh : meshes) {
      if (mesh.geometry != nullptr) rtcReleaseGeometry(mesh.geometry);
    }
    if (ball_geometry != nullptr) rtcReleaseGeometry(ball_geometry);
    if (scene != nullptr) rtcReleaseScene(scene);
  }

  static void place(const TriangleMesh& mesh, float* out) {
    for (const Eigen::Vector3d& vertex : mesh.vertices) {
      for (int a = 0; a < 3; ++a) *out++ = static_cast<float>(vertex[a]);
    }
  }
  static void smooth(const RayPacket& rays, int lane, const Mesh& mesh, unsigned triangle, float u, float v,
                     PacketHits& hits);
  static void place(const std::vector<Ball>& balls, float* out) {
    for (const Ball& ball : balls) {
      for (int a = 0; a < 3; ++a) *out++ = static_cast<float>(ball.centre[a]);
      *out++ = static_cast<float>(ball.radius);
    }
  }
};

PacketScene::PacketScene(const Scene& scene) : state_(std::make_unique<State>()) {
  State& state = *state_;
  const RTCDevice device = embree_device();
  state.scene = rtcNewScene(device);
  // Boxes are fitted anew only in a dynamic scene of low quality; other settings build the tree again at each commit.
  rtcSetSceneFlags(state.scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC);
  rtcSetSceneBuildQuality(state.scene, RTC_BUILD_QUALITY_LOW);
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    const TriangleMesh& mesh = scene.surfaces[i].mesh;
    State::Mesh& made = state.meshes.emplace_back();
    made.triangles = mesh.triangles;
    made.vertex_count = mesh.vertices.size();
    made.take_normals(scene.surfaces[i].normals);
    if (mesh.triangles.empty() || is_film(scene.surfaces[i])) continue;
    made.geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    made.vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        made.geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        made.geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (made.vertices == nullptr || corners == nullptr) fail("surface {}: no memory for its triangles", i);
    State::place(mesh, made.vertices);
    for (const auto& triangle : mesh.triangles) {
      for (int corner : triangle) *corners++ = static_cast<unsigned>(corner);
    }
    rtcSetGeometryBuildQuality(made.geometry, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(made.geometry);
    rtcAttachGeometryByID(state.scene, made.geometry, static_cast<unsigned>(i));
  }
  state.ball_count = scene.balls.size();
  if (!scene.balls.empty()) {
    state.ball_geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    state.ball_points = static_cast<float*>(rtcSetNewGeometryBuffer(
        state.ball_geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), scene.balls.size()));
    if (state.ball_points == nullptr) fail("no memory for {} balls", scene.balls.size());
    State::place(scene.balls, state.ball_points);
    rtcCommitGeometry(state.ball_geometry);
    rtcAttachGeometryByID(state.scene, state.ball_geometry, static_cast<unsigned>(scene.surfaces.size()));
  }
  tbb::task_arena alone(1);
  alone.execute([&] { rtcCommitScene(state.scene); });
  for (const State::Mesh& mesh : state.meshes) {
    if (mesh.geometry != nullptr) rtcSetGeometryBuildQuality(mesh.geometry, RTC_BUILD_QUALITY_REFIT);
  }
  if (state.ball_geometry != nullptr) rtcSetGeometryBuildQuality(state.ball_geometry, RTC_BUILD_QUALITY_REFIT);
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) fail("Embree can't take the scene (error {})", static_cast<int>(error));
}

PacketScene::~PacketScene() = default;
PacketScene::PacketScene(PacketScene&&) noexcept = default;

bool PacketScene::move_to(const Scene& scene) {
  State& state = *state_;
  if (scene.surfaces.size() != state.meshes.size() || scene.balls.size() != state.ball_count) return false;
  for (std::size_t i = 0; i < state.meshes.size(); ++i) {
    const TriangleMesh& mesh = scene.surfaces[i].mesh;
    const bool left_out = mesh.triangles.empty() || is_film(scene.surfaces[i]);
    if (mesh.vertices.size() != state.meshes[i].vertex_count || mesh.triangles != state.meshes[i].triangles ||
        left_out != (state.meshes[i].geometry == nullptr)) {
      return false;
    }
  }
  for (std::size_t i = 0; i < state.meshes.size(); ++i) {
    State::Mesh& mesh = state.meshes[i];
    mesh.take_normals(scene.surfaces[i].normals);
    if (mesh.geometry == nullptr) continue;
    State::place(scene.surfaces[i].mesh, mesh.vertices);
    rtcUpdateGeometryBuffer(mesh.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(mesh.geometry);
  }
  if (state.ball_geometry != nullptr) {
    State::place(scene.balls, state.ball_points);
    rtcUpdateGeometryBuffer(state.ball_geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(state.ball_geometry);
  }
  rtcCommitScene(state.scene);
  const RTCError error = rtcGetDeviceError(embree_device());
  if (error != RTC_ERROR_NONE) fail("Embree can't take the scene (error {})", static_cast<int>(error));
  return true;
}

namespace {

void load(const RayPacket& rays, RTCRay16& ray) {
  std::memcpy(ray.org_x, rays.origin[0], sizeof ray.org_x);
  std::memcpy(ray.org_y, rays.origin[1], sizeof ray.org_y);
  std::memcpy(ray.org_z, rays.origin[2], sizeof ray.org_z);
  std::memcpy(ray.dir_x, rays.direction[0], sizeof ray.dir_x);
  std::memcpy(ray.dir_y, rays.direction[1], sizeof ray.dir_y);
  std::memcpy(ray.dir_z, rays.direction[2], sizeof ray.dir_z);
  std::memcpy(ray.tfar, rays.far, sizeof ray.tfar);
  for (int lane = 0; lane < kPacket; ++lane) {
    ray.tnear[lane] = 0.0f;
    ray.time[lane] = 0.0f;
    ray.mask[lane] = 0xffffffffu;
    ray.id[lane] = 0;
    ray.flags[lane] = 0;
  }
}

RTCIntersectContext coherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

}  // namespace

/// The shading normal of a lane's hit on a mesh with normals, and its lift: RayScene's formulas.
void PacketScene::State::smooth(const RayPacket& rays, int lane, const Mesh& mesh, unsigned triangle, float u, float v,
                                PacketHits& hits) {
  const auto& corners = mesh.triangles[triangle];
  const float weights[3] = {1.0f - u - v, u, v};
  Eigen::Vector3f points[3];
  Eigen::Vector3f place = Eigen::Vector3f::Zero();
  Eigen::Vector3f shading = Eigen::Vector3f::Zero();
  for (int k = 0; k < 3; ++k) {
    points[k] = Eigen::Map<const Eigen::Vector3f>(mesh.vertices + 3 * corners[k]);
    place += weights[k] * points[k];
    shading += weights[k] * mesh.normals[corners[k]];
  }
  const Eigen::Vector3f normal(hits.normal[0][lane], hits.normal[1][lane], hits.normal[2][lane]);
  const float length = shading.norm();
  // A fold sharper than that isn't a smooth surface.
  if (!(length > 0.1f && shading.dot(normal) > 0.5f * length * normal.norm())) return;
  const Eigen::Vector3f ray(rays.direction[0][lane], rays.direction[1][lane], rays.direction[2][lane]);
  const bool outside = ray.dot(normal) < 0.0f;
  Eigen::Vector3f lift = Eigen::Vector3f::Zero();
  for (int k = 0; k < 3; ++k) {
    const float above = (points[k] - place).dot(mesh.normals[corners[k]]);
    if ((above > 0.0f) == outside) lift += weights[k] * above * mesh.normals[corners[k]];
  }
  for (int a = 0; a < 3; ++a) {
    hits.shading[a][lane] = shading[a];
    hits.lift[a][lane] = lift[a];
  }
}

void PacketScene::intersect(const RayPacket& rays, PacketHits& hits) const {
  RTCRayHit16 found;
  load(rays, found.ray);
  for (int lane = 0; lane < kPacket; ++lane) {
    found.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    found.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context = coherent();
  rtcIntersect16(rays.valid, state_->scene, &context, &found);
  for (int lane = 0; lane < kPacket; ++lane) {
    const unsigned geometry = found.hit.geomID[lane];
    const bool hit = rays.valid[lane] != 0 && geometry != RTC_INVALID_GEOMETRY_ID;
    const bool ball = geometry == state_->meshes.size();
    hits.object[lane] = hit ? static_cast<int>(geometry + (ball ? found.hit.primID[lane] : 0u)) : -1;
    hits.triangle[lane] = hit && !ball ? static_cast<int>(found.hit.primID[lane]) : -1;
    hits.u[lane] = found.hit.u[lane];
    hits.v[lane] = found.hit.v[lane];
    hits.distance[lane] = found.ray.tfar[lane];
    hits.normal[0][lane] = found.hit.Ng_x[lane];
    hits.normal[1][lane] = found.hit.Ng_y[lane];
    hits.normal[2][lane] = found.hit.Ng_z[lane];
    for (int a = 0; a < 3; ++a) {
      hits.shading[a][lane] = hits.normal[a][lane];
      hits.lift[a][lane] = 0.0f;
    }
    if (!hit || ball || state_->meshes[geometry].normals.empty()) continue;
    State::smooth(rays, lane, state_->meshes[geometry], found.hit.primID[lane], found.hit.u[lane], found.hit.v[lane],
                  hits);
  }
}

void PacketScene::occluded(const RayPacket& rays, int* free) const {
  RTCRay16 ray;
  load(rays, ray);
  RTCIntersectContext context = coherent();
  rtcOccluded16(rays.valid, state_->scene, &context, &ray);
  for (int lane = 0; lane < kPacket; ++lane) free[lane] = rays.valid[lane] != 0 && ray.tfar[lane] >= 0.0f ? -1 : 0;
}

}  // namespace touchstone::render
