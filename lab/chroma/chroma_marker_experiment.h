#pragma once
// The experiments of [Lin2019] on a chroma device: hue against depth (fig. 8), centroid against lateral displacement
// (fig. 9), the inverted model (sec. IV.D) and displacement fields under punches (fig. 10).
//
// Displacements of figs. 8 and 9 and of the inverse are those of the ball, as the paper's stage measured them. Fields
// are held against the finite elements' mean displacement of each marker.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "lab/chroma/chroma_setup.h"
#include "lab/statistics/straight_line.h"
#include "sensors/colour/hue_estimator.h"
#include "sensors/tractions/traction_inversion.h"

namespace touchstone::lab {

/// A ball is pressed on a marker and dragged at its depth; what the picture shows of that marker.
struct MarkerSeries {
  double depth_mm = 0.0;                    ///< of the ball; of a press without drag the last one
  std::vector<Eigen::Vector3d> ball_mm;     ///< displacement of the ball since it touched: a press is -z
  std::vector<sensors::ColourMarker> seen;  ///< as long as `ball_mm`; flawed ones are left out of both
  int flawed = 0;                           ///< pictures in which the marker could not be read
  double largest_strain = 0.0;              ///< of the gel's surface over the series, see fem::PressState
  /// One axis of `ball_mm`.
  std::vector<double> column_mm(int axis) const;
};

/// Steps over one marker: the ball of the paper, 4 mm.
struct MarkerTest {
  Eigen::Vector2d place_mm = {1.5, 1.5};  ///< of the marker's middle
  double friction = 1.0;                  ///< not given; soft silicone holds plastic well: usual figures are about 1
};

/// Fig. 8: from touch to `deepest_mm`.
MarkerSeries press_series(const ChromaSetup& setup, const MarkerTest& test, double deepest_mm, double step_mm,
                          std::uint64_t seed);
/// Fig. 9 and sec. IV.D: pressed at once, then dragged to `end_mm` (x, y) in `steps` steps.
MarkerSeries shear_series(const ChromaSetup& setup, const MarkerTest& test, double depth_mm,
                          const Eigen::Vector2d& end_mm, int steps, std::uint64_t seed);

/// What shear_series presses, and how it moves.
sim::ObjectSpec marker_ball(const MarkerTest& test);
/// A press to this depth, then a drag to `end_mm` (along the gel, from the first place) in so many steps.
sim::MotionSpec shear_motion(const MarkerTest& test, double depth_mm, const Eigen::Vector2d& end_mm, int steps);

/// Standard deviation (degrees) of each marker's hue in pictures of the untouched device. @pre at least 2 pictures
std::vector<double> hue_repeats_deg(const ChromaSetup& setup, std::uint64_t seed, int pictures);

/// Fig. 8: changes of a marker's hue since rest, and the ball's depths that go with them.
struct HueAgainstDepth {
  std::vector<double> depth_mm, change_deg;
  StraightLine line() const { return line_through(depth_mm, change_deg); }
};
/// Of one marker, over a press series, with the line through it.
HueAgainstDepth hue_against_depth(const ChromaSetup& setup, const MarkerSeries& press, std::size_t marker);

/// The usual forms of a model that needs nothing but the marker itself.
std::vector<sensors::HueModelForm> forms_of_one_marker();

/// Samples for calibration, with the ball's displacement as the marker's.
std::vector<sensors::HueSample> samples_of(const MarkerSeries& series, std::size_t marker, int number);

/// What an inverse model makes of a series.
struct InverseScore {
  double largest_um = 0.0;  ///< of any component
  double largest_press_um = 0.0, largest_lateral_um = 0.0;
  double rms_um = 0.0;    ///< of a component
  double worst_r2 = 1.0;  ///< of the lateral components against the ball's, those that moved
  int samples = 0;
};
/// Of one marker, over series that the model wasn't calibrated on.
InverseScore score_inverse(const ChromaSetup& setup, const sensors::HueModel& model, std::size_t marker,
                           const std::vector<MarkerSeries>& series);

/// A model for whole fields: balls and a flat cylinder pressed and dragged at places about the gel's middle, all
/// markers that they move taken as samples with the finite elements' truth, the form of least lateral
/// error chosen by cross-validation over presses.
sensors::HueModel calibrate_field(const ChromaSetup& setup, bool quick, std::uint64_t seed);

/// A field under a punch.
struct FieldScore {
  std::string punch;
  double mean_um = 0.0;  ///< mean over measured markers of the error's length
  double rms_um = 0.0;
  double worst_um = 0.0;
  double press_rms_um = 0.0, lateral_rms_um = 0.0;  ///< of a component
  double largest_true_um = 0.0;                     ///< displacement of the marker that moves most
  int measured = 0, flawed = 0, extrapolated = 0;
  std::vector<Eigen::Vector3d> truth, estimate;  ///< mm, by marker; the estimate NaN where not measured
  /// The same of the displacements under those tractions that explain the estimate best: what mechanics adds to it.
  double elastic_mean_um = 0.0, elastic_worst_um = 0.0;
};
/// Inverts fields estimated with `parallax`, taking their lateral displacements as seen: the compliance is of another
/// mesh than the sensor's.
sensors::TractionInversion elastic_inversion(const ChromaSetup& setup, const std::filesystem::path& cache,
                                             const sensors::ViewParallax& parallax);

/// Presses a punch straight down. @pre the punch's lowest point is its origin's z less `height_mm`
FieldScore field_under(const ChromaSetup& setup, const sensors::HueModel& model, sensors::TractionInversion& inversion,
                       const sim::ObjectSpec& punch, double height_mm, double depth_mm, const Eigen::Vector2d& place_mm,
                       std::uint64_t seed);

/// Fig. 10's three: a square punch of 10 mm, a flat cylinder of 10 mm, a hemisphere of 16 mm, with friction.
struct PunchTest {
  sim::ObjectSpec object;
  double height_mm = 0.0;  ///< of the origin over the lowest point
  double depth_mm = 0.0;
};
/// The punches of fig. 10.
std::vector<PunchTest> fig10_punches();

}  // namespace touchstone::lab
