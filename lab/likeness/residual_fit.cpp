#include "lab/likeness/residual_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "sim/sensor/residual_light.h"

namespace touchstone::lab {
namespace {

// Found by trials on six presses of a GelSight Mini, each left out in turn: twice and half of these, two or four
// neighbourhoods, and 60 to 400 centres change what is missing by 1 %.
constexpr double kNeighbourhoods_mm[] = {0.05, 0.5, 1.5};
constexpr double kSlopeScale = 0.6;
constexpr double kHeightScale_mm = 0.6;
constexpr int kCentres = 128;
// What is chosen from by leaving out presses.
constexpr std::optional<double> kPlaceScales_mm[] = {std::nullopt, 10.0};
constexpr double kRidges[] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5};

constexpr double kPixelsAPress = 8500.0;  // so many are learned from
constexpr int kCentreStride = 3;          // of these, centres are chosen among every third
constexpr int kSaturationSteps = 20;      // three to six are taken
constexpr double kJitter = 1e-9;          // keeps equations of centres that nearly coincide solvable

using Eigen::Index;
using Eigen::MatrixXd;

/// One press's equations.
struct PressEquations {
  MatrixXd bumps;  // a row a centre, a column a pixel
  MatrixXd square;
  MatrixXd right;                       // bumps times what is missing, a column a colour
  std::vector<Index> saturated_pixels;  // those with a saturated colour
  Eigen::Matrix3Xd missing;
  Eigen::Matrix<bool, 3, Eigen::Dynamic> saturated;
};

/// Points far from each other: the most pressed one first, then always the one farthest from all chosen.
MatrixXd spread_centres(const MatrixXd& points, int count, bool place) {
  const Index shape = points.rows() - (place ? 2 : 0);
  Index next = 0;
  points.topRows(shape).colwise().squaredNorm().maxCoeff(&next);
  Eigen::RowVectorXd distance = Eigen::RowVectorXd::Constant(points.cols(), std::numeric_limits<double>::infinity());
  MatrixXd centres(points.rows(), count);
  for (int k = 0; k < count; ++k) {
    centres.col(k) = points.col(next);
    distance = distance.cwiseMin((points.colwise() - centres.col(k)).colwise().squaredNorm());
    distance.maxCoeff(&next);
  }
  return centres;
}

template <typename Matrix, typename Pixel>
Matrix strided(const cv::Mat& picture, int stride, const Pixel& pixel) {
  const Index columns = (picture.cols + stride - 1) / stride, rows = (picture.rows + stride - 1) / stride;
  Matrix out(3, columns * rows);
  for (Index i = 0; i < out.cols(); ++i) {
    const int u = static_cast<int>(i % columns) * stride, v = static_cast<int>(i / columns) * stride;
    for (int c = 0; c < 3; ++c) out(c, i) = pixel(v, u, c);
  }
  return out;
}

/// Of what is missing, what `given` leaves: in saturated pixels too much light is none of it.
Eigen::Matrix3Xd left(const PressEquations& press, const Eigen::Matrix3Xd& given) {
  Eigen::Matrix3Xd rest = press.missing - given;
  return press.saturated.select(rest.cwiseMax(0.0), rest);
}

double mean_square(const Eigen::Matrix3Xd& numbers) {
  return numbers.squaredNorm() / static_cast<double>(numbers.size());
}

/// Of one colour: which of a press's saturated pixels are as bright as `weights` ask for or brighter, so that they tell
/// nothing. No weights: all of them.
std::vector<Index> hidden_pixels(const PressEquations& press, int colour, const Eigen::RowVectorXd& weights) {
  std::vector<Index> hidden;
  for (const Index pixel : press.saturated_pixels) {
    if (!press.saturated(colour, pixel)) continue;
    if (weights.size() == 0 || weights.dot(press.bumps.col(pixel)) > press.missing(colour, pixel)) {
      hidden.push_back(pixel);
    }
  }
  return hidden;
}

/// The weights that take what is missing from all presses but one; -1: from all. Where a number is saturated, too much
/// light is no error: a convex problem, quadratic in pieces, so Newton's steps solve it. Each leaves out the pixels
/// that tell nothing, until these stay the same.
Eigen::Matrix3Xd weights_without(const std::vector<PressEquations>& presses, int without, const MatrixXd& of_centres,
                                 double ridge) {
  MatrixXd square = MatrixXd::Zero(of_centres.rows(), of_centres.cols());
  MatrixXd known = MatrixXd::Zero(of_centres.rows(), 3);
  double pixels = 0.0;
  const auto others = [&](auto&& work) {
    for (int i = 0; i < static_cast<int>(presses.size()); ++i) {
      if (i != without) work(presses[static_cast<std::size_t>(i)]);
    }
  };
  others([&](const PressEquations& press) {
    square += press.square;
    known += press.right;
    pixels += static_cast<double>(press.missing.cols());
  });
  MatrixXd regular = ridge * of_centres;
  regular.diagonal().array() += kJitter;
  Eigen::Matrix3Xd weights(3, of_centres.rows());
  for (int c = 0; c < 3; ++c) {
    Eigen::RowVectorXd found;
    std::vector<std::vector<Index>> hidden;
    for (int step = 0; step < kSaturationSteps; ++step) {
      std::vector<std::vector<Index>> now;
      others([&](const PressEquations& press) { now.push_back(hidden_pixels(press, c, found)); });
      if (step > 0 && now == hidden) break;
      hidden = std::move(now);
      MatrixXd left = square;
      Eigen::VectorXd right = known.col(c);
      std::size_t next = 0;
      others([&](const PressEquations& press) {
        const std::vector<Index>& out = hidden[next++];
        if (out.empty()) return;
        const MatrixXd bumps = press.bumps(Eigen::all, out);
        left.noalias() -= bumps * bumps.transpose();
        right -= bumps * press.missing.row(c)(out).transpose();
      });
      found =
          Eigen::LLT<MatrixXd>(MatrixXd(left / pixels + regular)).solve(Eigen::VectorXd(right / pixels)).transpose();
    }
    weights.row(c) = found;
  }
  return weights;
}

/// One choice of what a pixel is described by.
struct Candidate {
  sim::ResidualMap map;  // without centres and weights
  MatrixXd centres, of_centres;
  std::vector<PressEquations> presses;
};

Candidate candidate_of(const std::vector<ResidualSample>& samples, sim::ResidualMap map, int stride) {
  Candidate out;
  const bool place = map.place_scale_mm.has_value();
  std::vector<MatrixXd> features;
  MatrixXd points(map.features(), 0);
  for (const ResidualSample& sample : samples) {
    features.push_back(sim::residual_features(map, sample.height, stride));
    const Index before = points.cols(), count = features.back().cols() / kCentreStride;
    points.conservativeResize(Eigen::NoChange, before + count);
    for (Index i = 0; i < count; ++i) points.col(before + i) = features.back().col(i * kCentreStride);
  }
  if (points.topRows(points.rows() - (place ? 2 : 0)).cwiseAbs().maxCoeff() < 1e-6) {
    fail("residual map: nothing is pressed in the presses that it is to learn from");
  }
  out.centres = spread_centres(points, std::min<int>(kCentres, static_cast<int>(points.cols())), place);
  out.of_centres = sim::residual_bumps(out.centres, out.centres, place);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    PressEquations press;
    press.bumps = sim::residual_bumps(out.centres, features[i], place);
    press.square = press.bumps * press.bumps.transpose();
    press.missing = strided<Eigen::Matrix3Xd>(samples[i].missing, stride, [&](int v, int u, int c) {
      return double(samples[i].missing.at<cv::Vec3f>(v, u)[c]);
    });
    press.saturated = strided<Eigen::Matrix<bool, 3, Eigen::Dynamic>>(
        samples[i].saturated, stride,
        [&](int v, int u, int c) { return samples[i].saturated.at<cv::Vec3b>(v, u)[c] != 0; });
    press.right = press.bumps * press.missing.transpose();
    for (Index k = 0; k < press.saturated.cols(); ++k) {
      if (press.saturated.col(k).any()) press.saturated_pixels.push_back(k);
    }
    out.presses.push_back(std::move(press));
  }
  out.map = std::move(map);
  return out;
}

}  // namespace

ResidualFit fit_residual(const std::vector<ResidualSample>& samples, double mm_per_px, const std::string& about) {
  TS_ASSERT(mm_per_px > 0.0);
  if (static_cast<int>(samples.size()) < kFewestResidualPresses) {
    fail("residual map: {} presses to learn from; at least {} are needed, since each is left out once", samples.size(),
         kFewestResidualPresses);
  }
  const cv::Size size = samples.front().height.size();
  for (const ResidualSample& sample : samples) {
    TS_ASSERT(sample.height.type() == CV_32FC1 && sample.missing.type() == CV_32FC3);
    TS_ASSERT(sample.saturated.type() == CV_8UC3 && sample.height.size() == size);
    TS_ASSERT(sample.missing.size() == size && sample.saturated.size() == size);
  }
  const int stride = std::max(1, static_cast<int>(std::lround(std::sqrt(size.area() / kPixelsAPress))));
  sim::ResidualMap plain;
  plain.about = about;
  plain.presses = static_cast<int>(samples.size());
  plain.width_px = size.width;
  plain.height_px = size.height;
  plain.mm_per_px = mm_per_px;
  plain.neighbourhoods_mm.assign(std::begin(kNeighbourhoods_mm), std::end(kNeighbourhoods_mm));
  plain.slope_scale = kSlopeScale;
  plain.height_scale_mm = kHeightScale_mm;

  ResidualFit best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::optional<double>& place_scale : kPlaceScales_mm) {
    sim::ResidualMap map = plain;
    map.place_scale_mm = place_scale;
    const Candidate candidate = candidate_of(samples, std::move(map), stride);
    for (const double ridge : kRidges) {
      std::vector<LeftOutPress> left_out;
      double before = 0.0, after = 0.0;
      for (std::size_t i = 0; i < samples.size(); ++i) {
        const PressEquations& press = candidate.presses[i];
        const Eigen::Matrix3Xd weights =
            weights_without(candidate.presses, static_cast<int>(i), candidate.of_centres, ridge);
        const double was = mean_square(left(press, Eigen::Matrix3Xd::Zero(3, press.missing.cols())));
        const double is = mean_square(left(press, weights * press.bumps));
        left_out.push_back({samples[i].name, std::sqrt(was), std::sqrt(is)});
        before += was / static_cast<double>(samples.size());
        after += is / static_cast<double>(samples.size());
      }
      if (!(after < least)) continue;
      least = after;
      best.map = candidate.map;
      best.map.left_out_before_DN = std::sqrt(before);
      best.map.left_out_after_DN = std::sqrt(after);
      best.left_out = std::move(left_out);
      best.ridge = ridge;
      const Eigen::Matrix3Xd weights = weights_without(candidate.presses, -1, candidate.of_centres, ridge);
      best.map.centres.clear();
      best.map.weights_DN.clear();
      for (Index k = 0; k < weights.cols(); ++k) {
        const Eigen::VectorXd centre = candidate.centres.col(k);
        best.map.centres.emplace_back(centre.data(), centre.data() + centre.size());
        best.map.weights_DN.emplace_back(weights.col(k));
      }
    }
  }
  return best;
}

}  // namespace touchstone::lab
