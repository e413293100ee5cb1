#pragma once
// A virtual sensor: any device, set up once, then touched by any object in any way, frame by frame. Python's Sensor,
// touchstone/testing.h, the server, drawn data sets, fits and experiments stand on it.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/motion_chip.h"
#include "core/progress.h"
#include "fem/contact/press.h"
#include "fem/error/press_error.h"
#include "fem/shapes/contact_shape.h"
#include "sim/press/press_spec.h"
#include "sim/press/touch_session.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/sensor_view.h"
#include "sim/sensor/virtual_camera.h"

namespace touchstone::sim {

/// What the sensor is set up for: how deep it will be pressed, and how accurate its pictures are to be.
struct VirtualSensorSettings {
  std::uint64_t seed = 1;     ///< of the unit: its imager's fixed pattern, and the light's samples
  double deepest_mm = 1.2;    ///< how far the gel will be pressed in: what a light field has to hold
  double widest_mm = 0.5;     ///< how far it will be sheared
  double membrane_um = 40.0;  ///< pixels of the fine contact (MembraneSpec::pixel_um)
  /// Part of a coating's light that bounces to it and may be left out. Direct light carries it at no cost a picture.
  double interreflection_tolerance = 0.005;
  bool always_friction = false;  ///< also in straight presses, where the plan leaves it out: it holds the surface
                                 ///< together under an object, which else stretches
  /// Counts more than what this sensor and its plan would choose, where an object allows it: elastic ones have no fine
  /// contact, and are pressed in linear elasticity where the gel relaxes. Direct light and friction stay as they are.
  EffectSwitches effects;
  int edge_side = 4;  ///< rays along a side of pixels that differ from those beside them (render::DirectSettings): on a
                      ///< rough object these are all pixels
  render::GuideCut guides;  ///< light guides' light in the light field; fewer beams are quicker and a little less right
  /// Of a coated gel's light field (render::LightFieldSettings::accuracy); 0: half of what its direct light may be off.
  double field_accuracy = 0.0;
  /// All that the light depends on besides these settings, such as the device's file and the program's checksum. Where
  /// it is given, what was found about the light is kept with the gel and read back; empty: it's found anew each time.
  std::string light_key;
};

/// What a touch is asked for besides its mechanics.
struct TouchOptions {
  bool picture = true;           ///< frame and light, and what else the device's camera delivers
  bool truth = true;             ///< height and contact of each pixel
  std::uint64_t noise_seed = 1;  ///< with `frame`: of the noise in time
  int frame = 0;
};

/// One touch: what the sensor delivers and what is true of it. Pictures have the camera's size; what wasn't asked for,
/// or the device doesn't have, is empty. Forces are on the object, gel frame: pressing gives z > 0.
struct Touch {
  std::string what;       ///< device, object and press in words, for messages
  cv::Mat frame;          ///< as the camera delivers it: 8 bit, BGR or grey, with noise; of a motion chip its pixels
  cv::Mat background;     ///< the untouched device, with other noise; of press() alone
  cv::Mat light;          ///< CV_32FC(bands), W/m^2 on the sensor: what the frame was exposed to
  cv::Mat height;         ///< CV_32FC1, mm: how far the membrane that the pixel sees is pressed in, against what the
                          ///< pixel sees at rest, along the gel frame's z; NaN where it sees no membrane; empty of a
                          ///< clear device
  cv::Mat contact;        ///< CV_8UC1, 255 where the pixel sees gel that lies on the object
  fem::PressState press;  ///< pose, wrench, tractions, displacement of gel and beads
  fem::PressError error;  ///< one standard error of what the mesh makes of it
  Eigen::MatrixX3d markers_mm;  ///< middles of printed markers, or of pins' tips, on the undeformed gel, a row each
  Eigen::MatrixX3d marker_displacement;      ///< mm, a row a marker: of the material under its middle, or of the tip
  std::vector<Event> events;                 ///< of a device with event pixels: from the press's start to its end
  render::ControlState control;              ///< how a camera that sets itself has done so for `frame`
  std::optional<ChipStatistics> statistics;  ///< of a device with a motion chip: its last frame's, motion summed
  /// Another frame of the same light, with the noise of another seed; none without pictures. Safe from many threads,
  /// while the sensor lives.
  std::function<cv::Mat(std::uint64_t noise_seed)> expose;

  Eigen::Vector3d force_N() const { return press.wrench.head<3>(); }
  Eigen::Vector3d torque_Nmm() const { return press.wrench.tail<3>(); }  ///< about the gel frame's origin
};

/// An object that can touch a sensor. Made by VirtualSensor::object; keeps what all its touches share.
class TouchObject {
 public:
  const ObjectSpec& spec() const { return seen_->spec; }
  /// What the gel's mesh can see of it (for fem::Press, step by step).
  const fem::ContactShape& shape() const { return seen_->shape; }
  /// Whether its size is likely a mistake, for people (sim/plan/size_doubt.h); empty if not.
  const std::string& warning() const { return seen_->warning; }

 private:
  friend class VirtualSensor;
  std::shared_ptr<const SeenObject> seen_;
};

/// The switches of what a sensor with these settings does with an object.
EffectSwitches effects_of(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object);

/// The scene of what a virtual sensor does where `object` moves like this: its plan says which effects are simulated.
/// It asks for no image where `picture` is false, of a device without a camera, and of a milky gel, whose pictures are
/// maps (sim/sensor/milky_view.h), which no plan knows.
SceneSpec touch_scene(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object,
                      const MotionSpec& motion, bool picture = true);

/// A camera that sets itself (auto exposure, auto white balance; render/imager/automatic_control.h) has watched the
/// untouched device for long when a press begins. It then sees the light of the press's end from the first touch on:
/// from the last frame without contact to the end, which is PressSpec::seconds, or without them a frame or a few.
/// rest() and capture() show what it has watched for long.
///
/// Safe to use from many threads; the same press and seeds give the same bytes. The gel is set up at once, the light
/// when it's first needed: a light field for a coated gel (paths where direct light can't draw it), maps for a milky
/// one (sim/sensor/milky_view.h; under a coat sim/sensor/milky_coat.h), paths for a clear one, which take seconds for
/// an object's first frame. light() says which, and why.
class VirtualSensor {
 public:
  /// Sets up the gel, or reads it from the cache. @throws Error for a device or settings that make no sense
  VirtualSensor(DeviceSpec device, const std::filesystem::path& cache_folder,
                const VirtualSensorSettings& settings = {}, const Progress& progress = {});
  ~VirtualSensor();
  VirtualSensor(const VirtualSensor&) = delete;
  VirtualSensor& operator=(const VirtualSensor&) = delete;

  /// As it was given.
  const DeviceSpec& device() const;
  /// Its compliance.
  const fem::Compliance& gel() const;
  /// How pictures are lit. @throws Error for a device without a camera, as all that needs light
  const LightChoice& light() const;
  /// Of the undeformed membrane's middle.
  double mm_per_px() const;
  /// Where on the undeformed membrane a point of the picture (pixels, centres at + 0.5) lies, gel frame, mm.
  Eigen::Vector2d gel_from_pixel(const Eigen::Vector2d& pixel) const;
  /// The inverse; also for places beside the picture.
  Eigen::Vector2d pixel_from_gel(const Eigen::Vector2d& place) const;

  /// @throws Error for an object whose files can't be read
  TouchObject object(const ObjectSpec& spec) const;

  /// The touch at the end of a press. Without pictures a device needs no camera.
  /// @throws Error, naming device, object and press, for a press that can't be (see check(PressSpec)), where the object
  /// isn't over the gel, slips under the drag ("gross slip"), goes deeper than the gel, or went beyond what the
  /// settings say
  Touch press(const TouchObject& object, const PressSpec& press, const TouchOptions& options = {}) const;
  Touch press(const ObjectSpec& object, const PressSpec& press, const TouchOptions& options = {}) const;
  /// The untouched device: frame and background, no height nor contact, zero force.
  Touch rest(std::uint64_t noise_seed = 1) const;

  /// The motion that press() plays.
  MotionSpec motion_of(const TouchObject& object, const PressSpec& press) const;
  /// The states of a motion, one a frame, by play_motion: friction with its history where the motion calls for it.
  std::vector<Truth> play(const TouchObject& object, const MotionSpec& motion) const;
  /// An object on this gel, step by step. @throws Error for an elastic object
  TouchSession session(const TouchObject& object, const TouchSessionSettings& settings = {}) const;

  /// The pictures of a state, without mechanics (Touch::press, error and markers stay empty). `noise_seed` and `frame`
  /// choose the imager's noise. Without `truth` only the frame is made.
  /// @throws Error if the gel went beyond what the settings say
  Touch capture(const TouchObject& object, const fem::PressState& press, std::uint64_t noise_seed, int frame = 0,
                bool truth = true) const;
  /// Fills in what mechanics says of a state: press, error, markers.
  void add_truth(const fem::PressState& press, const fem::PressError& error, Touch& touch) const;
  /// As Touch::markers_mm.
  const Eigen::MatrixX3d& marker_places_mm() const;
  /// The frame of the untouched device.
  cv::Mat background(std::uint64_t noise_seed, int frame = 0) const;
  /// The light of the untouched device.
  const cv::Mat& background_light() const;
  /// The frame of a touch by this object, without noise and fixed pattern. `exposure`: what the camera's exposure is
  /// multiplied by, a colour (blue, green, red); full scale stays.
  cv::Mat ideal(const TouchObject& object, const Touch& touch, const cv::Vec3d& exposure = {1, 1, 1}) const;
  /// Light (Touch::light) in the camera's numbers without noise, limits, rounding and tone curve: CV_32FC3, red, green,
  /// blue, of 255, behind white balance (sim/sensor/colour_numbers.h). @throws Error for a grey camera
  cv::Mat linear_numbers(const cv::Mat& light) const;
  /// The light with what `map` says is missing where the membrane is pressed in so (Touch::height). A device with a
  /// map of its own has it in Touch::light already. @throws Error as ResidualLight, or for pictures of another size
  cv::Mat with_residual(const ResidualMap& map, const cv::Mat& light, const cv::Mat& height) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::sim
