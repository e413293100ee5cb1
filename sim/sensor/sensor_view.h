#pragma once
// The backends of light behind a virtual sensor: each shows a device's camera the states of a touch.

#include <Eigen/Core>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "fem/contact/press.h"
#include "render/cameras/camera.h"
#include "sim/scene/object.h"
#include "sim/sensor/light_between.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {

/// What a camera sees of one state. Pictures have the camera's size.
struct SeenTouch {
  cv::Mat light;    ///< CV_32FC(bands), W/m^2 on the sensor
  cv::Mat height;   ///< as Touch::height; empty where it wasn't asked for, or isn't seen
  cv::Mat contact;  ///< as Touch::contact; likewise
};

/// An object as a sensor's view keeps it: what all its pictures share.
struct SeenObject {
  ObjectSpec spec;
  fem::ContactShape shape;                        ///< what the gel's mesh can see of it
  fem::ContactShape detailed;                     ///< with all its relief
  std::string warning;                            ///< TouchObject::warning
  mutable std::mutex making;                      ///< of what follows, which a sensor's view makes at the first picture
  mutable std::shared_ptr<const SceneView> view;  ///< of coated and milky gels
  mutable std::map<std::array<double, 3>, std::shared_ptr<const VirtualCamera>> cameras;  ///< by where a screen stands
  mutable std::optional<SceneBands> bands;                                                ///< of clear gels
};

/// One backend. Its functions may be called from many threads at once and are pure.
class SensorView {
 public:
  virtual ~SensorView() = default;

  /// Which effects the view simulates.
  virtual const Plan& plan() const = 0;
  /// How its pictures are lit, and why so.
  virtual const LightChoice& choice() const = 0;
  /// The bands of the light of an object's pictures: those of plan(), but where the object's colour is seen.
  virtual SceneBands bands(const SeenObject& /*object*/) const { return plan().bands; }

  /// `start_mm`: where the object's motion began, which is where its screen stands.
  /// @throws Error if the gel went beyond what the light was set up for
  virtual SeenTouch see(const SeenObject& object, const fem::PressState& press, const Eigen::Vector3d& start_mm,
                        bool truth) const = 0;
  /// By what an object's states can be drawn so that their pictures can be moved to states between them
  /// (sim/sensor/light_between.h), without `currents`; nothing where they can't.
  virtual std::optional<LightOfKeys> light_of_keys(const SeenObject& /*object*/) const { return std::nullopt; }
  /// The light of the untouched device; of a clear one with the object (if any) standing at `start_mm`.
  virtual cv::Mat rest_light(const SeenObject* object, const Eigen::Vector3d& start_mm) const = 0;
  /// Where the camera sees a point of the gel frame; nothing where it doesn't.
  virtual std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& point) const = 0;
};

}  // namespace touchstone::sim
