#include "sim/cost/machine_rates.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "fem/elements/schur_solver.h"
#include "fem/error/compliance_cache.h"
#include "fem/error/setup_estimate.h"
#include "fem/finite_strain/finite_press.h"
#include "fem/mesh/gel_body.h"
#include "sim/cost/work_clock.h"

namespace touchstone::sim {
namespace {

using nlohmann::json;

/// Raised with each change of what is measured, of how long a counted thing takes, or of the file.
constexpr int kRatesFormat = 2;

constexpr struct {
  const char* key;
  double MachineRates::*rate;
} kRates[] = {{"elimination_s", &MachineRates::elimination_s}, {"unknown_s", &MachineRates::unknown_s},
              {"flat_press_s", &MachineRates::flat_press_s},   {"curved_press_s", &MachineRates::curved_press_s},
              {"newton_s", &MachineRates::newton_s},           {"speed_up", &MachineRates::speed_up}};

int threads_of(int asked) {
  return asked > 0 ? asked : tbb::info::default_concurrency();
}

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line;
  }
  return "unknown";
}

/// A slab like those of sensors.
fem::SlabGel slab(double side, double edge) {
  fem::SlabMesh mesh;
  mesh.size_x = mesh.size_y = side;
  mesh.thickness = 3.0;
  mesh.fine = edge;
  mesh.coarse = 3.0 * edge;
  mesh.fine_half_x = mesh.fine_half_y = 0.32 * side;  // for all of the radii that a mesh's error is measured on
  mesh.fine_depth = 1.0;
  return {mesh, {}};
}

/// And a dome, small.
fem::DomeGel dome() {
  fem::DomeGel body;
  body.sphere_radius = 10.0;
  body.base_radius = 5.0;
  body.thickness = 3.0;
  body.fine = 0.6;
  body.coarse = 2.0;
  body.fine_radius = 4.6;
  return body;
}

const fem::ElasticMaterial kRubber{1.0, 0.49};

/// Two gels give both rates of an elimination, the larger one that of the presses, too.
void measure_set_up(MachineRates& rates) {
  struct Timed {
    fem::EliminationCount count;
    double seconds;
  };
  const std::span<const fem::ElasticMaterial> materials(&kRubber, 1);
  const auto eliminate = [&](const fem::SlabGel& body) {
    const fem::EliminationCount count = fem::count_elimination(fem::mesh_gel(body), materials, {});
    const WorkClock clock;
    fem::compute_compliance(fem::mesh_gel(body), materials, {}, body.mesh.thickness);
    return Timed{count, clock.seconds()};
  };
  const fem::SlabGel large = slab(12.0, 0.5);
  eliminate(slab(8.0, 0.8));  // the first one wakes libraries
  const Timed a = eliminate(slab(10.0, 0.8));
  const Timed b = eliminate(large);
  const double determinant = a.count.operations * b.count.unknowns - b.count.operations * a.count.unknowns;
  const double an_operation = (a.seconds * b.count.unknowns - b.seconds * a.count.unknowns) / determinant;
  rates.elimination_s = std::max(0.1 * b.seconds / b.count.operations, an_operation);
  rates.unknown_s = std::max(0.0, (b.seconds - rates.elimination_s * b.count.operations) / b.count.unknowns);

  const auto presses = [&](const fem::GelBody& body) {
    const fem::SetupCount whole = fem::count_setup(body, materials, {});
    const WorkClock clock;
    fem::cached_compliance(body, materials, {}, {});
    const double presses_s = clock.seconds() - rates.elimination_s * whole.eliminations.operations -
                             rates.unknown_s * whole.eliminations.unknowns;
    return std::max(0.0, presses_s / whole.presses);
  };
  rates.flat_press_s = presses(large);
  rates.curved_press_s = presses(dome());
}

void measure_newton(MachineRates& rates) {
  const fem::SlabGel body = slab(10.0, 0.8);
  const std::span<const fem::ElasticMaterial> materials(&kRubber, 1);
  fem::TetMesh mesh = fem::mesh_gel(body);
  const double operations = fem::count_factorisation(mesh, materials);
  const fem::FiniteGel gel(std::move(mesh), materials, {}, body.mesh.thickness);
  fem::FinitePress press(gel, fem::SphereShape{3.0}, 0.0);
  fem::PressTarget target;
  for (fem::AxisControl& axis : target.axis) axis = fem::AxisControl::at(0.0);
  target.axis[2] = fem::AxisControl::at(3.0 - 0.15);
  const WorkClock clock;
  const int factorisations = press.step(target).factorisations;
  rates.newton_s = clock.seconds() / (std::max(1, factorisations) * operations);
}

/// Products of matrices that fit into a core's cache.
double seconds_of_products(int count) {
  constexpr int kSize = 192;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Constant(kSize, kSize, 1.0 / kSize);
  const WorkClock clock;
  tbb::parallel_for(0, count, [&](int) {
    Eigen::MatrixXd product = one;
    for (int k = 0; k < 20; ++k) product = (product * one).eval();
    if (!(product(0, 0) > 0.0)) fail("rates of this machine: a product of positive numbers isn't positive");
  });
  return clock.seconds();
}

std::optional<MachineRates> read_rates(const std::filesystem::path& file, int threads) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::nullopt;
  try {
    const json all = json::parse(read_whole_file(file));
    if (all.at("key").get<std::string>() != rates_key(threads)) return std::nullopt;
    MachineRates rates;
    rates.threads = threads_of(threads);
    for (const auto& [key, rate] : kRates) {
      rates.*rate = all.at(key).get<double>();
      if (!(rates.*rate >= 0.0) || !std::isfinite(rates.*rate)) return std::nullopt;
    }
    return rates;
  } catch (const std::exception&) {
    return std::nullopt;  // it is then measured anew
  }
}

}  // namespace

MachineRates measure_rates(int threads) {
  MachineRates rates;
  rates.threads = threads_of(threads);
  const auto allow = [](int count) {
    return tbb::global_control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count));
  };
  {
    const auto all = allow(rates.threads);
    measure_set_up(rates);
    measure_newton(rates);
  }
  if (rates.threads == 1) return rates;
  constexpr int kProducts = 64;
  double alone = 0.0, together = 0.0;
  {
    const auto one = allow(1);
    alone = seconds_of_products(kProducts);
  }
  {
    const auto all = allow(rates.threads);
    seconds_of_products(kProducts);  // wakes them
    together = seconds_of_products(kProducts);
  }
  rates.speed_up = std::clamp(alone / together, 1.0, static_cast<double>(rates.threads));
  return rates;
}

std::string rates_key(int threads) {
  return fmt::format("rates of a machine, format {}; {}; BLAS for {}; threads: {}", kRatesFormat, processor_name(),
                     fem::blas_core_name(), threads_of(threads));
}

std::filesystem::path rates_file(int threads, const std::filesystem::path& cache) {
  return cache / fmt::format("rates-{}.json", sha256_of(rates_key(threads)));
}

MachineRates machine_rates(int threads, const std::filesystem::path& cache, const Progress& progress) {
  if (!cache.empty()) {
    if (const auto kept = read_rates(rates_file(threads, cache), threads)) return *kept;
  }
  if (progress) progress("this machine", 0, 1);
  const MachineRates rates = measure_rates(threads);
  if (progress) progress("this machine", 1, 1);
  if (cache.empty()) return rates;
  json all = {{"key", rates_key(threads)}};
  for (const auto& [key, rate] : kRates) all[key] = rates.*rate;
  try {
    std::error_code ignored;
    std::filesystem::create_directories(cache, ignored);
    write_whole_file(rates_file(threads, cache), all.dump(2) + "\n");
  } catch (const Error&) {
    // Measured again the next time.
  }
  return rates;
}

}  // namespace touchstone::sim
