#include "lab/vhs/palpation_law.h"

#include <tbb/parallel_for.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "render/materials/layer_connection.h"
#include "sim/scene/device_camera.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr double kHardRatio = 100.0;  // see ratio_place
constexpr double kSpreads = 3.05;     // how far from the middle pieces are covered, in their standard deviations
constexpr double kFine_mm = 0.01;     // step of the laws
constexpr int kMostTerms = 4;         // of the smooth laws
constexpr double kCloser = 1.3;       // depths lie closer at first, as forces rise
constexpr double kShareStep = 0.05;   // of ln E, for derivatives

/// d^1.5 (1, d, d^2, ...): how a ball's force on elastic layers begins (Hertz), and goes on.
Eigen::RowVectorXd terms_at(double depth, int count) {
  Eigen::RowVectorXd terms(count);
  double power = std::pow(depth, 1.5);
  for (int k = 0; k < count; ++k, power *= depth) terms[k] = power;
  return terms;
}

/// By least squares, each depth weighted by `weight`: what the terms make of each column.
Eigen::MatrixXd fitted(const std::vector<double>& depths, const Eigen::MatrixXd& values, const Eigen::VectorXd& weight,
                       int count) {
  Eigen::MatrixXd terms(values.rows(), count);
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    terms.row(i) = terms_at(depths[static_cast<std::size_t>(i)], count);
  }
  return (weight.asDiagonal() * terms).householderQr().solve(weight.asDiagonal() * values);
}

/// The force over depth with as many terms as let it rise from the first touch on: of few and rough points more may
/// not.
Eigen::VectorXd rising_law(const std::vector<double>& depths, const Eigen::VectorXd& forces) {
  // Forces count with errors that are as large as their roots, so that small ones aren't passed over.
  const Eigen::VectorXd weight = forces.cwiseMax(1e-6 * forces.maxCoeff()).cwiseSqrt().cwiseInverse();
  for (int count = kMostTerms; count > 1; --count) {
    const Eigen::VectorXd law = fitted(depths, forces, weight, count);
    double before = 0.0;
    bool rises = true;
    for (double depth = kFine_mm; rises && depth <= depths.back(); depth += kFine_mm) {
      const double here = terms_at(depth, count).dot(law);
      rises = here > before;
      before = here;
    }
    if (rises) return law;
  }
  return fitted(depths, forces, weight, 1);
}

double ratio_at(double place) {
  return std::exp(place) / (1.0 - std::exp(place) / kHardRatio);
}

/// Weights of three neighbours of evenly spaced places, the first of which it gives.
std::array<double, 3> parabola(const std::vector<double>& places, double at, std::size_t& first) {
  const double step = places[1] - places[0];
  const double in_steps = (at - places[0]) / step;
  first = static_cast<std::size_t>(std::clamp(std::lround(in_steps) - 1, 0L, static_cast<long>(places.size()) - 3));
  const double u = in_steps - static_cast<double>(first) - 1.0;  // from the middle one
  return {0.5 * u * (u - 1.0), 1.0 - u * u, 0.5 * u * (u + 1.0)};
}

}  // namespace

double ratio_place(double core_over_skin) {
  return std::log(core_over_skin / (1.0 + core_over_skin / kHardRatio));
}

double PalpationLaw::force(double depth) const {
  return at(force_N, depth);
}
double PalpationLaw::radius(double depth) const {
  return at(radius_mm, depth);
}

double PalpationLaw::at(const std::vector<double>& values, double depth) const {
  TS_ASSERT(depth >= 0.0 && depth <= deepest_mm());
  const auto k = std::min(static_cast<std::size_t>(depth / depth_step_mm), values.size() - 2);
  const double part = depth / depth_step_mm - static_cast<double>(k);
  return values[k] + part * (values[k + 1] - values[k]);
}

double PalpationLaw::depth(double force) const {
  const auto above = std::upper_bound(force_N.begin(), force_N.end(), force);
  if (above == force_N.end()) return deepest_mm();
  if (above == force_N.begin()) return 0.0;
  const auto k = static_cast<std::size_t>(above - force_N.begin()) - 1;
  return depth_step_mm * (static_cast<double>(k) + (force - force_N[k]) / (force_N[k + 1] - force_N[k]));
}

double PalpationLaw::stiffness(double depth) const {
  TS_ASSERT(depth >= 0.0 && depth <= deepest_mm());
  const auto k = std::min(static_cast<std::size_t>(depth / depth_step_mm), force_N.size() - 2);
  return (force_N[k + 1] - force_N[k]) / depth_step_mm;
}

Eigen::VectorXd PalpationLaw::beads(double depth) const {
  TS_ASSERT(depth >= 0.0 && depth <= deepest_mm() && bead_px.size() == force_N.size());
  const auto k = std::min(static_cast<std::size_t>(depth / depth_step_mm), force_N.size() - 2);
  const double part = depth / depth_step_mm - static_cast<double>(k);
  return bead_px[k] + part * (bead_px[k + 1] - bead_px[k]);
}

Eigen::VectorXd bead_pixels(const sim::DeviceSpec& device, const Eigen::MatrixX3d& displacement) {
  TS_ASSERT(device.camera && device.beads);
  const sim::CameraSpec& spec = *device.camera;
  if (!std::holds_alternative<sim::PinholeSpec>(spec.optics)) {
    fail_at(device.where, "camera: palpation needs a pinhole");
  }
  const render::PinholeCamera camera = sim::pinhole_camera(spec);
  const RigidTransform camera_from_gel = camera.gel_from_camera.inverse();
  const Eigen::Vector3d hole = spec.position_mm;
  const std::vector<Eigen::Vector3d> rest = sim::bead_centres(*device.beads);
  TS_ASSERT(displacement.rows() == static_cast<Eigen::Index>(rest.size()));
  Eigen::VectorXd pixels(2 * displacement.rows());
  for (Eigen::Index b = 0; b < displacement.rows(); ++b) {
    const Eigen::Vector3d bead = rest[static_cast<std::size_t>(b)] + displacement.row(b).transpose();
    const double gel_below = device.gel.thickness_mm + bead.z();
    const double air = -device.gel.thickness_mm - device.plate.thickness_mm - hole.z();
    const std::array<render::Layer, 3> layers = {{{gel_below, device.gel.refractive_index},
                                                  {device.plate.thickness_mm, device.plate.refractive_index},
                                                  {air, 1.0}}};
    const Eigen::Vector2d across = (bead - hole).head<2>();
    const auto path = render::solve_layer_path(layers, across.norm());
    const double slope = path ? path->tangent[2] : 0.0;
    const Eigen::Vector2d towards =
        across.norm() > 0.0 ? Eigen::Vector2d(across.normalized()) : Eigen::Vector2d::Zero();
    const Eigen::Vector3d along(slope * towards.x(), slope * towards.y(), 1.0);
    const auto pixel = render::image_point(camera, camera_from_gel.turn(along));
    TS_ASSERT(path && pixel);  // the camera is below the plate, and looks up
    pixels.segment<2>(2 * b) = *pixel;
  }
  return pixels;
}

PalpationTable::PalpationTable(const PalpationSpec& spec, PalpationFace face, const sim::DeviceSpec& device,
                               const fem::Compliance& gel, const PalpationTableSettings& settings,
                               const std::filesystem::path& cache, const Progress& progress)
    : step_(kFine_mm) {
  TS_ASSERT(settings.depths > kMostTerms && settings.deepest_mm > 0.0);
  double least = std::numeric_limits<double>::infinity();
  double most = 0.0;
  for (const PalpationMaterial& material : spec.materials) {
    const double apart = kSpreads * (material.spread + spec.skin.spread);
    const double ratio = material.youngs_modulus_MPa / spec.skin.youngs_modulus_MPa;
    least = std::min(least, ratio_place(ratio * std::exp(-apart)));
    most = std::max(most, ratio_place(ratio * std::exp(apart)));
  }
  const int steps = std::max(2, static_cast<int>(std::ceil((most - least) / settings.ratio_step)));
  for (int k = 0; k <= steps; ++k) ratios_.push_back(least + (most - least) * k / steps);
  const double middle = std::log(spec.skin.youngs_modulus_MPa);
  log_skins_ = face == PalpationFace::rigid
                   ? std::vector<double>{middle}
                   : std::vector<double>{middle - settings.skin_step, middle + settings.skin_step};

  sim::SkinnedLump lump = spec.lump;
  if (settings.lump_mesh_mm > 0.0) lump.mesh_mm = settings.lump_mesh_mm;
  std::vector<std::shared_ptr<const fem::Compliance>> pieces(ratios_.size());
  std::atomic<std::int64_t> done{0};
  const auto total = static_cast<std::int64_t>(ratios_.size() * (1 + log_skins_.size()));
  const auto tell = [&] {
    const std::int64_t now = ++done;
    if (progress) progress("palpation, presses", now, total);
  };
  tbb::parallel_for(std::size_t{0}, ratios_.size(), [&](std::size_t k) {
    pieces[k] = sim::set_up_lump(lump, ratio_at(ratios_[k]), cache);
    tell();
  });

  const auto plate = face == PalpationFace::rigid ? sim::set_up_plate(lump, cache) : nullptr;
  const auto fine = static_cast<Eigen::Index>(std::lround(settings.deepest_mm / step_));
  const Eigen::VectorXd at_rest = face == PalpationFace::gel
                                      ? bead_pixels(device, Eigen::MatrixX3d::Zero(gel.beads.rows() / 3, 3))
                                      : Eigen::VectorXd();
  nodes_.resize(ratios_.size() * log_skins_.size());
  std::vector<double> strains(nodes_.size(), 0.0);
  tbb::parallel_for(std::size_t{0}, nodes_.size(), [&](std::size_t at) {
    const fem::Compliance& piece = *pieces[at % ratios_.size()];
    const double skin = std::exp(log_skins_[at / ratios_.size()]);
    const bool is_plate = face == PalpationFace::rigid;
    fem::Press press(is_plate ? *plate : gel,
                     std::vector<fem::PressBody>{{fem::SphereShape{lump.sphere_radius_mm}, settings.friction,
                                                  sim::as_pressing_body(lump, piece, is_plate ? 1.0 : skin)}});
    std::vector<double> depths;
    Eigen::MatrixXd forces(settings.depths, 1);
    Eigen::MatrixXd areas(settings.depths, 1);
    Eigen::MatrixXd beads(settings.depths, at_rest.size());
    for (int i = 0; i < settings.depths; ++i) {
      depths.push_back(settings.deepest_mm * std::pow((i + 1.0) / settings.depths, kCloser));
      fem::PressTarget target;
      target.axis = {fem::AxisControl::at(0.0), fem::AxisControl::at(0.0),
                     fem::AxisControl::at(lump.sphere_radius_mm - depths.back())};
      const fem::PressState& state = press.step(target);
      forces(i, 0) = state.wrench[2];
      areas(i, 0) = state.contact_area * std::sqrt(depths.back());  // as the terms begin: areas with the depth
      if (at_rest.size() > 0) beads.row(i) = (bead_pixels(device, state.bead_displacement) - at_rest).transpose();
      const double truly = forces(i, 0) * (face == PalpationFace::rigid ? skin : 1.0);
      if (truly <= spec.motion.stop_force_N && depths.back() <= spec.motion.deepest_mm) {
        strains[at] = std::max(strains[at], state.largest_strain);
      }
    }
    const Eigen::VectorXd even = Eigen::VectorXd::Ones(settings.depths);
    const Eigen::VectorXd law = rising_law(depths, forces);
    const Eigen::MatrixXd moved = fitted(depths, beads, even, kMostTerms);
    const Eigen::VectorXd area = fitted(depths, areas, even, kMostTerms);
    Node& node = nodes_[at];
    node.log_force.resize(fine);
    node.area.resize(fine);
    node.beads.resize(fine, at_rest.size());
    for (Eigen::Index i = 0; i < fine; ++i) {
      const double depth = step_ * static_cast<double>(i + 1);
      const Eigen::RowVectorXd terms = terms_at(depth, kMostTerms);
      const double force = terms_at(depth, static_cast<int>(law.size())).dot(law);
      TS_ASSERT(force > 0.0);
      node.log_force[i] = std::log(force / std::pow(depth, 1.5));
      node.area[i] = std::max(0.0, terms.dot(area) / std::sqrt(depth));
      if (at_rest.size() > 0) node.beads.row(i) = terms * moved;
    }
    tell();
  });
  strain_ = *std::max_element(strains.begin(), strains.end());
  presses_ = static_cast<int>(nodes_.size()) * settings.depths;
}

PalpationLaw PalpationTable::law(double skin_MPa, double core_MPa) const {
  struct Mix {
    std::vector<std::pair<const Node*, double>> parts;
    double unit = 0.0;  // ln of what the forces are times of
  };
  const auto mix_at = [&](double log_skin, double log_core) {
    const double place = ratio_place(std::exp(log_core - log_skin));
    const double slack = 1e-6 + kShareStep;
    if (!(place >= ratios_.front() - slack && place <= ratios_.back() + slack)) {
      fail("palpation: a core of {:.4g} MPa under a skin of {:.4g} MPa; the table has ratios from {:.4g} to {:.4g}",
           core_MPa, skin_MPa, ratio_at(ratios_.front()), ratio_at(ratios_.back()));
    }
    Mix mix;
    std::size_t first = 0;
    const std::array<double, 3> weights = parabola(ratios_, place, first);
    double upper = 0.0;
    if (log_skins_.size() > 1) {
      upper = (log_skin - log_skins_[0]) / (log_skins_[1] - log_skins_[0]);
    } else {
      mix.unit = log_skin;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      mix.parts.emplace_back(&node(first + k, 0), weights[k] * (1.0 - upper));
      if (log_skins_.size() > 1) mix.parts.emplace_back(&node(first + k, 1), weights[k] * upper);
    }
    return mix;
  };
  const auto log_force = [](const Mix& mix, Eigen::Index i) {
    double sum = mix.unit;
    for (const auto& [one, weight] : mix.parts) sum += weight * one->log_force[i];
    return sum;
  };
  const double log_skin = std::log(skin_MPa);
  const double log_core = std::log(core_MPa);
  const Mix mix = mix_at(log_skin, log_core);
  const Eigen::Index fine = nodes_.front().log_force.size();
  PalpationLaw law;
  law.depth_step_mm = step_;
  law.force_N = {0.0};
  law.radius_mm = {0.0};
  const Eigen::Index beads = nodes_.front().beads.cols();
  if (beads > 0) law.bead_px = {Eigen::VectorXd::Zero(beads)};
  for (Eigen::Index i = 0; i < fine; ++i) {
    const double depth = step_ * static_cast<double>(i + 1);
    law.force_N.push_back(std::exp(log_force(mix, i)) * std::pow(depth, 1.5));
    double area = 0.0;
    for (const auto& [one, weight] : mix.parts) area += weight * one->area[i];
    law.radius_mm.push_back(std::sqrt(std::max(0.0, area) / kPi));
    if (beads == 0) continue;
    Eigen::VectorXd moved = Eigen::VectorXd::Zero(beads);
    for (const auto& [one, weight] : mix.parts) moved += weight * one->beads.row(i).transpose();
    law.bead_px.push_back(moved);
  }
  const Eigen::Index half = fine / 2;
  const auto slope = [&](double skin, double core) {
    return (log_force(mix_at(log_skin + skin, log_core + core), half) -
            log_force(mix_at(log_skin - skin, log_core - core), half)) /
           (2.0 * kShareStep);
  };
  law.skin_share = slope(kShareStep, 0.0);
  law.core_share = slope(0.0, kShareStep);
  return law;
}

}  // namespace touchstone::lab
