#include "sim/press/gel_setup.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <optional>

#include "core/error.h"
#include "core/locked_work.h"
#include "core/units.h"
#include "fem/error/compliance_cache.h"
#include "fem/vibration/vibration_cache.h"

namespace touchstone::sim {
namespace {

constexpr int kModes = 80;  // of the vhs gel: to 1.5 kHz, three times the lowest

std::optional<fem::ErrorGoal> goal_of(const MeshSpec& mesh) {
  if (!mesh.force_error) return std::nullopt;
  return fem::ErrorGoal{*mesh.force_error, mesh.contact_radius_mm, mesh.sharp_bodies};
}

/// The folder, made if it can be. @throws Error if it is another user's, or others may write into it
std::filesystem::path own_folder(const std::filesystem::path& folder) {
  std::filesystem::path at;
  for (const std::filesystem::path& part : folder) mkdir((at /= part).c_str(), S_IRWXU);  // what's there stays
  struct stat link {};
  struct stat about {};
  // Where it can't be had, results aren't kept, and the gel's report says so.
  if (lstat(folder.c_str(), &link) != 0 || stat(folder.c_str(), &about) != 0) return folder;
  const char* reason = nullptr;
  for (const struct stat& one : {link, about}) {
    if (one.st_uid != geteuid() && one.st_uid != 0) reason = "belongs to another user";
  }
  if ((about.st_mode & (S_IWGRP | S_IWOTH)) != 0) reason = "may be written by others (chmod go-w changes that)";
  if (reason != nullptr) {
    fail("{}: this folder of set-up results {}; if it's meant to be used, name it by --cache or TOUCHSTONE_CACHE",
         folder.string(), reason);
  }
  return folder;
}

}  // namespace

std::filesystem::path default_cache_folder() {
  if (const char* given = std::getenv("TOUCHSTONE_CACHE"); given != nullptr && *given != '\0') return given;
  for (const auto& [variable, below] :
       {std::pair{"XDG_CACHE_HOME", "touchstone"}, std::pair{"HOME", ".cache/touchstone"}}) {
    const char* value = std::getenv(variable);
    if (value != nullptr && *value != '\0') return own_folder(std::filesystem::path(value) / below);
  }
  return own_folder(std::filesystem::temp_directory_path() / fmt::format("touchstone-cache-{}", geteuid()));
}

std::shared_ptr<const fem::FiniteGel> set_up_finite_gel(const DeviceSpec& device) {
  const fem::GelBody body = gel_body(device);
  return std::make_shared<const fem::FiniteGel>(fem::mesh_gel(body), gel_materials(device.gel), gel_beads(device),
                                                fem::thickness_of(body));
}

std::string gel_key(const DeviceSpec& device) {
  const fem::GelBody body = gel_body(device);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(device.gel);
  const std::vector<fem::Bead> beads = gel_beads(device);
  const std::optional<fem::ErrorGoal> goal = goal_of(device.mesh);
  return goal ? fem::compliance_key(body, *goal, materials, beads) : fem::compliance_key(body, materials, beads);
}

void cache_gel_of_unit_modulus(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                               const Progress& progress) {
  std::error_code ignored;
  if (cache_folder.empty() || !device.gel.layers.empty()) return;
  if (std::filesystem::exists(fem::compliance_file(cache_folder, gel_key(device)), ignored)) return;
  DeviceSpec relative = device;
  relative.gel.youngs_modulus_MPa = 1.0;
  set_up_gel(relative, cache_folder, progress);
}

std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress) {
  const fem::GelBody body = gel_body(device);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(device.gel);
  const std::vector<fem::Bead> beads = gel_beads(device);
  const std::optional<fem::ErrorGoal> goal = goal_of(device.mesh);
  return std::make_shared<const fem::Compliance>(
      goal ? fem::cached_compliance(body, *goal, materials, beads, cache_folder, progress)
           : fem::cached_compliance(body, materials, beads, cache_folder, progress));
}

std::shared_ptr<const fem::GelVibration> set_up_vibration(const SceneSpec& scene, const Plan& plan,
                                                          const std::filesystem::path& cache_folder) {
  if (!plan.inertia || scene.motion.highest_vibration_Hz() == 0.0) return nullptr;
  const DeviceSpec& device = scene.device;
  if (device.mesh.force_error) {
    fail_at(scene.where, "inertia needs a mesh that is given by fine_mm; effects.inertia: off leaves it out");
  }
  if (!device.gel.layers.empty()) {
    fail_at(scene.where, "the inertia of a gel with layers isn't simulated; effects.inertia: off leaves it out");
  }
  const fem::GelBody body = gel_body(device);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(device.gel);
  const std::vector<fem::Bead> beads = gel_beads(device);
  // Scenes of one gel ask for the same modes at once: the first makes them, the others read them.
  static std::mutex one_at_a_time;
  return locked_work(one_at_a_time, [&] {
    return std::make_shared<const fem::GelVibration>(fem::cached_vibration(
        fem::compliance_key(body, materials, beads), [&] { return fem::mesh_gel(body); }, materials, beads,
        device.gel.density_kg_m3 * kTonnePerMm3, kModes, cache_folder));
  });
}

}  // namespace touchstone::sim
