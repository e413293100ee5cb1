#pragma once
// What a device with other numbers would have shown and measured of a fit's presses: quickly, by simulating anew only
// what the numbers act on.
//
// Light is in proportion to each lamp's power and to the room's radiance, so each is simulated alone, with 1 W (or 1
// W/m^2/sr) in each band, and their pictures are added up. What the imager makes of light is a formula. A gel of one
// material under a rigid body has the same shape at the same depth whatever its modulus, and a force in proportion to
// it.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/fit/unit_fit_spec.h"
#include "render/imager/imager.h"

namespace touchstone::lab {

/// How an object stands in one press.
struct PressPose {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();
  double depth_mm = 0.0;  ///< beyond its first touch

  bool operator==(const PressPose&) const = default;
};

/// What is seen and measured. Pictures: CV_64FC(1 or 3) as mean_numbers, of blocks.
struct SimulatedUnit {
  cv::Mat background;
  std::vector<cv::Mat> presses;
  Eigen::VectorXd force_N;        ///< by press, normal
  Eigen::VectorXd force_error_N;  ///< one standard error, from the mesh
};

/// Not for several threads at once; it uses several itself. What was simulated is kept, so that asking again costs
/// little. The same arguments give the same numbers, whatever was asked before.
class UnitSimulation {
 public:
  /// Gels are kept in the cache folder. Keeps a reference to `fit`.
  UnitSimulation(const PreparedFit& fit, const std::filesystem::path& cache_folder, Progress progress = {});
  ~UnitSimulation();

  /// @pre x has an entry an unknown, poses one a press
  /// @throws Error if the device can't be, or a press can't be made with it
  SimulatedUnit show(const Eigen::VectorXd& x, const std::vector<PressPose>& poses);
  /// The press alone. The background is left out, and other presses' pictures and forces.
  SimulatedUnit show_press(const Eigen::VectorXd& x, int press, const PressPose& pose);
  /// As show(), with light of other random numbers: how far they differ is what the light's own noise does.
  SimulatedUnit show_other_light(const Eigen::VectorXd& x, const std::vector<PressPose>& poses);
  /// How deep a press is whose force is known. @throws Error likewise
  double depth_of_force(const Eigen::VectorXd& x, int press, const PressPose& pose, double force_N);

  /// The device's imager with the numbers of x.
  render::Imager imager(const Eigen::VectorXd& x) const;
  int lamp_setups() const;  ///< lamps' light set up so far: what takes longest
  int sources() const;      ///< of light: lamps, and the room

  /// UnitFitSpec::field_accuracy, of which the first holds to begin with. What was drawn with another is forgotten.
  void set_field_accuracy(double accuracy);
  /// Names the work to come and how many pictures, each of one source, it will take: for the progress.
  void expect(const std::string& stage, std::int64_t pictures);

 private:
  struct Parts;
  explicit UnitSimulation(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
  std::unique_ptr<UnitSimulation> other_;  // made when first asked for
};

}  // namespace touchstone::lab
