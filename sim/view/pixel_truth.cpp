#include "sim/view/pixel_truth.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>
#include <type_traits>

#include "core/error.h"
#include "render/cameras/first_hits.h"
#include "sim/view/skin_pins.h"

namespace touchstone::sim {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// A first hit with its meaning.
struct SeenPoint {
  int id = PixelId::kNothing;
  bool contact = false;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> rest;  ///< where the material point was; none where that isn't known
};

SeenPoint inside_point(const SeenGeometry& seen, const render::FirstHit& hit) {
  SeenPoint point{PixelId::kFrame, false, hit.position, hit.normal, hit.position};
  const auto surfaces = static_cast<int>(seen.inside.surfaces.size());
  if (hit.object >= surfaces) {
    const int bead = hit.object - surfaces;
    point.id = PixelId::kFirstBead + bead;
    point.rest = hit.position - Eigen::Vector3d(seen.bead_displacement.row(bead));
  } else if (hit.object == 0) {
    const int touched = seen.sheet.touched[static_cast<std::size_t>(hit.triangle)];
    const auto& t = seen.sheet.mesh.triangles[static_cast<std::size_t>(hit.triangle)];
    const auto at_hit = [&](const auto& values) {
      const auto at = [&](int corner) { return values[static_cast<std::size_t>(t[corner])]; };
      using Value = std::decay_t<decltype(values[0])>;
      return Value((1.0 - hit.u - hit.v) * at(0) + hit.u * at(1) + hit.v * at(2));
    };
    point.contact = touched >= 0;
    point.id = point.contact ? PixelId::kFirstObject + touched : PixelId::kGel;
    point.rest = at_hit(seen.sheet.rest);
    const int marker = seen.print.empty() ? -1 : seen.markers.mark_at(at_hit(seen.print));
    if (marker >= 0) point.id = PixelId::kFirstMarker + marker;
  } else if (hit.object == 2) {
    const auto& t = seen.inside.surfaces[2].mesh.triangles[static_cast<std::size_t>(hit.triangle)];
    const auto rest = [&](int corner) -> const Eigen::Vector3d& {
      return seen.pins_rest[static_cast<std::size_t>(t[corner])];
    };
    point.id = PixelId::kFirstMarker + hit.triangle / SkinPins::kTriangles;
    point.rest = (1.0 - hit.u - hit.v) * rest(0) + hit.u * rest(1) + hit.v * rest(2);
  }
  return point;
}

SeenPoint beyond_point(const SeenGeometry& seen, const render::FirstHit& hit) {
  const SeenBody& body = seen.bodies[static_cast<std::size_t>(hit.object)];
  const int first = body.screen ? PixelId::kFirstScreen : PixelId::kFirstObject;
  return {first + body.object, false, hit.position, hit.normal, {}};
}

}  // namespace

LinearImage pixel_truth(const SeenGeometry& seen, const render::Camera& camera_of, const OutputSpec& outputs) {
  const render::ReadyCamera camera = render::make_ready(camera_of);
  const Eigen::Vector2i size = render::size_of(camera);
  const std::vector<render::FirstHit> inside = render::first_hits(seen.inside, camera);
  std::vector<render::FirstHit> beyond;
  const bool gaps = std::any_of(inside.begin(), inside.end(), [](const auto& hit) { return hit.object < 0; });
  if (gaps) beyond = render::first_hits(seen.beyond, camera);
  const RigidTransform camera_from_gel = render::pose_of(camera).inverse();

  LinearImage out;
  const auto channels = [&](bool wanted, std::initializer_list<const char*> names) {
    if (wanted) out.channel_names.insert(out.channel_names.end(), names.begin(), names.end());
  };
  channels(outputs.depth, {"depth.Z"});
  channels(outputs.normals, {"normal.X", "normal.Y", "normal.Z"});
  channels(outputs.ids, {"id.ID"});
  channels(outputs.contact, {"contact.Y"});
  channels(outputs.flow, {"flow.X", "flow.Y"});
  TS_ASSERT(!out.channel_names.empty());
  const auto count = static_cast<int>(out.channel_names.size());
  out.image.create(size.y(), size.x(), CV_32FC(count));

  tbb::parallel_for(0, size.y(), [&](int row) {
    auto* value = out.image.ptr<float>(row);
    for (int column = 0; column < size.x(); ++column) {
      const auto i =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(size.x()) + static_cast<std::size_t>(column);
      SeenPoint point;
      if (inside[i].object >= 0) {
        point = inside_point(seen, inside[i]);
      } else if (beyond[i].object >= 0) {
        point = beyond_point(seen, beyond[i]);
      }
      const bool any = point.id != PixelId::kNothing;
      if (outputs.depth) *value++ = any ? static_cast<float>((camera_from_gel * point.position).z()) : kNone;
      if (outputs.normals) {
        for (int axis = 0; axis < 3; ++axis) *value++ = any ? static_cast<float>(point.normal[axis]) : kNone;
      }
      if (outputs.ids) *value++ = static_cast<float>(point.id);
      if (outputs.contact) *value++ = point.contact ? 1.0f : 0.0f;
      if (outputs.flow) {
        std::optional<Eigen::Vector2d> was;
        if (point.rest) was = render::project_through_faces(seen.inside, camera, *point.rest);
        const Eigen::Vector2d here(column + 0.5, row + 0.5);
        for (int axis = 0; axis < 2; ++axis) *value++ = was ? static_cast<float>((*was - here)[axis]) : kNone;
      }
    }
  });
  return out;
}

void add_channel(LinearImage& image, const cv::Mat& channel, const std::string& name) {
  TS_ASSERT(channel.type() == CV_32FC1 && (image.image.empty() || image.image.size() == channel.size()));
  std::vector<cv::Mat> planes;
  if (!image.image.empty()) cv::split(image.image, planes);
  planes.push_back(channel);
  cv::merge(planes, image.image);
  image.channel_names.push_back(name);
}

}  // namespace touchstone::sim
