#pragma once
// The rows of `touchstone validate mechanics`, by what they try. Not for use outside lab/validate_*.cpp.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fem/error/compliance_cache.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {

inline constexpr double kValidationModulus = 1.0;  ///< MPa, of every gel here

/// The gels that rows share; set up once, then read from the cache.
class MechanicsGels {
 public:
  explicit MechanicsGels(std::filesystem::path cache) : cache_(std::move(cache)) {}

  /// 300 mm thick, 600 mm wide, edges of `fine` in the middle: a half space to 0.4 % for contacts below 1.2 mm.
  fem::Compliance thick(double poisson_ratio, double fine = 0.2) const {
    return slab({600.0, 600.0, 300.0, fine, 100.0, 1.3, 1.3, 0.25}, poisson_ratio);
  }
  /// 5 mm thick, half-width 4 thicknesses, edges of `fine` where it's touched.
  fem::Compliance layer(double poisson_ratio, double fine = 0.4) const {
    return slab({40.0, 40.0, 5.0, fine, 2.5, 2.4, 2.4, 0.6}, poisson_ratio);
  }
  /// 2 mm thick, `width` wide, evenly meshed: for loads all over its face.
  fem::Compliance even(double poisson_ratio, double width = 24.0) const {
    return slab({width, width, 2.0, 0.9, 0.9, 0.5 * width, 0.5 * width, 1.0}, poisson_ratio);
  }
  /// Any slab, with this Poisson's ratio.
  fem::Compliance slab(const fem::SlabMesh& mesh, double poisson_ratio) const {
    return fem::cached_compliance(mesh, {kValidationModulus, poisson_ratio}, {}, cache_);
  }

 private:
  std::filesystem::path cache_;
};

/// What a case found: its figure, and how it comes with the mesh.
struct MechanicsFinding {
  double ours = 0.0;
  std::optional<ValidationSeries> series;
};

/// One row to be. An error (reference 0, better lower) holds up to `bound`, an order (better higher) from `bound` on.
struct MechanicsCase {
  std::string id;
  std::string title;
  double reference = 0.0;
  Better better = Better::lower;
  double bound = 0.0;
  std::function<MechanicsFinding(const MechanicsGels&)> find;
};

/// Patch test, rigid motion, manufactured solutions (validate_element.cpp).
std::vector<MechanicsCase> element_cases(bool quick);
/// Contact with a half space, with and without friction, and forces on it (validate_half_space.cpp).
std::vector<MechanicsCase> half_space_cases(bool quick);
/// Contact with bonded layers, loads on them, bonded blocks (validate_layer.cpp).
std::vector<MechanicsCase> layer_cases(bool quick);

}  // namespace touchstone::lab
