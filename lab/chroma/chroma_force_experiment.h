#pragma once
// Forces and friction from marker fields, against finite elements: probes are pressed on a gel with printed markers and
// dragged until they slide; a reader turns what the markers truly did into what a sensor says of them.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fem/contact/press.h"
#include "fem/finite_strain/finite_gel.h"
#include "fem/finite_strain/finite_press.h"
#include "lab/press/marker_compliance_export.h"
#include "sensors/tractions/friction_state.h"
#include "sensors/tractions/traction_inversion.h"

namespace touchstone::lab {

/// The probe's touching end: a flat square, a flat round or half a ball.
enum class ProbeShape : std::uint8_t { square, cylinder, hemisphere };
/// "square", "cylinder", "hemisphere"
const char* name_of(ProbeShape shape);

/// One rigid probe, pressed in by position and then dragged along the gel at that height.
struct ForceProbe {
  ProbeShape shape = ProbeShape::cylinder;
  double width_mm = 12.0;  ///< side of a square punch, diameter of a flat cylinder (rim rounded by 0.3 mm) or a ball
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< where its middle first touches, gel frame, mm
  double depth_mm = 0.5;
  double friction = 0.6;
  double direction_rad = 0.0;  ///< of the drag, from x to y

  /// Shape, width, depth, place and friction, for a table's row.
  std::string name() const;
};
/// The probe as fem takes it.
fem::ContactShape contact_shape(const ForceProbe& probe);

/// Probes of all three shapes in turn: places within 4 mm of the middle, depths, friction 0.3 to 1.2 and directions
/// drawn with the seed. Flat ones are 10 to 14 mm wide and pressed 0.25 to 0.75 mm; balls have radii of 10 to 15 mm and
/// are pressed 0.6 to 1.2 mm.
std::vector<ForceProbe> draw_force_probes(int count, std::uint64_t seed);

/// What is true of one marker: its own displacement (mean over the marker), and means over a square of a marker spacing
/// about it.
struct MarkerTruth {
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  ///< mm
  Eigen::Vector3d traction = Eigen::Vector3d::Zero();      ///< on the gel, MPa
  double stick = 0.0, slip = 0.0;                          ///< share of the square's area whose vertices do
};

/// One state of a probe's path.
struct ForceFrame {
  const ForceProbe& probe;
  const fem::PressState& press;
  int number = 0;        ///< 0 is the press; then the drag
  double drag_mm = 0.0;  ///< of the probe
  bool slides = false;   ///< at most a twentieth of the vertices that touch sticks
  std::vector<MarkerTruth> markers;
};

/// How a probe is dragged.
struct DragSettings {
  double step_mm = 0.1;
  double longest_mm = 4.0;
  int frames_after = 12;  ///< that are played after it slides
};

/// The gel, its markers and what the estimator knows of them. `truth_gel` and the gel that `compliance` was made of may
/// have different meshes: then the estimator doesn't share the truth's discretisation.
struct ForceSetup {
  std::shared_ptr<const fem::Compliance> truth_gel;
  SurfaceMarkers markers;
  sensors::MarkerCompliance compliance;
  sensors::TractionSettings inversion = {};
  sensors::FrictionSettings friction = {};
};

/// A device with a mesh that is fine wherever probes go: edges of 0.85 mm within 2 mm of the gel's sides.
/// @pre the gel is a slab
sim::DeviceSpec with_probe_mesh(sim::DeviceSpec device);

/// The setup of a device with printed markers: the truth's gel has with_probe_mesh, the estimator's a mesh that goes as
/// far with edges of 1 mm. @throws Error as check_marker_compliance
ForceSetup set_up_force(sim::DeviceSpec device, const std::filesystem::path& cache_folder,
                        const Progress& progress = {});

/// Plays a probe: `on_frame` is called for each frame, in their order.
void play_probe(const ForceSetup& setup, const ForceProbe& probe, const DragSettings& drag,
                const std::function<void(const ForceFrame&)>& on_frame);

/// What a sensor says of a frame.
using MarkerReader = std::function<sensors::MarkerField(const ForceFrame& frame)>;
/// The truth, with independent normal noise (mm, one standard deviation) on it.
MarkerReader noisy_truth(const Eigen::Vector2i& grid, double lateral_mm, double normal_mm, std::uint64_t seed);

/// A frame's truth and estimate.
struct ForceSample {
  int frame = 0;
  double drag_mm = 0.0;
  bool slides = false;
  sensors::Vector6d truth = sensors::Vector6d::Zero();     ///< wrench on the probe
  sensors::Vector6d estimate = sensors::Vector6d::Zero();  ///< likewise
  sensors::Vector6d sigma = sensors::Vector6d::Zero();
  double misfit = 0.0;
  double largest_strain = 0.0;
  double milliseconds = 0.0;  ///< of inversion and friction state
  sensors::ContactSlip slip = sensors::ContactSlip::kNoContact;
  std::optional<double> friction;  ///< as estimated after this frame
};

/// Counts of markers whose square wholly touches: truth by what most of the square's vertices do.
struct SlipCounts {
  int stick_as_stick = 0, stick_as_slip = 0, stick_as_unknown = 0;
  int slip_as_stick = 0, slip_as_slip = 0, slip_as_unknown = 0;
  /// Adds up, count by count.
  SlipCounts& operator+=(const SlipCounts& other);
  /// Of those that weren't called unknown, the part that was right; NaN without any.
  double agreement() const;
};

/// One probe's press and drag.
struct ForceRun {
  ForceProbe probe;
  std::vector<ForceSample> samples;  ///< of the frames that were read
  int unread = 0;                    ///< frames with too few measured markers to invert
  SlipCounts markers;
};
/// Presses the probe, drags it, and reads each frame.
ForceRun run_force_probe(const ForceSetup& setup, const ForceProbe& probe, const MarkerReader& reader,
                         const DragSettings& drag = {});

/// All runs together. Means are over frames; a run's friction is the last estimate.
struct ForceScore {
  int frames = 0;  ///< that were read; all means are over these
  int unread = 0;
  Eigen::Vector3d mean_absolute_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_truth_N = Eigen::Vector3d::Zero();     ///< of the absolute
  double relative = 0.0;                                      ///< mean of |error vector| / |force|
  Eigen::Vector3d z_square = Eigen::Vector3d::Zero();         ///< mean of (error / its bar)^2: 1 where bars are right
  Eigen::Vector3d within_two_bars = Eigen::Vector3d::Zero();  ///< part of the frames
  int slid = 0;                                               ///< runs that came to slide
  int friction_known = 0;                                     ///< of those, with an estimate in the end
  double friction_error = 0.0;                                ///< of those, mean absolute
  double friction_relative = 0.0;
  int sliding_frames = 0, sliding_seen = 0;    ///< that slide, and of those seen as such
  int sticking_frames = 0, sliding_false = 0;  ///< that don't, and of those called sliding
  SlipCounts markers;
  double mean_milliseconds = 0.0;
};
/// Over all samples of all runs.
ForceScore score(const std::vector<ForceRun>& runs);

/// Forces of a probe pressed straight down at finite strain, and what linear inversion makes of its markers.
struct LargeStrainRow {
  double depth_mm = 0.0;
  double largest_strain = 0.0;
  double truth_N = 0.0;     ///< of the neo-Hookean gel
  double linear_N = 0.0;    ///< of the linear gel at that depth
  double estimate_N = 0.0;  ///< by inversion of the neo-Hookean gel's markers
  double sigma_N = 0.0;
  double misfit = 0.0;
};
/// Ends at the first depth that finite strain has no answer for.
std::vector<LargeStrainRow> large_strain_ladder(const ForceSetup& setup, const fem::FiniteGel& finite, ForceProbe probe,
                                                const std::vector<double>& depths_mm, const MarkerReader& reader);

}  // namespace touchstone::lab
