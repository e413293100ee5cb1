#include "sensors/numerics/poisson_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"

namespace touchstone::sensors {
namespace {

double largest_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_INF);
}

/// Random heights, rough and smooth, in [-1, 1] or so.
cv::Mat random_heights(int width, int height, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  cv::Mat heights(height, width, CV_32FC1);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double wave = std::sin(5.0 * u / width + 1.0) * std::cos(4.0 * v / height);
      heights.at<float>(v, u) = static_cast<float>(wave + 0.1 * random.normal());
    }
  }
  return heights;
}

/// The five-point Laplacian by its definition, in double precision.
cv::Mat laplacian(const cv::Mat& z, HeightBorder border) {
  cv::Mat result(z.size(), CV_32FC1);
  for (int v = 0; v < z.rows; ++v) {
    for (int u = 0; u < z.cols; ++u) {
      const double here = z.at<float>(v, u);
      double sum = 0.0;
      for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const bool inside = u + du >= 0 && u + du < z.cols && v + dv >= 0 && v + dv < z.rows;
        if (inside) sum += z.at<float>(v + dv, u + du) - here;
        if (!inside && border == HeightBorder::zero) sum += -2.0 * here;
      }
      result.at<float>(v, u) = static_cast<float>(sum);
    }
  }
  return result;
}

TEST(PoissonSolver, HeightsComeBackFromTheirLaplacian) {
  // Sizes with factors 2 to 5, odd, prime, not a multiple of the lanes, and tiny.
  for (const auto& [width, height] :
       {std::pair{320, 240}, {240, 320}, {64, 45}, {37, 49}, {16, 31}, {33, 22}, {5, 5}, {2, 2}, {3, 2}, {200, 4}}) {
    for (const HeightBorder border : {HeightBorder::zero, HeightBorder::free}) {
      cv::Mat truth = random_heights(width, height, 7);
      if (border == HeightBorder::free) truth -= cv::mean(truth)[0];
      PoissonSolver solver(width, height, border);
      cv::Mat heights;
      solver.solve(laplacian(truth, border), heights);
      // The right-hand side's rounding, 6e-8, grows by up to the largest side's (n/pi)^2; seen: 1e-5.
      EXPECT_LT(largest_difference(heights, truth), 5e-5) << width << " x " << height;
    }
  }
}

TEST(PoissonSolver, ParabolaOfEitherSignIsExactWithAFreeBorder) {
  const int width = 96;
  const int height = 80;
  const double pixel = 0.05;
  cv::Mat truth(height, width, CV_32FC1);
  cv::Mat slope_u(height, width, CV_32FC1);
  cv::Mat slope_v(height, width, CV_32FC1);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double x = pixel * (u - 40.0);
      const double y = pixel * (v - 30.0);
      truth.at<float>(v, u) = static_cast<float>(0.1 * x * x - 0.2 * y * y + 0.05 * x * y + 0.3 * x);
      slope_u.at<float>(v, u) = static_cast<float>(0.2 * x + 0.05 * y + 0.3);
      slope_v.at<float>(v, u) = static_cast<float>(-0.4 * y + 0.05 * x);
    }
  }
  truth -= cv::mean(truth)[0];
  cv::Mat heights;
  PoissonSolver(width, height, HeightBorder::free).integrate(slope_u, slope_v, pixel, heights);
  EXPECT_LT(largest_difference(heights, truth), 2e-6);
}

/// A bump that is zero at the border with its slopes.
struct Bump {
  cv::Mat heights, slope_u, slope_v;
};
Bump bump(int width, int height, double pixel) {
  Bump result{cv::Mat(height, width, CV_32FC1), cv::Mat(height, width, CV_32FC1), cv::Mat(height, width, CV_32FC1)};
  const double sigma = 0.06 * width * pixel;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double x = pixel * (u + 0.5 - 0.45 * width);
      const double y = pixel * (v + 0.5 - 0.55 * height);
      const double z = 0.4 * std::exp(-(x * x + y * y) / (2.0 * sigma * sigma));
      result.heights.at<float>(v, u) = static_cast<float>(z);
      result.slope_u.at<float>(v, u) = static_cast<float>(-x / (sigma * sigma) * z);
      result.slope_v.at<float>(v, u) = static_cast<float>(-y / (sigma * sigma) * z);
    }
  }
  return result;
}

TEST(PoissonSolver, ErrorFallsWithTheFourthPowerOfThePixel) {
  const auto error = [](int factor) {
    const Bump truth = bump(40 * factor, 30 * factor, 1.0 / factor);
    cv::Mat heights;
    PoissonSolver(40 * factor, 30 * factor, HeightBorder::zero)
        .integrate(truth.slope_u, truth.slope_v, 1.0 / factor, heights);
    return largest_difference(heights, truth.heights);
  };
  const double coarse = error(1);
  const double fine = error(2);
  EXPECT_GT(std::log2(coarse / fine), 3.5);
  EXPECT_LT(fine, 1e-3);
}

TEST(PoissonSolver, BothBordersAgreeOnABumpWithin) {
  const Bump truth = bump(320, 240, 0.05);
  cv::Mat zero;
  cv::Mat free;
  PoissonSolver(320, 240, HeightBorder::zero).integrate(truth.slope_u, truth.slope_v, 0.05, zero);
  PoissonSolver(320, 240, HeightBorder::free).integrate(truth.slope_u, truth.slope_v, 0.05, free);
  free -= free.at<float>(0, 0);
  EXPECT_LT(largest_difference(zero, truth.heights), 2e-5);
  EXPECT_LT(largest_difference(free, truth.heights), 2e-5);
}

TEST(PoissonSolver, RotationalNoiseLeavesLittle) {
  // Slopes that are no gradient: a pure rotation has no divergence inside, so its least squares height is near zero.
  const int size = 64;
  cv::Mat slope_u(size, size, CV_32FC1);
  cv::Mat slope_v(size, size, CV_32FC1);
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) {
      const double x = (u - 31.5) / 8.0;
      const double y = (v - 31.5) / 8.0;
      const double z = std::exp(-(x * x + y * y) / 2.0);
      slope_u.at<float>(v, u) = static_cast<float>(-y * z);
      slope_v.at<float>(v, u) = static_cast<float>(x * z);
    }
  }
  cv::Mat heights;
  PoissonSolver(size, size, HeightBorder::zero).integrate(slope_u, slope_v, 1.0, heights);
  EXPECT_LT(cv::norm(heights, cv::NORM_INF), 1e-3 * 8.0);  // slopes of this size over 8 pixels would be a height of 8
}

TEST(PoissonSolver, SecondCallOwesNothingToTheFirst) {
  const Bump truth = bump(50, 40, 0.05);
  PoissonSolver solver(50, 40, HeightBorder::free);
  cv::Mat first;
  solver.integrate(truth.slope_u, truth.slope_v, 0.05, first);
  cv::Mat other;
  solver.solve(random_heights(50, 40, 3), other);
  cv::Mat again;
  solver.integrate(truth.slope_u, truth.slope_v, 0.05, again);
  EXPECT_EQ(largest_difference(first, again), 0.0);
}

TEST(PoissonSolver, RefusesSizesThatAreNoPicture) {
  EXPECT_THROW(PoissonSolver(1, 240, HeightBorder::zero), Error);
  EXPECT_THROW(PoissonSolver(320, 0, HeightBorder::zero), Error);
  EXPECT_THROW(PoissonSolver(320, 100000, HeightBorder::zero), Error);
}

}  // namespace
}  // namespace touchstone::sensors
