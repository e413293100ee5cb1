#pragma once
// From how a coloured marker looks to how it has moved [Lin2019, sec. IV.C, D].
//
// The paper's model, eq. 4: h = Gz w + h0 and c = (a w + b) d, of the press w (positive inwards, the paper's delta_z),
// the hue h, the centroid's shift c and the lateral displacement d; inverted, eq. 5. The paper says itself that its
// errors "can be improved by using a non-linear approximation": here a polynomial of the change in hue, the two
// centroids' shifts, the two areas' logarithms and what its neighbours show
// (marker_surroundings.h), without a constant term, so what looks as at rest is at rest.
// Lateral displacements are those that are seen (ViewParallax); the true ones follow from them.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "sensors/colour/marker_change.h"

namespace touchstone::sensors {

/// Which model takes what is seen to a displacement.
enum class HueForm : std::uint8_t {
  kEquation4,   ///< the paper's own
  kIsotropic,   ///< a polynomial that knows no direction: it may learn from shear along one axis
  kPolynomial,  ///< any polynomial: it has to see shear in all directions
};
/// "equation_4", "isotropic", "polynomial"
const char* name_of(HueForm form);

/// Which of a MarkerChange a polynomial is of.
struct HueFeatures {
  bool hue = true;
  bool centroid = true;
  bool ink_centroid = true;
  bool coloured_area = true;
  bool ink_area = true;
  bool cell_area = false;  ///< of its neighbours, as the next one: a marker without sound ones isn't measured then
  bool neighbour_area = false;

  bool operator==(const HueFeatures&) const = default;
  /// Places in MarkerChange::vector().
  std::vector<int> indices() const;
  bool of_surroundings() const { return cell_area || neighbour_area; }
};

/// eq. 4.
struct HueLine {
  double hue_slope = 0.0;   ///< Gz, rad/mm
  double hue_offset = 0.0;  ///< by which h0 is off the marker's hue at rest, rad; 0 unless it was fitted
  double gain_slope = 0.0;  ///< a, 1/mm
  double gain = 0.0;        ///< b
  bool of_ink = false;      ///< c is the ink's centroid, not that of all that is coloured
};

/// With s the scaled scalars (change of hue, squares of the centroids' shifts, areas' logarithms): the press is a
/// polynomial of s without a constant, and the lateral displacement the sum of the centroids' scaled shifts, each times
/// a polynomial of s of one degree less.
struct HueIsotropic {
  HueFeatures features;     ///< a centroid at least
  int degree = 1;           ///< 1 to 4
  Eigen::VectorXd scale;    ///< of the scalars; of a shift, not of its square
  Eigen::VectorXd press;    ///< mm, terms in the order of hue_terms
  Eigen::VectorXd lateral;  ///< mm, for each centroid: the constant, then terms in that order
};

/// All products of up to `degree` of the scaled features, but for the constant.
struct HuePolynomial {
  HueFeatures features;
  int degree = 1;                 ///< 1 to 4
  Eigen::VectorXd scale;          ///< of each feature: it is divided by it
  Eigen::MatrixX3d coefficients;  ///< rows: terms in the order of hue_terms; columns: d_x, d_y as seen, and w, mm
};

/// Of a marker that has calibration samples of its own: its displacements are the model's times these.
struct MarkerGain {
  std::int64_t marker = 0;
  double lateral = 1.0;
  double press = 1.0;
};

/// What calibration has seen.
struct HueRange {
  double lowest_hue = 0.0, highest_hue = 0.0;  ///< change of hue, rad
  double largest_shift_mm = 0.0;               ///< of the centroid
  double largest_ink_shift_mm = 0.0;
  Eigen::Matrix<double, MarkerChange::kSize, MarkerChange::kSize>
      precision =  ///< inverse of the mean square of changes
      Eigen::Matrix<double, MarkerChange::kSize, MarkerChange::kSize>::Zero();
  double largest_distance = 0.0;  ///< of a change by that measure, squared
};

/// A calibrated model of one grid of markers; only the part of its form is filled.
struct HueModel {
  HueForm form = HueForm::kEquation4;
  double spacing_mm = 3.0;  ///< of the grid
  ViewParallax parallax;
  HueLine line;              ///< of kEquation4
  HueIsotropic isotropic;    ///< of kIsotropic
  HuePolynomial polynomial;  ///< of kPolynomial
  std::vector<MarkerGain> gains;
  HueRange range;
  std::int64_t samples = 0;   ///< it was calibrated on
  double rms_error_mm = 0.0;  ///< on them, of the displacement's length
};

/// What is wrong with a model, empty if nothing is.
std::string fault_of(const HueModel& model);

/// The exponents of a polynomial's terms, one row each, by degree and then in lexical order.
/// @pre features >= 1, 1 <= degree <= 4
Eigen::MatrixXi hue_terms(int features, int degree);

/// The terms' values. @param scaled the features
Eigen::VectorXd hue_term_values(const Eigen::MatrixXi& terms, const Eigen::VectorXd& scaled);

/// What a HueIsotropic is made of, from a change.
struct IsotropicFeatures {
  Eigen::VectorXd scalars;
  std::vector<Eigen::Vector2d> shifts;

  /// @param scale as HueIsotropic::scale
  IsotropicFeatures(const HueFeatures& features, const Eigen::VectorXd& scale, const MarkerChange& change);
  /// Number of scalars. That of the centroids among them is `features.centroid + features.ink_centroid`.
  static int count(const HueFeatures& features);
};

/// How many of the terms of a degree are of a lower one.
Eigen::Index count_lower_terms(int features, int degree);

/// For people: "eq. 4", "an isotropic polynomial of degree 2 of the marker and its neighbours", ...
std::string summary_of(const HueModel& model);

/// What it is of; all false for eq. 4.
HueFeatures features_of(const HueModel& model);

/// The terms that a model is evaluated with; empty for eq. 4.
Eigen::MatrixXi terms_of(const HueModel& model);

/// A marker's displacement as it is seen.
struct SeenDisplacement {
  Eigen::Vector2d lateral_mm = Eigen::Vector2d::Zero();
  double press_mm = 0.0;   ///< positive inwards
  bool determined = true;  ///< false: eq. 5's gain a w + b is too near to zero to divide by, or the model needs
                           ///< neighbours that aren't sound
};

/// Without gains. `terms` are terms_of(model).
SeenDisplacement displacement_of(const HueModel& model, const Eigen::MatrixXi& terms, const MarkerChange& change);

/// Whether a change is beyond what calibration saw, by more than a twentieth. It doesn't look at a shift's direction: a
/// kPolynomial of degree 3 that saw shear along the axes alone is 1 mm off along a diagonal, and this doesn't say so.
bool is_beyond(const HueRange& range, const MarkerChange& change);

}  // namespace touchstone::sensors
