#include "sensors/learning/bayesian_minimum.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/random.h"
#include "sensors/learning/gaussian_process.h"

namespace touchstone::sensors {
namespace {

void check(const SearchBox& box, const Eigen::VectorXd& first, const BayesianMinimumSettings& settings) {
  const Eigen::Index size = box.low.size();
  if (size < 1 || box.high.size() != size || first.size() != size) {
    fail("search: a box with {} and {} coordinates and a first place with {}; they must be as many, and at least 1",
         size, box.high.size(), first.size());
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    if (!(std::isfinite(box.low[i]) && std::isfinite(box.high[i]) && box.low[i] < box.high[i])) {
      fail("search: the box goes from {} to {} along {}; it must be finite and grow", box.low[i], box.high[i], i);
    }
    if (!(first[i] >= box.low[i] && first[i] <= box.high[i])) {
      fail("search: the first place is at {} along {}, the box goes from {} to {}", first[i], i, box.low[i],
           box.high[i]);
    }
  }
  if (settings.first_evaluations < 2) {
    fail("search: first_evaluations is {}, it must be at least 2", settings.first_evaluations);
  }
  if (settings.evaluations < settings.first_evaluations) {
    fail("search: evaluations is {}, it must be at least first_evaluations, {}", settings.evaluations,
         settings.first_evaluations);
  }
  if (settings.candidates < 1) fail("search: candidates is {}, it must be at least 1", settings.candidates);
}

/// One place in each of `count` slices along each coordinate, in the unit box; a row each.
Eigen::MatrixXd latin_hypercube(Eigen::Index count, Eigen::Index coordinates, RandomStream& random) {
  Eigen::MatrixXd places(count, coordinates);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  for (Eigen::Index i = 0; i < coordinates; ++i) {
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    for (std::size_t k = order.size(); k > 1; --k) {
      std::swap(order[k - 1], order[static_cast<std::size_t>(random.uniform() * static_cast<double>(k))]);
    }
    for (Eigen::Index k = 0; k < count; ++k) {
      places(k, i) =
          (static_cast<double>(order[static_cast<std::size_t>(k)]) + random.uniform()) / static_cast<double>(count);
    }
  }
  return places;
}

/// The process through values of mean 0 and standard deviation 1 (or all 0): of a few lengths, the same along all
/// coordinates, that with the most evidence. Ten values can't determine more than one.
GaussianProcess surrogate(const Eigen::MatrixXd& places, const Eigen::VectorXd& values) {
  GaussianProcess best;
  bool has_one = false;
  for (const double length : {0.15, 0.3, 0.6, 1.2, 2.4}) {
    GaussianProcess process =
        with_best_signal(condition({Eigen::VectorXd::Constant(places.cols(), length), 1.0, 0.003}, places, values));
    if (has_one && process.log_evidence <= best.log_evidence) continue;
    best = std::move(process);
    has_one = true;
  }
  return best;
}

double expected_improvement(double mean, double deviation, double least) {
  if (!(deviation > 0.0)) return std::max(0.0, least - mean);
  const double z = (least - mean) / deviation;
  const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
  return deviation * (z * 0.5 * std::erfc(-z / std::numbers::sqrt2) + density);
}

/// Where the improvement to be expected is largest: the best of random places, half of them about the best one so far,
/// near and very near.
Eigen::RowVectorXd most_promising(const GaussianProcess& process, Eigen::Index best, int candidates,
                                  RandomStream& random) {
  const Eigen::Index coordinates = process.inputs.cols();
  Eigen::MatrixXd places(candidates, coordinates);
  for (Eigen::Index k = 0; k < candidates; ++k) {
    for (Eigen::Index i = 0; i < coordinates; ++i) {
      const double anywhere = random.uniform();
      const double near = process.inputs(best, i) + (k % 4 == 1 ? 0.1 : 0.02) * random.normal();
      places(k, i) = k % 2 == 0 ? anywhere : std::clamp(near, 0.0, 1.0);
    }
  }
  const GaussianProcessPrediction prediction = predict_with_variance(process, places);
  const double least = process.targets.minCoeff();
  Eigen::Index chosen = 0;
  double most = -1.0;
  for (Eigen::Index k = 0; k < candidates; ++k) {
    const double improvement = expected_improvement(prediction.mean[k], std::sqrt(prediction.variance[k]), least);
    if (improvement > most) {
      most = improvement;
      chosen = k;
    }
  }
  return places.row(chosen);
}

}  // namespace

BayesianMinimum find_bayesian_minimum(const std::function<double(const Eigen::VectorXd&)>& function,
                                      const SearchBox& box, const Eigen::VectorXd& first,
                                      const BayesianMinimumSettings& settings) {
  check(box, first, settings);
  RandomStream random(settings.seed, settings.stream, Purpose::kSearch);
  const Eigen::VectorXd width = box.high - box.low;
  BayesianMinimum found;
  Eigen::MatrixXd unit(settings.evaluations, first.size());
  const auto evaluate = [&](const Eigen::RowVectorXd& at) {
    unit.row(static_cast<Eigen::Index>(found.places.size())) = at;
    const Eigen::VectorXd place = (box.low + at.transpose().cwiseProduct(width)).cwiseMax(box.low).cwiseMin(box.high);
    found.places.push_back(place);
    found.values.push_back(function(place));
  };
  evaluate((first - box.low).cwiseQuotient(width).transpose());
  const Eigen::MatrixXd spread = latin_hypercube(settings.first_evaluations - 1, first.size(), random);
  for (Eigen::Index k = 0; k < spread.rows(); ++k) evaluate(spread.row(k));
  for (;;) {
    const auto count = static_cast<Eigen::Index>(found.values.size());
    double least = std::numeric_limits<double>::infinity();
    double worst = -least;
    Eigen::Index best = -1;
    for (Eigen::Index k = 0; k < count; ++k) {
      const double value = found.values[static_cast<std::size_t>(k)];
      if (!std::isfinite(value)) continue;
      worst = std::max(worst, value);
      if (value < least) {
        least = value;
        best = k;
      }
    }
    if (count == settings.evaluations) {
      if (best < 0) fail("search: the function was finite at none of {} places", count);
      found.place = found.places[static_cast<std::size_t>(best)];
      found.value = least;
      return found;
    }
    if (best < 0) {  // nothing to learn from
      Eigen::RowVectorXd anywhere(first.size());
      for (double& coordinate : anywhere) coordinate = random.uniform();
      evaluate(anywhere);
      continue;
    }
    Eigen::VectorXd values(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const double value = found.values[static_cast<std::size_t>(k)];
      values[k] = std::isfinite(value) ? value : worst;
    }
    values.array() -= values.mean();
    const double deviation = std::sqrt(values.squaredNorm() / static_cast<double>(count));
    if (deviation > 0.0) values /= deviation;
    evaluate(most_promising(surrogate(unit.topRows(count), values), best, settings.candidates, random));
  }
}

}  // namespace touchstone::sensors
