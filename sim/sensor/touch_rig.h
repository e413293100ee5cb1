#pragma once
// A device on a bench: set up once, then touched by any object in any way, frame by frame. What experiments and control
// loops are built on; whole scenes from files go the way of sim/virtual_sensor.h.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "fem/contact/press.h"
#include "fem/shapes/contact_shape.h"
#include "sim/press/truth.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {

struct TouchRigSettings {
  std::uint64_t seed = 1;     ///< of the unit: its imager's fixed pattern, and the light's samples
  double deepest_mm = 1.2;    ///< how far the gel will be pressed in: what the light field has to hold
  double widest_mm = 0.5;     ///< how far it will be sheared
  double membrane_um = 40.0;  ///< pixels of the fine contact (MembraneSpec::pixel_um)
  double interreflection_tolerance = 0.05;
  bool always_friction = false;  ///< also in straight presses, where the plan leaves it out: it holds the surface
                                 ///< together under an object, which else stretches
  int edge_side = 4;  ///< rays along a side of pixels that differ from those beside them (render::DirectSettings): on a
                      ///< rough object these are all pixels
  render::GuideCut guides;  ///< light guides' light in the light field; fewer beams are quicker and a little less right
  /// All that the light hangs on besides these settings, such as the device's file and the program's checksum. Where it
  /// is given, what was found about the light is kept with the gel and read back; empty: it's found anew each time.
  std::string light_key;
};

/// One frame and what is true of it. Pictures have the camera's size.
struct Touch {
  cv::Mat frame;    ///< as the camera delivers it: 8 bit, BGR or grey, with noise
  cv::Mat light;    ///< CV_32FC(bands), W/m^2 on the sensor: what the frame was exposed to
  cv::Mat height;   ///< CV_32FC1, mm: how far the membrane that the pixel sees is pressed in, against what the pixel
                    ///< sees at rest, along the gel frame's z; NaN where it sees no membrane
  cv::Mat contact;  ///< CV_8UC1, 255 where the pixel sees membrane that lies on the object
};

/// An object that can touch a rig's device. Made by TouchRig::object; keeps what all its frames share.
class TouchObject {
 public:
  const ObjectSpec& spec() const { return sight_->scene.object; }
  /// What mechanics feels of it (for fem::Press, step by step).
  const fem::ContactShape& felt() const { return sight_->objects.front().felt; }

 private:
  friend class TouchRig;
  std::shared_ptr<const SceneView> sight_;
};

/// Safe to use from many threads; all functions are pure but for the first use of an object's shape.
class TouchRig {
 public:
  /// Sets up the gel (from the cache where it is there), the light and the imager. The light is direct light, whatever
  /// its error (`light().error` tells; render/direct/direct_renderer.h), where the device is fit for it; else paths are
  /// traced.
  /// @throws Error for a device without a camera or a coating
  TouchRig(DeviceSpec device, const std::filesystem::path& cache_folder, const TouchRigSettings& settings = {});
  ~TouchRig();

  const DeviceSpec& device() const;
  const fem::Compliance& gel() const;
  const LightChoice& light() const;
  /// Of the undeformed membrane's middle.
  double mm_per_px() const;
  /// Where on the undeformed membrane a point of the picture (pixels, centres at + 0.5) lies, gel frame, mm.
  Eigen::Vector2d gel_from_pixel(const Eigen::Vector2d& pixel) const;
  Eigen::Vector2d pixel_from_gel(const Eigen::Vector2d& place) const;

  /// @throws Error for an object whose files can't be read
  TouchObject object(const ObjectSpec& spec) const;
  /// The states of a motion, one a frame, by play_motion: friction with its history where the motion calls for it.
  std::vector<Truth> play(const TouchObject& object, const MotionSpec& motion) const;

  /// The frame of a state. `noise_seed` and `frame` choose the imager's noise. Without `truth` only the frame is made.
  /// @throws Error if the gel went beyond what TouchRigSettings say
  Touch look(const TouchObject& object, const fem::PressState& press, std::uint64_t noise_seed, int frame = 0,
             bool truth = true) const;
  /// The frame of the untouched device.
  cv::Mat background(std::uint64_t noise_seed, int frame = 0) const;
  /// The light of the untouched device.
  const cv::Mat& background_light() const;
  /// The frame of a light without noise and fixed pattern.
  cv::Mat ideal(const cv::Mat& light) const;
  /// A frame of the light of any of them, with other noise.
  cv::Mat develop(const cv::Mat& light, std::uint64_t noise_seed, int frame = 0) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::sim
