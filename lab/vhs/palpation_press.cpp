#include "lab/vhs/palpation_press.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "fem/elements/elastic_material.h"

namespace touchstone::lab {
namespace {

constexpr double kStep_s = 5e-5;
constexpr double kMillimetresPerMetre = 1e3;
constexpr double kMicrometresPerMm = 1e3;
constexpr double kLeastTop = 0.1;  // of the largest w / omega: modes below don't move the top
constexpr double kMostSpreads = 3.0;
constexpr double kMostModal = 0.7;  // of the law's give, that may be the modes': what is left is the contact's own
constexpr int kNewtonSteps = 6;
constexpr double kFullStepsAPeriod = 4.0;

double normal_within(RandomStream& random, double most) {
  for (;;) {
    const double drawn = random.normal();
    if (std::abs(drawn) <= most) return drawn;
  }
}

/// A mode, by symplectic Euler: with the force of the same moment, so that force and mode as two springs neither lose
/// nor gain energy. An exact step in which the force stands still would lag behind by half a step, and feed them.
struct Oscillator {
  const LumpMode& mode;
  double stiffness;  // omega^2
  double w = 0.0;
  double q = 0.0, v = 0.0;

  Oscillator(const LumpMode& of, double radius_mm) : mode(of), stiffness(of.angular_frequency * of.angular_frequency) {
    constexpr std::size_t kLast = kTopRadii_mm.size() - 1;
    const double at = std::clamp((radius_mm - kTopRadii_mm[0]) / (kTopRadii_mm[1] - kTopRadii_mm[0]), 0.0,
                                 static_cast<double>(kLast));
    const auto k = std::min(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(kLast) - 1);
    w = mode.top[k] + (at - static_cast<double>(k)) * (mode.top[k + 1] - mode.top[k]);
  }
  void go(double force, double step) {
    v += step * (w * force - stiffness * q - 2.0 * mode.damping * mode.angular_frequency * v);
    q += step * v;
  }
};

/// The hereditary integral of one force.
struct Heredity {
  explicit Heredity(const fem::PronySeries& series, double step)
      : numbers(fem::relaxation_step(series, step)), terms(series.size(), 0.0) {}
  double carried() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < terms.size(); ++i) sum += numbers.decay[i] * terms[i] - numbers.uptake[i] * elastic;
    return sum;
  }
  void go(double now) {
    for (std::size_t i = 0; i < terms.size(); ++i) {
      terms[i] = numbers.decay[i] * terms[i] + numbers.uptake[i] * (now - elastic);
    }
    elastic = now;
  }
  fem::RelaxationStep numbers;
  std::vector<double> terms;
  double elastic = 0.0;
};

/// The commanded travel of the nut: at speed, then braking from `stop_s` on.
double ramp(double t, double speed, double acceleration, double stop_s) {
  if (t <= stop_s) return speed * t;
  const double braked = std::min(t - stop_s, speed / acceleration);
  return speed * stop_s + braked * (speed - 0.5 * acceleration * braked);
}

}  // namespace

std::vector<std::vector<LumpMode>> lump_modes(const PalpationSpec& spec, double highest_Hz,
                                              const LumpModeSettings& settings, const std::filesystem::path& cache,
                                              const Progress& progress) {
  sim::SkinnedLump lump = spec.lump;
  lump.mesh_mm = settings.mesh_mm;
  std::vector<std::vector<LumpMode>> all(spec.materials.size());
  std::atomic<std::int64_t> done{0};
  tbb::parallel_for(std::size_t{0}, spec.materials.size(), [&](std::size_t m) {
    const PalpationMaterial& material = spec.materials[m];
    const fem::ElasticMaterial core{material.youngs_modulus_MPa, lump.poisson_ratio};
    const double density = spec.density_kg_m3 * kTonnePerMm3;
    if (fem::layer_shear_frequency(core, density, lump.height_mm) <= 5.0 * highest_Hz) {
      const double ratio = material.youngs_modulus_MPa / spec.skin.youngs_modulus_MPa;
      const fem::GelVibration vibration =
          sim::set_up_lump_vibration(lump, ratio, spec.density_kg_m3, settings.count, cache);
      const auto piece = sim::set_up_lump(lump, ratio, cache);
      const Eigen::VectorXd weight = piece->mass * Eigen::VectorXd::Ones(piece->mass.rows());
      Eigen::MatrixXd top = Eigen::MatrixXd::Zero(kTopRadii_mm.size(), settings.count);
      for (std::size_t r = 0; r < kTopRadii_mm.size(); ++r) {
        double area = 0.0;
        for (std::size_t v = 0; v < piece->vertices.size(); ++v) {
          const Eigen::Vector3d& at = piece->vertices[v];
          if (at.head<2>().norm() > kTopRadii_mm[r] || at.z() < -lump.sphere_radius_mm) continue;
          top.row(static_cast<Eigen::Index>(r)) += vibration.surface.row(static_cast<Eigen::Index>(3 * v + 2));
          area += weight[static_cast<Eigen::Index>(v)];
        }
        top.row(static_cast<Eigen::Index>(r)) /= area;
      }
      const Eigen::RowVectorXd moved = top.row(0).cwiseAbs().cwiseQuotient(vibration.angular_frequency.transpose());
      for (Eigen::Index k = 0; k < settings.count; ++k) {
        if (moved[k] < kLeastTop * moved.maxCoeff()) continue;
        // A skin of 1 MPa was computed.
        all[m].push_back({std::sqrt(spec.skin.youngs_modulus_MPa) * vibration.angular_frequency[k], top.col(k), 0.0});
      }
    }
    const std::int64_t now = ++done;
    if (progress) progress("palpation, modes", now, static_cast<std::int64_t>(spec.materials.size()));
  });
  return all;
}

PalpationPiece draw_piece(const PalpationSpec& spec, int material, std::uint64_t seed, std::uint64_t index) {
  TS_ASSERT(material >= 0 && material < static_cast<int>(spec.materials.size()));
  const PalpationMaterial& core = spec.materials[static_cast<std::size_t>(material)];
  RandomStream random(seed, index, Purpose::kPlacement);
  PalpationPiece piece;
  piece.material = material;
  piece.skin_MPa = spec.skin.youngs_modulus_MPa * std::exp(spec.skin.spread * normal_within(random, kMostSpreads));
  piece.core_MPa = core.youngs_modulus_MPa * std::exp(core.spread * normal_within(random, kMostSpreads));
  return piece;
}

PressedPiece pressed_piece(const PalpationSpec& spec, const PalpationTable& table, const PalpationPiece& piece,
                           const std::vector<std::vector<LumpMode>>& modes) {
  const auto m = static_cast<std::size_t>(piece.material);
  const PalpationMaterial& material = spec.materials[m];
  PressedPiece pressed;
  pressed.law = table.law(piece.skin_MPa, piece.core_MPa);
  std::map<double, double> shares;
  for (const fem::PronyTerm& term : palpation_series(spec.skin.relaxing)) {
    shares[term.time] += std::max(0.0, pressed.law.skin_share) * term.share;
  }
  for (const fem::PronyTerm& term : palpation_series(material.relaxing)) {
    shares[term.time] += std::max(0.0, pressed.law.core_share) * term.share;
  }
  for (const auto& [time, share] : shares) pressed.relaxation.push_back({share, time});
  const fem::PronySeries own = palpation_series(material.relaxing);
  for (LumpMode mode : modes[m]) {
    mode.angular_frequency *= std::sqrt(piece.core_MPa / material.youngs_modulus_MPa);
    const std::complex<double> modulus = fem::complex_modulus(own, mode.angular_frequency);
    mode.damping = 0.5 * modulus.imag() / modulus.real();
    mode.angular_frequency *= std::sqrt(modulus.real());
    pressed.modes.push_back(mode);
  }
  return pressed;
}

PalpationRun play_press(const PalpationSpec& spec, const PressedPiece& piece, double seconds, std::uint64_t seed,
                        std::uint64_t index) {
  const PalpationAxis& axis = spec.axis;
  const PalpationMotion& motion = spec.motion;
  RandomStream random(seed, index, Purpose::kMotion);
  const double speed = motion.speed_mm_s * std::exp(motion.speed_spread * normal_within(random, kMostSpreads));
  const double turn_phase = 2.0 * kPi * random.uniform();
  const double step_phase = 2.0 * kPi * random.uniform();
  const double step_period = kFullStepsAPeriod * axis.lead_mm / axis.steps_per_turn;
  // N and mm with kg: forces in mN.
  const double stiffness = axis.stiffness_N_mm * kMillimetresPerMetre / axis.mass_kg;  // 1/s^2
  const double ring = std::sqrt(stiffness);
  const double damping = 2.0 * axis.damping * ring;
  // White acceleration that makes the free mass move by that much (RMS): variance = S / (4 zeta omega^3).
  const double shake = axis.shake_um / kMicrometresPerMm * std::sqrt(4.0 * axis.damping * ring * ring * ring / kStep_s);
  const double start = -motion.gap_mm;

  std::vector<Oscillator> modes;
  // As they meet the contact where the press ends: with a w that changed with the force the modes would be fed by it.
  const PalpationLaw& law = piece.law;
  double end = std::min(motion.deepest_mm, law.deepest_mm());
  while (end > law.depth_step_mm && law.force(end) > motion.stop_force_N) end -= law.depth_step_mm;
  double modal = 0.0;  // mm/N that they have in the law already
  for (const LumpMode& mode : piece.modes) {
    modes.emplace_back(mode, law.radius(end));
    modal += modes.back().w * modes.back().w / modes.back().stiffness;
  }
  // A soft core gives way nearly all by its lowest modes, under the even pressure that they are taken for by more than
  // under the face. Contacts have a give of their own.
  const double most = kMostModal / law.stiffness(end);
  if (modal > most) {
    for (Oscillator& mode : modes) mode.w *= std::sqrt(most / modal);
    modal = most;
  }
  Heredity heredity(piece.relaxation, kStep_s);
  PalpationRun run;
  run.step_s = kStep_s;
  run.touch_s = motion.gap_mm / speed;
  run.stop_s = std::numeric_limits<double>::infinity();
  const auto steps = static_cast<std::int64_t>(std::ceil((run.touch_s + seconds) / kStep_s));
  run.force_N.reserve(static_cast<std::size_t>(steps));
  run.depth_mm.reserve(static_cast<std::size_t>(steps));
  const double deepest = piece.law.deepest_mm();
  double s = start, v = speed, force = 0.0;
  double nut_before = start;
  for (std::int64_t k = 0; k < steps; ++k) {
    const double t = static_cast<double>(k) * kStep_s;
    const double commanded = start + ramp(t, speed, axis.acceleration_mm_s2, run.stop_s);
    const double nut = commanded + (axis.lead_error_um * std::sin(2.0 * kPi * commanded / axis.lead_mm + turn_phase) +
                                    axis.step_error_um * std::sin(2.0 * kPi * commanded / step_period + step_phase)) /
                                       kMicrometresPerMm;
    const double nut_speed = k == 0 ? speed : (nut - nut_before) / kStep_s;
    nut_before = nut;
    double moved = 0.0;  // the top, by the modes
    for (const Oscillator& mode : modes) moved += mode.w * mode.q;
    // G law(s - moved + modal F) + r = F, by Newton from the last force.
    const double gain = heredity.numbers.stiffness;
    const double carried = heredity.carried();
    double depth = 0.0;
    for (int i = 0; i < kNewtonSteps; ++i) {
      depth = s - moved + modal * force;
      if (depth > deepest) {
        fail("palpation: the press went {:.3g} mm deep, its law ends at {:.3g} mm", depth, deepest);
      }
      const double elastic = depth > 0.0 ? piece.law.force(depth) : 0.0;
      const double slope = depth > 0.0 ? gain * piece.law.stiffness(depth) : 0.0;
      const double next = gain * elastic + carried;
      force = std::max(0.0, force + (next - force) / (1.0 - std::min(kMostModal, slope * modal)));
    }
    depth = s - moved + modal * force;
    heredity.go(depth > 0.0 ? piece.law.force(std::min(depth, deepest)) : 0.0);
    for (Oscillator& mode : modes) mode.go(force, kStep_s);
    run.force_N.push_back(force);
    run.depth_mm.push_back(piece.law.depth(force));
    if (std::isinf(run.stop_s)) {
      const double braking_mm = 0.5 * speed * speed / axis.acceleration_mm_s2;  // that braking takes
      if (force >= motion.stop_force_N || commanded >= motion.deepest_mm - braking_mm) run.stop_s = t;
    }
    const double pull = stiffness * (nut - s) + damping * (nut_speed - v) -
                        force * kMillimetresPerMetre / axis.mass_kg + shake * random.normal();
    v += kStep_s * pull;
    s += kStep_s * v;
  }
  return run;
}

}  // namespace touchstone::lab
