#pragma once
// A fit as least squares: what of a device and its presses may vary, and how far what is then simulated is from what
// was recorded.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "lab/fit/bounded_least_squares.h"
#include "lab/fit/unit_fit_spec.h"
#include "lab/fit/unit_pictures.h"
#include "lab/fit/unit_simulation.h"

namespace touchstone::lab {

/// What was recorded, as it is compared. Without a background of its own `background.mean` is empty.
struct UnitRecording {
  BlockPicture background;
  std::vector<BlockPicture> presses;
};

/// A variable of the fit beside the unknowns: something of one press.
struct PoseVariable {
  int press = 0;
  /// Of its place, or how deep it is.
  enum class Of : std::uint8_t { x, y, depth } of = Of::depth;
  double label = 0.0, deviation = 0.0;  // deviation 0: nothing was labelled
};

/// In half ranges: as far aside as light is drawn anew for a derivative. Nearer its own roughness weighs more.
constexpr double kRoughWithin = 2e-2;

/// All of the fit's variables, scaled: 1 is half of the allowed range.
struct Variables {
  std::vector<PoseVariable> poses;
  Eigen::VectorXd start, low, high, scale;
  Eigen::Index unknowns = 0;
};

/// How the presses stand as their labels have it, and where a depth isn't known as its force has it.
/// @throws Error if a press can't be made
std::vector<PressPose> labelled_poses(const PreparedFit& fit, UnitSimulation& simulation);

/// One picture of the recording: background (press -1) or press, with what is compared of it. Where a fit asks for
/// differences these are a press's numbers less the background's, and of the background the mean of each channel.
struct Compared {
  int press = -1;
  const BlockPicture* recorded = nullptr;
  std::vector<int> at;         // of usable numbers
  std::vector<double> values;  // that are compared, of the recording
  std::vector<double> noise;   // of these
  Eigen::Index first_row = 0;  // of the residuals
  bool means = false;          // of channels, in place of a value each
};

/// The fit as least squares. Keeps references to what it is made of.
class UnitComparison {
 public:
  /// Weights by the noise that the camera, as it is simulated at the start, has at the recorded numbers.
  UnitComparison(const PreparedFit& fit, const UnitRecording& recording, UnitSimulation& simulation,
                 std::vector<PressPose> labelled);

  const PreparedFit& fit() const { return fit_; }
  UnitSimulation& simulation() const { return simulation_; }
  const Variables& variables() const { return variables_; }
  const std::vector<Compared>& pictures() const { return pictures_; }
  const std::vector<int>& forces() const { return forces_; }  ///< presses that have one, rows from first_force() on
  Eigen::Index first_force() const { return first_force_; }
  Eigen::Index rows() const { return rows_; }
  const std::vector<PressPose>& labelled() const { return labelled_; }

  /// Of the variables' values.
  Eigen::VectorXd unknowns(const Eigen::VectorXd& x) const;
  std::vector<PressPose> poses(const Eigen::VectorXd& x) const;  ///< likewise
  /// What is compared of a simulated picture beside the simulated background.
  std::vector<double> values(const Compared& picture, const cv::Mat& shown, const cv::Mat& background) const;
  /// The simulated picture that belongs to it.
  static const cv::Mat& picture_in(const SimulatedUnit& shown, const Compared& picture);

  /// Pictures, then forces, then labels, each over its noise: `rows()` numbers.
  Eigen::VectorXd residuals(const Eigen::VectorXd& x) const;
  /// How many pictures, each of one source of light, are drawn for a first place, for another one, and for the
  /// derivatives there.
  std::int64_t pictures_of_all() const;
  std::int64_t pictures_of_place() const;        ///< see above
  std::int64_t pictures_of_derivatives() const;  ///< see above

  /// Unknowns that cost no light (powers, the imager's, a modulus) are settled at each place.
  LeastSquaresProblem problem() const;

 private:
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& x, const Eigen::VectorXd& at) const;
  Eigen::VectorXd settled(const Eigen::VectorXd& x) const;
  void put_picture(const Compared& picture, const cv::Mat& shown, const cv::Mat& background,
                   Eigen::VectorXd& out) const;
  double force_row(int press, double force_N) const;

  const PreparedFit& fit_;
  UnitSimulation& simulation_;
  std::vector<PressPose> labelled_;
  Variables variables_;
  std::vector<Compared> pictures_;
  std::vector<int> forces_;
  Eigen::Index first_force_ = 0, first_label_ = 0, rows_ = 0;
};

}  // namespace touchstone::lab
