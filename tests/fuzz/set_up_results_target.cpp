// What a set-up found and keeps on disk: a gel's compliance and vibration, a sensor's light, a milky slab's, played
// presses; and what is kept of a fit that was broken off. Whoever may write into the folder can seal a file as the
// program does, so keys and checksums, which no chance gets right, are made anew for a second try. What is read is used
// as the program uses it.

#include <xxhash.h>

#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numeric>
#include <string>

#include "core/sha256.h"
#include "fem/elements/compliance_file.h"
#include "fem/vibration/vibration_cache.h"
#include "lab/fit/fit_so_far.h"
#include "render/direct/light_field.h"
#include "sim/press/press_path_file.h"
#include "sim/sensor/light_file.h"
#include "sim/sensor/traced_slab.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace touchstone::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMarkSize = 8;
constexpr std::size_t kKeySize = 64;
const std::string kKey(kKeySize, 'a');

/// As fem/elements/compliance_file.h describes it.
std::string sealed_gel(std::string bytes) {
  constexpr std::size_t kKeyAt = 16, kSizeAt = 80, kChecksumAt = 152, kHeader = 168;
  if (bytes.size() < kHeader) return bytes;
  bytes.replace(kKeyAt, kKeySize, kKey);
  const std::uint64_t size = bytes.size();
  std::memcpy(bytes.data() + kSizeAt, &size, sizeof(size));
  const std::string summed = bytes.substr(0, kChecksumAt) + bytes.substr(kHeader);
  XXH128_canonical_t sum;
  XXH128_canonicalFromHash(&sum, XXH3_128bits(summed.data(), summed.size()));
  std::memcpy(bytes.data() + kChecksumAt, &sum, sizeof(sum));
  return bytes;
}

/// As core/matrix_file.h describes it.
std::string sealed_matrices(std::string bytes, const std::string& key) {
  if (bytes.size() < kMarkSize + 2 * kKeySize) return bytes;
  bytes.replace(kMarkSize, kKeySize, key);
  bytes.resize(bytes.size() - kKeySize);
  return bytes + sha256_of(bytes);
}

bool reads_gel(const std::string& bytes) {
  const fs::path file = scratch_file(bytes, "gel.compliance");
  return gives_result([&] {
    const fem::Compliance gel = fem::read_compliance(file, kKey);
    const Eigen::VectorXd moved = gel.surface.times(Eigen::VectorXd::Constant(gel.surface.rows(), 0.5));
    TS_ASSERT(moved.size() == 3 * std::ssize(gel.vertices) && gel.beads.cols() == moved.size());
    std::vector<int> all(gel.vertices.size());
    std::iota(all.begin(), all.end(), 0);
    TS_ASSERT(gel.surface.block(all, all).rows() == moved.size());
    TS_ASSERT((gel.mass * Eigen::VectorXd::Ones(gel.mass.cols())).size() == std::ssize(gel.vertices));
    for (const auto& triangle : gel.triangles) {
      for (const int corner : triangle) TS_ASSERT(gel.vertices.at(static_cast<std::size_t>(corner)).allFinite());
    }
    for (const fem::BodyErrors* body : {&gel.mesh_error.smooth, &gel.mesh_error.sharp}) {
      TS_ASSERT(body->errors.size() == body->radius_per_edge.size());
    }
  });
}

bool reads_light(const std::string& bytes) {
  const fs::path file = scratch_file(bytes, "light-" + kKey + ".bin");
  const auto light = sim::read_light(file.parent_path(), kKey);
  if (!light) return false;
  const render::LightField& field = light->field;
  const int beams = field.beam_count();
  if (beams == 0) return true;
  for (const float place : {-1e9F, 0.0F, 0.5F, 1e9F}) {
    for (const int node : render::find_cell(field, place, place, place).node) {
      TS_ASSERT(node >= 0 &&
                static_cast<std::size_t>(node + 1) * 4 * static_cast<std::size_t>(beams) <= field.flow.size());
    }
  }
  for (const render::BesideBeam& beside : field.beside) {
    for (const int next : {beside.flatter, beside.steeper, beside.left, beside.right}) TS_ASSERT(next < beams);
  }
  return true;
}

bool reads_traced(const std::string& bytes) {
  const fs::path file = scratch_file(bytes, "light-" + kKey + ".bin");
  const auto traced = sim::read_traced(file.parent_path(), kKey);
  if (!traced) return false;
  TS_ASSERT(std::ssize(traced->shares) == traced->rest.channels());
  for (const std::vector<double>& band : traced->shares) TS_ASSERT(band.size() == std::size(sim::kFlatStates));
  return true;
}

bool reads_fit(const std::string& bytes) {
  return gives_result([&] {
    const lab::KeptFit kept = lab::kept_fit_in(bytes, "fit.bin");
    TS_ASSERT(kept.so_far.search.x.allFinite() && kept.so_far.search.growth >= 2.0);
    for (const lab::PressPose& pose : kept.so_far.labelled) TS_ASSERT(std::isfinite(pose.depth_mm));
  });
}

bool reads_presses(const std::string& bytes) {
  const fs::path file = scratch_file(bytes, "press-path.bin");
  return gives_result([&] {
    const sim::PlayedPath played = sim::read_press_path(file, kKey);
    TS_ASSERT(played.at.size() == played.states.size());
    for (const fem::PressState& state : played.states) {
      TS_ASSERT(state.traction.rows() == state.surface_displacement.rows());
    }
  });
}

/// The vibration of a gel with one bead that this asks for, of one mode. A file that isn't sound would be made anew.
struct Modes {
  static constexpr double kDensity = 1000.0;
  fs::path file = fem::vibration_file({}, kKey, kDensity, 1);
  std::string key = file.stem().string().substr(std::string("vibration-").size());

  bool reads(const std::string& bytes) const {
    const fs::path kept = scratch_file(bytes, file.filename().string());
    const std::array<fem::Bead, 1> beads{};
    const auto made_anew = []() -> fem::TetMesh { fail("it isn't sound"); };
    return gives_result([&] {
      const fem::GelVibration modes =
          fem::cached_vibration(kKey, made_anew, {}, beads, kDensity, 1, kept.parent_path());
      TS_ASSERT(modes.angular_frequency.size() == 1 && modes.surface.cols() == 1 && modes.beads.rows() == 3);
    });
  }
};

bool any_reads(const std::string& bytes, const Modes& modes) {
  if (bytes.starts_with("TSCOMPLY")) return reads_gel(bytes);
  if (bytes.starts_with("TSLIGHT")) return reads_light(bytes);
  if (bytes.starts_with("TSMILKY")) return reads_traced(bytes);
  if (bytes.starts_with("TSFIT")) return reads_fit(bytes);
  if (bytes.starts_with("TSVIBRAT")) return modes.reads(bytes);
  return reads_presses(bytes);
}

}  // namespace

bool reads(std::string_view bytes) {
  static const Modes modes;
  const std::string given(bytes);
  static const std::string fit_key = lab::kept_fit({}).substr(kMarkSize, kKeySize);
  const bool as_given = any_reads(given, modes);
  const std::string& key = given.starts_with("TSVIBRAT") ? modes.key : given.starts_with("TSFIT") ? fit_key : kKey;
  const std::string sealed = given.starts_with("TSCOMPLY") ? sealed_gel(given) : sealed_matrices(given, key);
  return (sealed != given && any_reads(sealed, modes)) || as_given;
}

}  // namespace touchstone::fuzz
