#include "lab/studies/force_bound.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "lab/press/marker_compliance_export.h"
#include "lab/studies/centroid_bound.h"
#include "sim/press/gel_setup.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;
using touchstone::test::message_of;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A grey imager with little but read noise, or with shot noise as well.
render::Imager grey_imager(double read_noise_e) {
  render::Imager imager;
  imager.bits = 12;
  imager.active_area_um2 = 20.0;
  imager.exposure_s = 1e-3;
  imager.quantum_efficiency = render::QuantumEfficiency::Constant(1, 1, 0.5);
  imager.wavelengths_nm = render::Spectrum::Constant(1, 550.0);
  imager.full_well_e = 20000.0;
  imager.read_noise_e = read_noise_e;
  imager.gain_DN_per_e = 4095.0 / 20000.0;
  return imager;
}

render::Imager colour_imager() {
  render::Imager imager = grey_imager(5.0);
  imager.quantum_efficiency = render::QuantumEfficiency::Zero(3, 1);
  imager.quantum_efficiency << 0.3, 0.5, 0.2;
  imager.bayer = render::BayerPattern::rggb;
  return imager;
}

/// A dark spot, Gaussian of `sigma` px, before `background_e` electrons of the best channel.
cv::Mat spot(const render::Imager& imager, double background_e, double depth, double sigma, Eigen::Vector2d centre) {
  double most = 0.0;
  for (int c = 0; c < imager.quantum_efficiency.rows(); ++c) {
    most = std::max(most, render::response_of(render::channel_imager(imager, c)).electrons_per_irradiance(0, 0));
  }
  cv::Mat light(64, 64, CV_32FC1);
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const double r2 = (Eigen::Vector2d(x + 0.5, y + 0.5) - centre).squaredNorm();
      light.at<float>(y, x) =
          static_cast<float>(background_e / most * (1.0 - depth * std::exp(-r2 / (2.0 * sigma * sigma))));
    }
  }
  return light;
}

TEST(CentroidBound, OfAGaussianSpotInReadNoiseIsItsIntegral) {
  // The squared derivative of A exp(-r^2 / 2 s^2) integrates to A^2 pi / 2, whatever s. Central differences lose
  // 1 / (2 s^2) of it. Where the slope is, some 800 electrons add their shot noise.
  const double read = 400.0;
  const double sigma = 6.0;
  const render::Imager imager = grey_imager(read);
  const double contrast = 500.0;
  const Eigen::Matrix2d information =
      shift_information(spot(imager, 1000.0, 0.5, sigma, {32.2, 31.7}), imager, {32.2, 31.7}, 31.0);
  const double wanted = contrast * contrast * kPi / 2.0 / (read * read + 800.0) * (1.0 - 0.5 / (sigma * sigma));
  EXPECT_NEAR(information(0, 0), wanted, 0.005 * wanted);
  EXPECT_NEAR(information(1, 1), wanted, 0.005 * wanted);
  EXPECT_LT(std::abs(information(0, 1)), 1e-3 * wanted);
  EXPECT_NEAR(least_deviation_px(information), 1.0 / std::sqrt(wanted), 0.005 / std::sqrt(wanted));
}

TEST(CentroidBound, IsReachedByTheEfficientEstimateFromExposedFrames) {
  // The shift that explains each noisy raw frame best, to first order, scatters as the bound says: 1 within 4 standard
  // errors of 1200 draws of two numbers.
  constexpr int kDraws = 1200;
  for (const render::Imager& imager : {grey_imager(5.0), colour_imager()}) {
    const Eigen::Vector2d centre(31.4, 32.9);
    const cv::Mat light = spot(imager, 6000.0, 0.8, 3.0, centre);
    const Eigen::Matrix2d information = shift_information(light, imager, centre, 20.0);
    const cv::Mat plus_x = spot(imager, 6000.0, 0.8, 3.0, centre + Eigen::Vector2d(0.01, 0));
    const cv::Mat plus_y = spot(imager, 6000.0, 0.8, 3.0, centre + Eigen::Vector2d(0, 0.01));
    const render::FixedPattern pattern = render::fixed_pattern(imager, light.size(), 1);
    double squares = 0.0;
    for (int draw = 0; draw < kDraws; ++draw) {
      const cv::Mat raw = render::expose(light, imager, pattern, 1, static_cast<std::uint64_t>(draw));
      Eigen::Vector2d score = Eigen::Vector2d::Zero();
      for (int y = 0; y < raw.rows; ++y) {
        for (int x = 0; x < raw.cols; ++x) {
          const int channel = imager.bayer == render::BayerPattern::none ? 0 : render::channel_of(imager.bayer, x, y);
          const render::ImagerResponse response = render::response_of(render::channel_imager(imager, channel));
          const double per_light = response.electrons_per_irradiance(0, 0);
          const double mean = per_light * light.at<float>(y, x);
          const Eigen::Vector2d slope(per_light * (plus_x.at<float>(y, x) - light.at<float>(y, x)) / 0.01,
                                      per_light * (plus_y.at<float>(y, x) - light.at<float>(y, x)) / 0.01);
          const double seen = raw.at<std::uint16_t>(y, x) / imager.gain_DN_per_e;
          score += slope * (seen - mean) / std::pow(render::noise_e(response, mean), 2);
        }
      }
      squares += (information.inverse() * score).squaredNorm() / (2.0 * kDraws);
    }
    const double bound = least_deviation_px(information);
    EXPECT_NEAR(std::sqrt(squares) / bound, 1.0, 4.0 / std::sqrt(4.0 * kDraws) + 0.02);  // + differences of pixels
  }
}

TEST(PictureInformation, OnAShiftIsThatOfTheShift) {
  // Where only the spot moves, the whole picture knows what the spot's surroundings know: gradients in one direction,
  // pictures of moved spots the other.
  for (const render::Imager& imager : {grey_imager(5.0), colour_imager()}) {
    const Eigen::Vector2d centre(31.4, 32.9);
    const cv::Mat light = spot(imager, 6000.0, 0.8, 4.0, centre);
    std::vector<cv::Mat> slopes;
    for (const Eigen::Vector2d& step : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)}) {
      slopes.push_back((spot(imager, 6000.0, 0.8, 4.0, centre + step) - spot(imager, 6000.0, 0.8, 4.0, centre - step)) /
                       2.0);
    }
    const Eigen::Matrix2d shift = shift_information(light, imager, centre, 29.0);
    EXPECT_LT((picture_information(light, slopes, imager) - shift).norm(), 1e-3 * shift.norm());
  }
}

TEST(CentroidBound, WhatIsSaturatedOrEvenKnowsNothing) {
  const render::Imager imager = grey_imager(5.0);
  EXPECT_EQ(least_deviation_px(shift_information(spot(imager, 1e6, 0.1, 3.0, {32, 32}), imager, {32, 32}, 20.0)),
            kInfinity);
  EXPECT_EQ(least_deviation_px(shift_information(spot(imager, 1000.0, 0.0, 3.0, {32, 32}), imager, {32, 32}, 20.0)),
            kInfinity);
  EXPECT_EQ(shift_information(spot(imager, 1000.0, 0.5, 3.0, {32, 32}), imager, {-100, 32}, 20.0).norm(), 0.0);
  EXPECT_THAT(message_of([&] {
                shift_information(cv::Mat(8, 8, CV_32FC3), imager, {4, 4}, 2.0);
              }),
              HasSubstr("3 channels, the imager has 1"));
}

TEST(LeastDeviations, AreThoseOfTheInverseAndInfiniteWhereNothingTells) {
  Eigen::MatrixXd sensitivity(4, 2);
  sensitivity << 1, 0.5, 0, 2, 0.3, -1, 2, 0;
  const Eigen::VectorXd deviation = Eigen::Vector4d(0.1, 0.2, 0.1, 0.4);
  const Eigen::MatrixXd weighted = deviation.cwiseInverse().asDiagonal() * sensitivity;
  const Eigen::VectorXd wanted = (weighted.transpose() * weighted).inverse().diagonal().cwiseSqrt();
  EXPECT_LT((least_deviations(sensitivity, deviation) - wanted).norm(), 1e-12);
  // A third unknown that does what the first does: neither can be identified, the second can.
  Eigen::MatrixXd more(4, 3);
  more << sensitivity, 1e6 * sensitivity.col(0);
  const Eigen::VectorXd found = least_deviations(more, deviation);
  EXPECT_EQ(found[0], kInfinity);
  EXPECT_EQ(found[2], kInfinity);
  EXPECT_NEAR(found[1], wanted[1], 1e-6);
  // A bead that isn't seen tells nothing.
  Eigen::VectorXd blind = deviation;
  blind[3] = kInfinity;
  EXPECT_LT(
      (least_deviations(sensitivity, blind) - least_deviations(sensitivity.topRows(3), deviation.head<3>())).norm(),
      1e-12);
}

/// The vhs sensor on a coarse mesh.
struct SensorSetup {
  sim::DeviceSpec device;
  std::shared_ptr<const fem::Compliance> gel;
  BeadView view;
};
const SensorSetup& setup() {
  static const test::TemporaryFolder cache;
  static const SensorSetup made = [] {
    SensorSetup one;
    one.device = sim::read_device(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes" / "devices" / "vhs.yaml");
    one.device.mesh.fine_mm = 0.8;
    one.gel = sim::set_up_gel(one.device, cache.path());
    one.view = bead_view(one.device);
    return one;
  }();
  return made;
}
const fem::ContactShape kProbe = fem::RoundedCylinder{3.0, 0.0, 6.0};
constexpr double kFriction = 0.5;

TEST(ForceSensitivity, OfAFlatPunchIsThePixelsMotionOverItsForce) {
  // A flat punch keeps its contact, so all is linear but the perspective.
  const BoundLoad load{{0.2, -0.1}, {0.3, 0.0, 3.0}};
  const ForceSensitivity found = force_sensitivity(*setup().gel, setup().view, kProbe, kFriction, 0.05, load);
  const Eigen::MatrixX2d rest = bead_pixels(setup().view, Eigen::MatrixX3d::Zero(9, 3));
  Eigen::VectorXd moved(18);
  for (int i = 0; i < 9; ++i) moved.segment<2>(2 * i) = found.pixels.segment<2>(2 * i) - rest.row(i).transpose();
  EXPECT_GT(moved.norm(), 10.0);
  EXPECT_LT((found.force * load.force_N - moved).norm(), 0.05 * moved.norm());
  EXPECT_GT(found.depth_mm, 0.2);
}

TEST(ForceBound, IsReachedByTheEfficientEstimateThroughRealPresses) {
  // Each draw: pixels with noise, the force that explains them best (Gauss-Newton with a press at each iteration). The
  // scatter is the bound's; 150 draws have a standard error of 6 %.
  constexpr int kDraws = 150;
  constexpr double kNoise_px = 0.05;
  const BoundLoad load{{0.3, 0.2}, {0.2, -0.1, 2.0}};
  const ForceSensitivity at = force_sensitivity(*setup().gel, setup().view, kProbe, kFriction, 0.05, load);
  const Eigen::VectorXd deviation = Eigen::VectorXd::Constant(18, kNoise_px);
  const ForceBound bound = force_bound(at, deviation);
  const Eigen::MatrixXd gain = (at.force.transpose() * at.force).inverse() * at.force.transpose();
  const auto pixels_at = [&](const Eigen::Vector3d& force) {
    fem::Press press(*setup().gel, kProbe, kFriction, {}, {}, fem::PressOutput::forces);
    fem::PressTarget target;
    target.axis = {fem::AxisControl::at(load.place_mm.x()), fem::AxisControl::at(load.place_mm.y()),
                   fem::AxisControl::at(0.05)};
    press.step(target);
    for (const double share : {0.5, 1.0}) {
      target.axis = {fem::AxisControl::with_force(0), fem::AxisControl::with_force(0),
                     fem::AxisControl::with_force(share * force.z())};
      press.step(target);
    }
    target.axis[0] = fem::AxisControl::with_force(force.x());
    target.axis[1] = fem::AxisControl::with_force(force.y());
    const Eigen::MatrixX2d pixels = bead_pixels(setup().view, press.step(target).bead_displacement);
    Eigen::VectorXd rows(18);
    for (int i = 0; i < 9; ++i) rows.segment<2>(2 * i) = pixels.row(i).transpose();
    return rows;
  };
  const Eigen::VectorXd truth = pixels_at(load.force_N);
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  RandomStream random(3, 0, Purpose::kTest);
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd seen = truth;
    for (double& one : seen) one += kNoise_px * random.normal();
    Eigen::Vector3d force = load.force_N + gain * (seen - truth);
    force += gain * (seen - pixels_at(force));
    squares += (force - load.force_N).array().square() / kDraws;
  }
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(std::sqrt(squares[a]) / bound.place_known[a], 1.0, 4.0 / std::sqrt(2.0 * kDraws)) << "axis " << a;
    EXPECT_GE(bound.place_unknown[a], bound.place_known[a]) << "axis " << a;
  }
}

TEST(DistributionBound, OfOnePatchIsTheForceBoundOfItsTraction) {
  PatchGrid patches{{1, 1}, 4.0, {0.0, 0.0}};
  const Eigen::VectorXd deviation = Eigen::VectorXd::Constant(18, 0.05);
  const auto one =
      distribution_bound(bead_compliance(*setup().gel, setup().view.rest_mm, patches), setup().view, deviation);
  ASSERT_EQ(one.cols(), 1);
  EXPECT_TRUE(one.array().isFinite().all());
  // A round punch that covers about the same area: within a third.
  const ForceBound of_punch =
      force_bound(force_sensitivity(*setup().gel, setup().view, fem::RoundedCylinder{2.26, 0.0, 6.0}, kFriction, 0.05,
                                    {{0, 0}, {0, 0, 0.5}}),
                  deviation);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(one(a, 0) / of_punch.place_known[a], 1.0, 0.35) << "axis " << a;
  // The same place in four parts is harder to estimate, in 36 parts with 18 numbers it can't be identified.
  patches = {{2, 2}, 2.0, {-1.0, -1.0}};
  const auto four =
      distribution_bound(bead_compliance(*setup().gel, setup().view.rest_mm, patches), setup().view, deviation);
  for (int p = 0; p < 4; ++p) EXPECT_GT(four(2, p), one(2, 0));
  patches = {{6, 6}, 0.8, {-2.0, -2.0}};
  const auto many =
      distribution_bound(bead_compliance(*setup().gel, setup().view.rest_mm, patches), setup().view, deviation);
  EXPECT_FALSE(many.array().isFinite().any());
}

}  // namespace
}  // namespace touchstone::lab
