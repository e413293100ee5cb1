#pragma once
// A device under test: press this here with so much force, and have the frame, the truth and the truth's error bar.
// What touchstone/testing.h and `touchstone serve` stand on.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/error/press_error.h"
#include "sim/scene/device.h"
#include "sim/scene/motion.h"
#include "sim/scene/object.h"

namespace touchstone::sim {

/// How an object is held against the gel. Exactly one of `force_N` and `depth_mm` is given.
struct Hold {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();    ///< of the object's origin, gel frame
  Eigen::Vector3d angles_deg = Eigen::Vector3d::Zero();  ///< about the fixed axes x, then y, then z
  std::optional<double> force_N = {};                    ///< normal, on the object; above 0
  std::optional<double> depth_mm = {};                   ///< how far it is lowered beyond its first touch; above 0
  Eigen::Vector2d drag_mm = Eigen::Vector2d::Zero();     ///< then moved along the gel, its force or height being held
};

/// A frame and what is true of it. Forces are on the object, gel frame: pressing gives z > 0.
struct HeldFrame {
  std::string what;    ///< device, object and hold in words, for messages: "small, ball at (0, 0) mm with 2 N"
  cv::Mat frame;       ///< 8 bit, BGR or grey, with noise
  cv::Mat background;  ///< the untouched device with other noise
  cv::Mat light;       ///< CV_32FC(bands), W/m^2 on the sensor: what the frame was exposed to
  cv::Mat height;      ///< CV_32FC1, mm, see Touch; empty of a device without a coating
  cv::Mat contact;     ///< CV_8UC1, 255 where the pixel sees gel that lies on the object
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque_Nmm = Eigen::Vector3d::Zero();  ///< about the gel frame's origin
  fem::PressError error;                                 ///< one standard error of what the mesh makes of it
  fem::PressState press;                                 ///< all else: pose, tractions, displacement of gel and beads
  /// Another frame of the same light, with the noise of another seed; none without pictures. Safe from many threads,
  /// while the device lives.
  std::function<cv::Mat(std::uint64_t noise_seed)> expose;
};

struct VirtualDeviceSettings {
  std::uint64_t seed = 1;     ///< of the unit: its imager's fixed pattern and the light's samples
  double deepest_mm = 1.2;    ///< of a coated device: how far its gel will be pressed in (TouchRigSettings)
  double widest_mm = 0.5;     ///< and how far it will be sheared
  double membrane_um = 40.0;  ///< pixels of its fine contact
  int drag_frames = 5;        ///< steps in which an object is dragged
};

/// How far an object may be lowered from its start at z = 0 until it first touches the undeformed gel, mm: less than
/// zero for what starts inside of it. `felt` is the object's shape, `place_mm` and `angles_deg` as in Hold.
/// @throws Error if it isn't over the gel
double way_to_touch(const fem::ContactShape& felt, const fem::Compliance& gel, const Eigen::Vector2d& place_mm,
                    const Eigen::Vector3d& angles_deg);

/// The motion of a hold: from just above the gel down, then along it. `touch_mm` is what way_to_touch gave.
/// @throws Error for a hold with neither or both of force and depth, or numbers that aren't finite or not above 0
MotionSpec press_motion(const Hold& hold, double touch_mm, int drag_frames = 5);

/// An object that can be held against a device. Made by VirtualDevice::object; keeps what all its frames share.
class VirtualObject {
 public:
  const ObjectSpec& spec() const;

 private:
  friend class VirtualDevice;
  struct Parts;
  std::shared_ptr<Parts> parts_;
};

/// Set up once, then touched. A coated device's light is a light field's (sim/sensor/touch_rig.h); a clear one's is
/// path-traced, which takes seconds for each object's first frame. Safe to use from many threads; the same hold and
/// noise seed give the same bytes.
class VirtualDevice {
 public:
  /// @throws Error for a device without a camera, or that scenes can't show either (a curved gel without a coating)
  VirtualDevice(DeviceSpec device, const std::filesystem::path& cache_folder,
                const VirtualDeviceSettings& settings = {});
  ~VirtualDevice();
  VirtualDevice(const VirtualDevice&) = delete;
  VirtualDevice& operator=(const VirtualDevice&) = delete;

  const DeviceSpec& device() const;
  const fem::Compliance& gel() const;

  /// @throws Error for an object whose files can't be read, or that is elastic: those take whole scenes
  VirtualObject object(const ObjectSpec& spec) const;
  /// The last state of a hold's motion, without a picture.
  /// @throws Error, naming device, object and hold, for a hold that can't be (see press_motion), where the object isn't
  ///   over the gel, slips under the drag ("gross slip"), or goes deeper than the gel
  HeldFrame feel(const VirtualObject& object, const Hold& hold) const;
  /// The same with pictures; of a clear device the background has the object in it, just above the gel.
  /// @throws Error also where the gel went beyond what the settings say
  HeldFrame press(const VirtualObject& object, const Hold& hold, std::uint64_t noise_seed = 1) const;
  HeldFrame press(const ObjectSpec& object, const Hold& hold, std::uint64_t noise_seed = 1) const;
  /// The untouched device: frame and background, no height nor contact, zero force.
  HeldFrame rest(std::uint64_t noise_seed = 1) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::sim
