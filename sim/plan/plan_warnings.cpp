#include "sim/plan/plan_warnings.h"

#include <cmath>
#include <cstdint>

#include "core/error.h"
#include "sim/plan/size_doubt.h"
#include "sim/scene/light_limits.h"

namespace touchstone::sim {
namespace {

/// Where the mesh alone is off by more than is allowed.
void warn_of_mesh(const SceneSpec& scene, const SceneNeeds& needs, Plan& plan) {
  const std::optional<AccuracySpec> stated = merged(scene.accuracy, scene.device.accuracy);
  const Change* finer = change_of(needs, kFinerMesh);
  if (!stated || finer == nullptr) return;
  const Accuracy allowed = *accuracy_of(scene.accuracy, scene.device.accuracy);
  if (!exceeds(*finer, allowed)) return;
  const MeshSpec& mesh = scene.device.mesh;
  const std::string words = fmt::format(
      "accuracy.force_percent is {:.3g}, but the mesh itself is off by {:.2g} % of a force (one standard error, in the "
      "hardest states): that is the least to be had with {}; smaller edges give less, or `mesh.force_error: {:.2g}`",
      allowed.force_percent, *finer->force_percent,
      mesh.force_error ? fmt::format("mesh.force_error of {:.2g}", *mesh.force_error)
                       : fmt::format("edges of {:.3g} mm", mesh.fine_mm),
      0.01 * allowed.force_percent);
  plan.warnings.emplace_back(Error(stated->where, words).what());
}

/// A large number as people say it.
std::int64_t two_digits(double number) {
  const double unit = std::pow(10.0, std::floor(std::log10(number)) - 1.0);
  return std::llround(std::ceil(number / unit) * unit);
}

/// The same where as many paths as are allowed leave more noise than is.
void warn_of_paths(const SceneSpec& scene, const SceneNeeds& needs, Plan& plan) {
  const std::optional<AccuracySpec> stated = merged(scene.accuracy, scene.device.accuracy);
  const Change* more = change_of(needs, kMorePaths);
  if (!stated || more == nullptr || !more->pixel_noise || plan.direct_light || plan.shared_paths) return;
  const Accuracy allowed = *accuracy_of(scene.accuracy, scene.device.accuracy);
  if (!exceeds(*more, allowed)) return;
  const LightLimits limits = light_limits(scene);
  const double left = *more->pixel_noise;
  const std::string words =
      left > limits.noise_fraction
          ? fmt::format(
                "accuracy.pixel_noise is {:.3g}, but {} paths a pixel leave some {:.2g} of the imager's noise in "
                "the hardest states: that is the least to be had with light.max_samples of {}; some {} take "
                "as much longer and would do",
                allowed.pixel_noise, limits.max_samples, left, limits.max_samples,
                two_digits(limits.max_samples * std::pow(left / limits.noise_fraction, 2)))
          : fmt::format("accuracy.pixel_noise is {:.3g}, but light.noise_fraction of {:.3g} leaves more",
                        allowed.pixel_noise, limits.noise_fraction);
  plan.warnings.emplace_back(Error(stated->where, words).what());
}

}  // namespace

void add_warnings(const SceneSpec& scene, const SceneNeeds& needs, Plan& plan) {
  for (const MovedObject& moved : moved_objects(scene)) {
    std::string doubt = size_doubt(scene.device, moved.object);
    if (!doubt.empty()) plan.warnings.push_back(std::move(doubt));
  }
  warn_of_mesh(scene, needs, plan);
  warn_of_paths(scene, needs, plan);
}

}  // namespace touchstone::sim
