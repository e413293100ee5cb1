#include "render/paths/shared_paths.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <span>

#include "render/cameras/camera_pose.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kElectrons = 400.0;  // per W/m^2: some 2000 from what is lit

/// Black balls before a lit sheet behind glass and gel, seen through a hole that makes points 17 pixels wide.
struct WideHole {
  Scene scene;
  PinholeCamera camera;

  explicit WideHole(double sheet_z = 0.0) : scene(sensor_stack(0.3)), camera(small_camera(120, 90)) {
    scene.surfaces.push_back({square_sheet(9.0, sheet_z, false), Lambertian{grey(0.6)}});
    for (const double x : {-1.5, 0.2, 1.6}) scene.balls.push_back({{x, 0.3 * x, sheet_z - 0.4}, 0.3, Black{}});
    scene.lamps.push_back(half_space_lamp({6, 2, -15}, {-6, -2, 15}, 40.0));
    camera.pixel_pitch_um = 7.5;
    camera.hole_diameter_um = 100.0;
    camera.foil_thickness_um = 50.0;
    camera.distance_mm = 5.0;
    camera.gel_from_camera = look_at({0, 0, -20}, {0, 0, 0}, {0, 1, 0});
  }

  RenderSettings settings(std::uint64_t seed) const {
    RenderSettings made;
    made.seed = seed;
    made.max_samples = 64;
    made.noise = NoiseTarget{grey(kElectrons), 3.0, 1.0, 1.0};
    return made;
  }
};

RenderSettings many_paths(int paths) {
  RenderSettings made = samples(paths, 8);
  made.seed = 99;
  return made;
}

// In a room of radiance L that shows nothing else each pixel has L times the solid angle of its hole, weighed by
// cosine: what a path tracer's every path gives.
TEST(SharedPaths, AnEvenRoomIsExact) {
  WideHole hole;
  hole.scene.surfaces.clear();
  hole.scene.balls.clear();
  hole.scene.lamps.clear();
  hole.scene.faces.clear();
  hole.scene.media = {Medium{}};
  const Tracer tracer(hole.scene);
  const RenderedImage image = SharedPaths(std::span(&hole.scene, 1), hole.camera, hole.settings(1))
                                  .render(hole.scene, tracer, hole.settings(1), false);
  const RenderedImage whole = tracer.render(hole.camera, many_paths(64));
  for (const auto& [row, column] : {std::pair{0, 0}, {45, 60}, {89, 119}, {20, 100}}) {
    const double expected = whole.irradiance.at<float>(row, column);
    EXPECT_NEAR(image.irradiance.at<float>(row, column), expected, 2e-3 * expected);
  }
}

// Many seeds' mean and many paths differ by less than a third of the imager's noise, by one and a half percent of the
// light beside the ball at most (a pixel of the rim), and hardly in the mean.
TEST(SharedPaths, TheMeanIsThatOfManyPaths) {
  const WideHole hole;
  const Tracer tracer(hole.scene);
  const SharedPaths shared(std::span(&hole.scene, 1), hole.camera, hole.settings(1));
  constexpr int kSeeds = 16;
  cv::Mat mean = cv::Mat::zeros(hole.camera.height, hole.camera.width, CV_32FC1);
  for (int seed = 0; seed < kSeeds; ++seed) {
    mean += shared.render(hole.scene, tracer, hole.settings(seed), false).irradiance / kSeeds;
  }
  // About the middle ball, where each of the reference's pixels has paths enough.
  const cv::Rect about(44, 26, 38, 38);
  cv::Mat mask(hole.camera.height, hole.camera.width, CV_8UC1, cv::Scalar(0));
  mask(about) = 255;
  const cv::Mat whole = tracer.render(hole.camera, many_paths(2048), mask).irradiance;
  double square = 0.0;
  double most = 0.0;
  double difference = 0.0;
  double light = 0.0;
  for (int row = about.y; row < about.br().y; ++row) {
    for (int column = about.x; column < about.br().x; ++column) {
      const double expected = kElectrons * whole.at<float>(row, column);
      const double off = kElectrons * mean.at<float>(row, column) - expected;
      const double noise = std::sqrt(expected + 10.0);
      square += off * off / (noise * noise);
      most = std::max(most, std::abs(off));
      difference += off;
      light += expected;
    }
  }
  EXPECT_LT(std::sqrt(square / about.area()), 0.33) << "of the imager's noise";
  EXPECT_LT(most, 0.015 * kElectrons * whole.at<float>(about.br().y - 1, about.x)) << "at the rim of a ball";
  EXPECT_NEAR(difference / light, 0.0, 4e-3);
}

// With diffraction footprints and paths' weights are made in different ways, but of one spread: many seeds' mean and
// many paths differ by less than half of the imager's noise, where leaving diffraction out differs by several times
// that, and hardly in the mean. An even room is as without.
TEST(SharedPaths, DiffractionIsThatOfManyPaths) {
  WideHole hole;
  const cv::Rect about(44, 26, 38, 38);
  cv::Mat mask(hole.camera.height, hole.camera.width, CV_8UC1, cv::Scalar(0));
  mask(about) = 255;
  const Tracer tracer(hole.scene);
  const cv::Mat plain = tracer.render(hole.camera, many_paths(512), mask).irradiance;
  const DiffractingAperture aperture{.diameter_mm = 0.1,
                                     .foil_mm = 0.05,
                                     .to_sensor_mm = 5.0,
                                     .per_object_mm = 1.0 / 17.0,
                                     .in_focus = false,
                                     .farthest_mm = 0.6,
                                     .wavelengths_nm = grey(550.0)};
  hole.camera.diffraction = std::make_shared<const DiffractionSpread>(aperture);
  const cv::Mat whole = tracer.render(hole.camera, many_paths(2048), mask).irradiance;
  const SharedPaths shared(std::span(&hole.scene, 1), hole.camera, hole.settings(1));
  constexpr int kSeeds = 16;
  cv::Mat mean = cv::Mat::zeros(hole.camera.height, hole.camera.width, CV_32FC1);
  for (int seed = 0; seed < kSeeds; ++seed) {
    mean += shared.render(hole.scene, tracer, hole.settings(seed), false).irradiance / kSeeds;
  }
  const auto noises = [&](const cv::Mat& picture) {
    double square = 0.0;
    for (int row = about.y; row < about.br().y; ++row) {
      for (int column = about.x; column < about.br().x; ++column) {
        const double expected = kElectrons * whole.at<float>(row, column);
        square += std::pow(kElectrons * picture.at<float>(row, column) - expected, 2) / (expected + 10.0);
      }
    }
    return std::sqrt(square / about.area());
  };
  EXPECT_LT(noises(mean), 0.5);
  EXPECT_GT(noises(plain), 1.0);
  EXPECT_NEAR(cv::sum(mean(about))[0] / cv::sum(whole(about))[0], 1.0, 5e-3);

  hole.scene.surfaces.clear();
  hole.scene.balls.clear();
  hole.scene.lamps.clear();
  hole.scene.faces.clear();
  hole.scene.media = {Medium{}};
  const Tracer room(hole.scene);
  const cv::Mat spread = room.render(hole.camera, many_paths(64)).irradiance;
  const cv::Mat even = SharedPaths(std::span(&hole.scene, 1), hole.camera, hole.settings(1))
                           .render(hole.scene, room, hole.settings(1), false)
                           .irradiance;
  hole.camera.diffraction.reset();
  const cv::Mat without = room.render(hole.camera, many_paths(64)).irradiance;
  for (const auto& [row, column] : {std::pair{0, 0}, {45, 60}, {89, 119}}) {
    const double expected = without.at<float>(row, column);
    EXPECT_NEAR(spread.at<float>(row, column), expected, 2e-3 * expected);
    EXPECT_NEAR(even.at<float>(row, column), expected, 3e-3 * expected);
  }
}

// A hole a hundred times the pixels' area needs a path for each point of the grid, and eight where edges are.
TEST(SharedPaths, APathAPointAndMoreAtEdges) {
  WideHole hole;
  const Tracer tracer(hole.scene);
  RenderSettings plain = hole.settings(1);
  plain.noise.reset();
  const SharedPaths shared(std::span(&hole.scene, 1), hole.camera, plain);
  EXPECT_EQ(shared.paths_a_point(), 1);
  const RenderedImage edged = shared.render(hole.scene, tracer, hole.settings(1), false);
  const RenderedImage even = shared.render(hole.scene, tracer, plain, false);
  EXPECT_GT(even.counts.paths, static_cast<std::uint64_t>((hole.camera.width * hole.camera.height)));
  EXPECT_LT(even.counts.paths, static_cast<std::uint64_t>(2 * (hole.camera.width * hole.camera.height)))
      << "beside the picture, too";
  EXPECT_GT(edged.counts.paths, even.counts.paths);
  EXPECT_LT(edged.counts.paths, 4 * even.counts.paths);
  // Few paths allow a coarser grid.
  RenderSettings few = plain;
  few.min_samples = 1;
  few.max_samples = 16;
  const RenderedImage coarse =
      SharedPaths(std::span(&hole.scene, 1), hole.camera, few).render(hole.scene, tracer, plain, false);
  EXPECT_LT(coarse.counts.paths, even.counts.paths / 3);
  // A hundredth of the noise calls for as many paths as there may be.
  RenderSettings strict = hole.settings(1);
  strict.noise->fraction = 0.01;
  EXPECT_EQ(SharedPaths(std::span(&hole.scene, 1), hole.camera, strict).paths_a_point(), SharedPaths::kMostPaths);
}

// A ball's image is as wide at each height as paths through the whole hole make it, though footprints are of one
// height.
TEST(SharedPaths, FootprintsFollowTheHeight) {
  const WideHole rest(0.0);
  WideHole pressed(-2.0);  // a tenth nearer: the blur is wider by 2 %
  const std::array examples = {rest.scene, pressed.scene};
  const Tracer tracer(pressed.scene);
  const auto darkest = [&](const cv::Mat& irradiance) {
    double least = 1e30;
    for (int row = 0; row < irradiance.rows; ++row) {
      for (int column = 0; column < irradiance.cols; ++column) {
        least = std::min<double>(least, irradiance.at<float>(row, column));
      }
    }
    return least;
  };
  const auto mean_of = [&](std::span<const Scene> of) {
    const SharedPaths shared(of, pressed.camera, pressed.settings(1));
    cv::Mat mean = cv::Mat::zeros(pressed.camera.height, pressed.camera.width, CV_32FC1);
    for (int seed = 0; seed < 8; ++seed) {
      mean += shared.render(pressed.scene, tracer, pressed.settings(seed), false).irradiance / 8.0;
    }
    return mean;
  };
  const cv::Mat whole = tracer.render(pressed.camera, many_paths(128)).irradiance;
  const double background = whole.at<float>(80, 60);
  const double both = std::abs(darkest(mean_of(examples)) - darkest(whole));
  EXPECT_LT(both, 0.02 * background);
}

TEST(SharedPaths, TheSameBytesOnAnyNumberOfThreads) {
  const WideHole hole;
  const Tracer tracer(hole.scene);
  cv::Mat first;
  for (int threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const RenderedImage image = SharedPaths(std::span(&hole.scene, 1), hole.camera, hole.settings(1))
                                    .render(hole.scene, tracer, hole.settings(5), true);
    EXPECT_GT(cv::mean(image.standard_error)[0], 0.0);
    if (first.empty()) first = image.irradiance;
    EXPECT_EQ(cv::norm(first, image.irradiance, cv::NORM_INF), 0.0);
  }
}

// The error that it states is no less than the scatter over seeds.
TEST(SharedPaths, TheStatedErrorCoversTheScatter) {
  const WideHole hole;
  const Tracer tracer(hole.scene);
  const SharedPaths shared(std::span(&hole.scene, 1), hole.camera, hole.settings(1));
  constexpr int kSeeds = 12;
  cv::Mat sum = cv::Mat::zeros(hole.camera.height, hole.camera.width, CV_64FC1);
  cv::Mat squares = sum.clone();
  cv::Mat stated = sum.clone();
  for (int seed = 0; seed < kSeeds; ++seed) {
    const RenderedImage image = shared.render(hole.scene, tracer, hole.settings(seed), true);
    for (int row = 0; row < sum.rows; ++row) {
      for (int column = 0; column < sum.cols; ++column) {
        const double all = image.irradiance.at<float>(row, column);
        sum.at<double>(row, column) += all / kSeeds;
        squares.at<double>(row, column) += all * all / kSeeds;
        stated.at<double>(row, column) += std::pow(image.standard_error.at<float>(row, column), 2) / kSeeds;
      }
    }
  }
  const double scatter = cv::mean(squares - sum.mul(sum))[0] * kSeeds / (kSeeds - 1.0);
  EXPECT_GT(cv::mean(stated)[0], 0.8 * scatter);
}

}  // namespace
}  // namespace touchstone::render
