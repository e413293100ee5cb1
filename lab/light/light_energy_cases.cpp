#include "lab/light/light_energy_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "closed_forms/light_closed_forms.h"
#include "core/random.h"
#include "core/units.h"
#include "lab/light/light_setup.h"
#include "render/imager/imager_presets.h"

namespace touchstone::lab {
namespace {

using render::Medium;
using render::Scene;
using render::Spectrum;

}  // namespace

double rough_furnace(std::uint64_t seed, int effort) {
  double worst = 0.0;
  for (const double alpha : {0.05, 0.3, 0.6}) {
    for (const double index : {1.3, 1.6}) {
      for (const bool within : {false, true}) {
        Scene scene = empty_scene(1.0);
        scene.media = {Medium{within ? index : 1.0}, Medium{within ? 1.0 : index}};
        scene.balls.push_back({{0, 0, 0}, 2.0, render::RoughRefractive{1, 0, alpha}});
        const Eigen::Vector3d from = within ? Eigen::Vector3d(0.5, 0.2, 0.1) : Eigen::Vector3d(1.2, 0.3, 9.0);
        const double seen =
            render::Tracer(scene).radiance(from, Eigen::Vector3d(0.01, 0.02, -1), samples(256 * effort, seed))[0];
        worst = std::max(worst, std::abs(seen - 1.0));
      }
    }
  }
  return worst;
}

double closed_box(std::uint64_t seed, int effort) {
  constexpr double kHalf = 5.0;
  constexpr std::array<double, 6> kAlbedos = {0.9, 0.5, 0.2, 0.7, 0.4, 0.8};
  const auto on_wall = [&](int wall, double x, double y) {
    Eigen::Vector3d point;
    point[wall / 2] = wall % 2 == 0 ? kHalf : -kHalf;
    point[(wall / 2 + 1) % 3] = kHalf * x;
    point[(wall / 2 + 2) % 3] = kHalf * y;
    return point;
  };
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{}, Medium{1.5}};
  for (int wall = 0; wall < 6; ++wall) {
    TriangleMesh mesh;
    for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
      mesh.vertices.push_back(on_wall(wall, x, y));
    }
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.surfaces.push_back({mesh, render::Lambertian{grey(kAlbedos[wall])}});
  }
  scene.balls.push_back({{-1.5, 1.0, -1.0}, 2.0, render::RoughRefractive{1, 0, 0.4}});
  for (const double sense : {-1.0, 1.0}) {  // two halves of 1 W/sr all round
    render::SpotLamp lamp;
    lamp.position = {1.0, -0.7, 2.0};
    lamp.direction = {0, 0, sense};
    lamp.half_angle = kPi / 2;
    lamp.soft_angle = 0.0;
    lamp.power_W = grey(2.0 * kPi);
    scene.lamps.push_back(lamp);
  }
  const render::Tracer tracer(scene);
  RandomStream stream(seed, 0, Purpose::kPlacement);
  constexpr double kArea = 4.0 * kHalf * kHalf * 1e-6;
  const int points = 4000 * effort;
  double power = 0.0;
  for (int wall = 0; wall < 6; ++wall) {
    // A wall that shows the radiance L takes (1 - albedo) pi L / albedo from each m^2.
    const double share = (1.0 - kAlbedos[wall]) * kPi / kAlbedos[wall] * kArea / points;
    for (int i = 0; i < points; ++i) {
      const double x = 2.0 * stream.uniform() - 1.0;
      const Eigen::Vector3d place = on_wall(wall, x, 2.0 * stream.uniform() - 1.0);
      const Eigen::Vector3d inward = -place.normalized();
      const auto number = static_cast<std::uint64_t>(wall * points + i);
      power += share * tracer.radiance(place + 1e-3 * inward, -inward, samples(2, (seed << 32) + number))[0];
    }
  }
  return std::abs(power / (4.0 * kPi) - 1.0);
}

double coaxial_discs(std::uint64_t seed, int effort) {
  constexpr double kSmall = 1.0, kLarge = 2.0, kApart = 1.5;
  const auto disc = [](double radius, double z) {
    TriangleMesh mesh;
    mesh.vertices.push_back({0, 0, z});
    constexpr int kCorners = 400;
    for (int i = 0; i < kCorners; ++i) {
      const double angle = 2.0 * kPi * i / kCorners;
      mesh.vertices.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
      mesh.triangles.push_back({0, i + 1, (i + 1) % kCorners + 1});
    }
    return mesh;
  };
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({disc(kLarge, kApart), render::Emitter{grey(1.0)}});
  scene.surfaces.push_back({disc(1.001 * kSmall, 0.0), render::Lambertian{grey(0.8)}});
  const render::Tracer tracer(scene);
  RandomStream stream(seed, 1, Purpose::kPlacement);
  const int points = 20000 * effort;
  double share = 0.0;
  for (int i = 0; i < points; ++i) {  // places of the lower disc, seen from close by
    const double radius = kSmall * std::sqrt(stream.uniform());
    const double angle = 2.0 * kPi * stream.uniform();
    const Eigen::Vector3d from(radius * std::cos(angle), radius * std::sin(angle), 0.01);
    const auto number = static_cast<std::uint64_t>(i);
    share += tracer.radiance(from, {0, 0, -1}, samples(8, (seed << 32) + number))[0] / (0.8 * points);
  }
  return std::abs(share / closed_forms::coaxial_discs_share(kSmall, kLarge, kApart) - 1.0);
}

double photon_transfer_of_presets(std::uint64_t seed, int effort) {
  const cv::Size size(1000, 250 * effort);
  const render::FixedPattern even = {cv::Mat(size, CV_32FC1, cv::Scalar(1.0)),
                                     cv::Mat(size, CV_32FC1, cv::Scalar(0.0))};
  double worst = 0.0;
  for (const auto& name : render::imager_preset_names()) {
    const render::Imager imager = render::imager_preset(name, 1e-3).imager;
    const render::ImagerResponse response = render::response_of(imager);
    const double gain = imager.gain_DN_per_e;
    for (const double level : {0.05, 0.3, 0.8}) {
      // The columns run over one step of the numbers: rounding then adds 1/12 to the variance, however coarse it is.
      const auto electrons = [&](int column) {
        return level * imager.full_well_e + ((column + 0.5) / size.width - 0.5) / gain;
      };
      cv::Mat light(size, CV_32FC3, cv::Scalar::all(0.0));
      for (int row = 0; row < size.height; ++row) {
        for (int column = 0; column < size.width; ++column) {
          const int channel =
              imager.bayer == render::BayerPattern::none ? 0 : render::channel_of(imager.bayer, column, row);
          light.at<cv::Vec3f>(row, column)[1] =
              static_cast<float>(electrons(column) / response.electrons_per_irradiance(channel, 1));
        }
      }
      cv::Mat numbers;
      render::expose(light, imager, even, seed, 1).convertTo(numbers, CV_64F);
      double squares = 0.0;
      for (int row = 0; row < size.height; ++row) {
        for (int column = 0; column < size.width; ++column) {
          const double expected = imager.black_level_DN + gain * (electrons(column) + response.dark_e);
          squares += std::pow(numbers.at<double>(row, column) - expected, 2);
        }
      }
      const double line = gain * gain * (imager.read_noise_e * imager.read_noise_e + response.dark_e) +
                          gain * gain * level * imager.full_well_e + 1.0 / 12.0;
      worst = std::max(worst, std::abs(squares / size.area() / line - 1.0));
    }
  }
  return worst;
}

}  // namespace touchstone::lab
