#include "sim/sensor/milky_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/locked_work.h"
#include "fem/fine_relief/fine_relief.h"
#include "render/cameras/first_hits.h"
#include "render/imager/imager.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_faces.h"
#include "sim/sensor/membrane_camera.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {
namespace {

constexpr double kMapCell_mm = 0.1;    // of the maps of what stands before the face; the camera's cells are twice that
constexpr double kTouching_mm = 1e-3;  // fine contact leaves less than that between gel and object
constexpr double kFar_mm = 1e3;        // what is further off isn't there

/// A grey camera sees the mean of an object's colours, which shipped objects give for red, green and blue.
ObjectSpec in_grey(ObjectSpec object) {
  if (const std::vector<double>& of = object.albedo.numbers; of.size() > 1) {
    object.albedo = Colour(std::accumulate(of.begin(), of.end(), 0.0) / static_cast<double>(of.size()));
  }
  return object;
}

class MilkyView final : public SensorView {
 public:
  MilkyView(const DeviceSpec& device, const fem::Compliance& gel, const VirtualSensorSettings& settings)
      : device_(device), gel_(gel), settings_(settings), camera_(device, {.seed = settings.seed}) {
    plan_ = make_plan(scene_of(ObjectSpec{}));
    choice_.reason = "maps: the gel is a milky slab before the room (sim/sensor/membrane_camera.h)";
    ready_ = render::make_ready(camera_of(*device_.camera));
    faces_ = clear_layers(device_);
    rest_light_ = camera_.irradiance(camera_.free_face());
    const auto& slab = std::get<SlabSpec>(device_.gel.shape);
    const int columns = static_cast<int>(std::ceil(slab.size_x_mm / kMapCell_mm));
    const int rows = static_cast<int>(std::ceil(slab.size_y_mm / kMapCell_mm));
    map_.pitch = kMapCell_mm;
    map_.nx = columns;
    map_.ny = rows;
    map_.first = {-0.5 * kMapCell_mm * (columns - 1), -0.5 * kMapCell_mm * (rows - 1)};
  }

  const Plan& plan() const override { return plan_; }
  const LightChoice& choice() const override { return choice_; }

  SeenTouch see(const SeenObject& object, const fem::PressState& press, const Eigen::Vector3d&,
                bool truth) const override {
    const SceneView& view = view_of(object);
    const auto relief = view.relief(press);
    const fem::ReliefAnswer* fine = relief && relief->grid.nx > 0 ? &*relief : nullptr;
    const fem::HeightField heights(*view.membrane->surface(), press, fine);
    const RigidTransform gel_from_object = fine != nullptr ? fine->moved(press.gel_from_object) : press.gel_from_object;
    const RigidTransform object_from_gel = gel_from_object.inverse();
    const Eigen::Vector3d up = object_from_gel.turn(Eigen::Vector3d::UnitZ());
    const fem::ContactShape shape = contact_shape(object.spec);
    cv::Mat gap(map_.ny, map_.nx, CV_32FC1, cv::Scalar(std::numeric_limits<float>::infinity()));
    cv::Mat coverage(map_.ny, map_.nx, CV_32FC1, cv::Scalar(0.0));
    cv::Mat height(map_.ny, map_.nx, CV_32FC1);
    for (int j = 0; j < map_.ny; ++j) {
      for (int i = 0; i < map_.nx; ++i) {
        const Eigen::Vector2d place = map_.first + map_.pitch * Eigen::Vector2d(i, j);
        const double face = heights.at(place);
        height.at<float>(j, i) = static_cast<float>(-face);
        const auto bottom = fem::first_entry(shape, object_from_gel * Eigen::Vector3d(place.x(), place.y(), 0.0), up);
        if (!bottom) continue;
        const double between = std::max(0.0, *bottom - face);
        gap.at<float>(j, i) = static_cast<float>(between);
        if (press.contact_vertices > 0 && between < kTouching_mm) coverage.at<float>(j, i) = 1.0F;
      }
    }
    const fem::BoundingBall ball = fem::bounding_ball(shape);
    const double top = (gel_from_object * ball.centre).z() + ball.radius;
    const double albedo = in_one_band(device_, in_grey(object.spec).albedo, "albedo");
    SeenTouch seen;
    seen.light = camera_.irradiance(
        face_state(camera_.grid(), map_, coverage, gap, kFar_mm, albedo, std::max(top, kMapCell_mm)));
    if (truth) show_truth(height, coverage, seen);
    return seen;
  }

  cv::Mat rest_light(const SeenObject*, const Eigen::Vector3d&) const override { return rest_light_; }

  std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& point) const override {
    return render::project_through_faces(faces_, ready_, point);
  }

 private:
  const SceneView& view_of(const SeenObject& object) const {
    locked_work(object.making, [&] {
      if (object.view) return;
      const SceneSpec scene = scene_of(object.spec);
      object.view = std::make_shared<const SceneView>(scene, make_plan(scene), gel_);
    });
    return *object.view;
  }

  SceneSpec scene_of(const ObjectSpec& object) const {
    SceneSpec scene;
    scene.device = device_;
    scene.object = in_grey(object);
    scene.seed = settings_.seed;
    scene.outputs = {};
    scene.outputs.frames = false;
    scene.outputs.height = true;
    scene.membrane.pixel_um = std::max(settings_.membrane_um, 0.5e3 * kMapCell_mm);
    scene.effects = effects_of(device_, settings_, object);
    if (scene.effects.fine_relief == Switch::automatic) scene.effects.fine_relief = Switch::on;
    return scene;
  }

  /// Heights and contact of the face as they lie on the sensor: what the pixel's ray would meet of a clear gel.
  void show_truth(const cv::Mat& height, const cv::Mat& coverage, SeenTouch& seen) const {
    const cv::Size size(device_.camera->width, device_.camera->height);
    seen.height = cv::Mat(size, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
    seen.contact = cv::Mat(size, CV_8U, cv::Scalar(0));
    const Places& places = face_of_pixels();
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const Eigen::Vector2d at = (places[static_cast<std::size_t>(y) * size.width + x] - map_.first) / map_.pitch;
        const int i = static_cast<int>(std::lround(at.x()));
        const int j = static_cast<int>(std::lround(at.y()));
        if (!at.allFinite() || i < 0 || j < 0 || i >= map_.nx || j >= map_.ny) continue;
        seen.height.at<float>(y, x) = height.at<float>(j, i);
        if (coverage.at<float>(j, i) > 0.5F) seen.contact.at<std::uint8_t>(y, x) = 255;
      }
    }
  }

  using Places = std::vector<Eigen::Vector2d>;

  /// Where on the undeformed face each pixel looks: an affine map fitted to the projection at the face's places near
  /// the pixel, by Newton's steps from the pixel before.
  const Places& face_of_pixels() const {
    std::call_once(places_made_, [this] {
      constexpr double kStep_mm = 0.05;
      constexpr int kMostSteps = 20;
      const cv::Size size(device_.camera->width, device_.camera->height);
      const Eigen::Vector2d nowhere = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
      places_.assign(static_cast<std::size_t>(size.area()), nowhere);
      const auto seen_at = [&](const Eigen::Vector2d& place) { return pixel_of({place.x(), place.y(), 0.0}); };
      for (int y = 0; y < size.height; ++y) {
        Eigen::Vector2d place(0, 0);
        for (int x = 0; x < size.width; ++x) {
          const Eigen::Vector2d wanted(x + 0.5, y + 0.5);
          bool found = false;
          for (int step = 0; step < kMostSteps && !found; ++step) {
            const auto here = seen_at(place);
            const auto right = seen_at(place + Eigen::Vector2d(kStep_mm, 0));
            const auto down = seen_at(place + Eigen::Vector2d(0, kStep_mm));
            if (!here || !right || !down) break;
            Eigen::Matrix2d slope;
            slope.col(0) = (*right - *here) / kStep_mm;
            slope.col(1) = (*down - *here) / kStep_mm;
            const double determinant = slope(0, 0) * slope(1, 1) - slope(0, 1) * slope(1, 0);
            if (determinant == 0.0) break;
            const Eigen::Vector2d off = wanted - *here;
            const Eigen::Vector2d change((slope(1, 1) * off.x() - slope(0, 1) * off.y()) / determinant,
                                         (slope(0, 0) * off.y() - slope(1, 0) * off.x()) / determinant);
            place += change;
            found = change.norm() < 1e-3 * kMapCell_mm;
          }
          if (found) {
            places_[static_cast<std::size_t>(y) * size.width + x] = place;
          } else {
            place = {0, 0};
          }
        }
      }
    });
    return places_;
  }

  DeviceSpec device_;
  const fem::Compliance& gel_;
  VirtualSensorSettings settings_;
  MembraneCamera camera_;
  Plan plan_;
  LightChoice choice_;
  render::ReadyCamera ready_;
  render::Scene faces_;
  cv::Mat rest_light_;
  fem::PixelGrid map_;
  mutable std::once_flag places_made_;
  mutable Places places_;
};

}  // namespace

bool is_milky(const DeviceSpec& device) {
  return device.gel.scattering_per_mm.largest() > 0.0 && device.gel.slab() && device.gel.layers.empty() &&
         !device.coating && !device.beads && !device.films && device.lamps.empty() && !device.bands &&
         device.band_wavelengths_nm.size() == 1 && device.camera && device.camera->bayer == render::BayerPattern::none;
}

std::unique_ptr<const SensorView> milky_view(const DeviceSpec& device, const fem::Compliance& gel,
                                             const VirtualSensorSettings& settings) {
  return std::make_unique<const MilkyView>(device, gel, settings);
}

}  // namespace touchstone::sim
