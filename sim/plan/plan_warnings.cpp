#include "sim/plan/plan_warnings.h"

#include <cmath>
#include <cstdint>

#include "core/error.h"
#include "sim/plan/size_doubt.h"
#include "sim/scene/light_limits.h"

namespace touchstone::sim {
namespace {

/// Where the mesh alone is off by more than is allowed.
std::string mesh_doubt(const SceneSpec& scene, const SceneNeeds& needs, const Accuracy& allowed) {
  const Change* finer = change_of(needs, kFinerMesh);
  if (finer == nullptr || !exceeds(*finer, allowed)) return {};
  const MeshSpec& mesh = scene.device.mesh;
  return fmt::format(
      "accuracy.force_percent is {:.3g}, but the mesh itself is off by {:.2g} % of a force (one standard error, in the "
      "hardest states): that is the least to be had with {}; smaller edges give less, or `mesh.force_error: {:.2g}`",
      allowed.force_percent, *finer->force_percent,
      mesh.force_error ? fmt::format("mesh.force_error of {:.2g}", *mesh.force_error)
                       : fmt::format("edges of {:.3g} mm", mesh.fine_mm),
      0.01 * allowed.force_percent);
}

/// A large number as people say it.
std::int64_t two_digits(double number) {
  const double unit = std::pow(10.0, std::floor(std::log10(number)) - 1.0);
  return std::llround(std::ceil(number / unit) * unit);
}

/// The same where as many paths as are allowed leave more noise than is.
std::string path_doubt(const SceneSpec& scene, const SceneNeeds& needs, const Accuracy& allowed, const Plan& plan) {
  const Change* more = change_of(needs, kMorePaths);
  if (more == nullptr || !more->pixel_noise || plan.direct_light || plan.shared_paths) return {};
  if (!exceeds(*more, allowed)) return {};
  const LightLimits limits = light_limits(scene);
  const double left = *more->pixel_noise;
  if (left <= limits.noise_fraction) {
    return fmt::format("accuracy.pixel_noise is {:.3g}, but light.noise_fraction of {:.3g} leaves more",
                       allowed.pixel_noise, limits.noise_fraction);
  }
  return fmt::format(
      "accuracy.pixel_noise is {:.3g}, but {} paths a pixel leave some {:.2g} of the imager's noise in the hardest "
      "states: that is the least to be had with light.max_samples of {}; some {} take as much longer and would do",
      allowed.pixel_noise, limits.max_samples, left, limits.max_samples,
      two_digits(limits.max_samples * std::pow(left / limits.noise_fraction, 2)));
}

}  // namespace

void add_warnings(const SceneSpec& scene, const SceneNeeds& needs, Plan& plan) {
  for (const MovedObject& moved : moved_objects(scene)) {
    std::string doubt = size_doubt(scene.device, moved.object);
    if (!doubt.empty()) plan.warnings.push_back(std::move(doubt));
  }
  const std::optional<AccuracySpec> stated = merged(scene.accuracy, scene.device.accuracy);
  if (!stated) return;
  const Accuracy allowed = *accuracy_of(scene.accuracy, scene.device.accuracy);
  for (const std::string& doubt : {mesh_doubt(scene, needs, allowed), path_doubt(scene, needs, allowed, plan)}) {
    if (!doubt.empty()) plan.warnings.emplace_back(Error(stated->where, doubt).what());
  }
}

}  // namespace touchstone::sim
