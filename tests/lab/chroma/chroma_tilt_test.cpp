#include "lab/chroma/chroma_tilt_experiment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "core/units.h"
#include "datasets/jobs/scenes_folder.h"
#include "sim/scene/device.h"

namespace touchstone::lab {
namespace {

const TiltSpectra& spectra() {
  static const TiltSpectra read = read_tilt_spectra(datasets::scenes_folder() / "spectra");
  return read;
}

cv::Vec3f pixel(const Eigen::Vector3d& colour) {
  return {static_cast<float>(colour[0]), static_cast<float>(colour[1]), static_cast<float>(colour[2])};
}

/// White, with a film over 10 to 30 px and ink over `left` to `left + 16` px of both axes.
cv::Mat painted(int left) {
  const TiltColours colours = tilt_colours(spectra());
  cv::Mat picture(40, 40, CV_32FC3, pixel(colours.white));
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      const bool film = x >= 10 && x < 30 && y >= 10 && y < 30;
      const bool ink = x >= left && x < left + 16 && y >= 12 && y < 28;
      const Eigen::Vector3d bare = film ? colours.film_white : colours.white;
      picture.at<cv::Vec3f>(y, x) = pixel(ink ? (film ? colours.film_magenta : colours.magenta) : bare);
    }
  }
  return picture;
}

TEST(TiltPicture, TellsInkFromFilm) {
  const TiltReading centred = read_tilt_picture(painted(12), tilt_colours(spectra()));
  EXPECT_NEAR(centred.ink_area_px, 256.0, 0.1);
  EXPECT_NEAR(centred.ink_px.x(), 20.0, 1e-3);
  EXPECT_NEAR(centred.ink_width_px, 16.0, 0.05);
  EXPECT_NEAR(centred.coloured_area_px, 400.0, 1e-9);
  // Ink beside the film is magenta, not red.
  const TiltReading aside = read_tilt_picture(painted(18), tilt_colours(spectra()));
  EXPECT_NEAR(aside.ink_px.x(), 26.0, 1e-3);
  EXPECT_NEAR(aside.ink_area_px, 256.0, 0.1);
  EXPECT_LT(aside.hue, centred.hue);
}

TEST(TiltPicture, WithoutInkIsRefused) {
  EXPECT_THROW(read_tilt_picture(cv::Mat(8, 8, CV_32FC3, cv::Scalar(1, 1, 1)), tilt_colours(spectra())), Error);
  EXPECT_THROW(read_tilt_picture(cv::Mat(8, 8, CV_32FC3, cv::Scalar(0, 0, 0)), tilt_colours(spectra())), Error);
}

TEST(TiltScene, KeepsTheMarkersCentreWhereItWas) {
  const TiltSetup setup = far_setup();
  const TiltPose tilted{0.6, {0.1, -0.2, -0.3}};
  const render::Scene flat = tilt_scene(setup, spectra(), TiltMarker::flat, tilted);
  const render::Surface& ink = flat.surfaces.at(1);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double area = 0.0;
  for (const auto& triangle : ink.mesh.triangles) {
    const Eigen::Vector3d& a = ink.mesh.vertices[triangle[0]];
    const Eigen::Vector3d& b = ink.mesh.vertices[triangle[1]];
    const Eigen::Vector3d& c = ink.mesh.vertices[triangle[2]];
    const double part = 0.5 * (b - a).cross(c - a).norm();
    area += part;
    mean += part * (a + b + c) / 3.0;
  }
  const double stretch = 1.0 + 0.5 * 0.3 / setup.gel_mm;  // [Lin2019, eq. 3]
  EXPECT_NEAR(area, std::pow(setup.side_mm * stretch, 2), 1e-6);
  EXPECT_LT((mean / area - tilted.moved_mm).norm(), 1e-9);
  const render::Scene ball = tilt_scene(setup, spectra(), TiltMarker::ball, {0.6, Eigen::Vector3d::Zero()});
  EXPECT_LT((ball.balls.at(0).centre - Eigen::Vector3d(0, 0, -1.05)).norm(), 1e-12);
}

TEST(TiltScene, RefusesWhatTheSetupCantHave) {
  const auto refused = [](TiltMarker marker, const TiltPose& pose) {
    EXPECT_THROW(tilt_scene(far_setup(), spectra(), marker, pose), Error);
  };
  refused(TiltMarker::flat, {0.8, Eigen::Vector3d::Zero()});
  refused(TiltMarker::flat, {-0.1, Eigen::Vector3d::Zero()});
  refused(TiltMarker::flat, {std::nan(""), Eigen::Vector3d::Zero()});
  refused(TiltMarker::flat, {0.0, {0, 0, 0.1}});
  refused(TiltMarker::flat, {0.0, {0, 0, -5.0}});
  refused(TiltMarker::ball, {0.0, {0, 0, -2.96}});
  EXPECT_THROW(read_tilt_spectra("/nowhere"), Error);
}

TEST(TiltedMarker, LooksNarrowerAndYellowerAndAPressedOneLarger) {
  TiltSetup setup = far_setup();
  setup.samples = 16;
  const TiltColours colours = tilt_colours(spectra());
  const auto read_at = [&](TiltMarker marker, const TiltPose& pose) {
    return read_tilt_picture(tilt_picture(setup, spectra(), marker, pose, 3), colours);
  };
  const TiltReading level = read_at(TiltMarker::flat, {});
  const TiltReading tilted = read_at(TiltMarker::flat, {0.5, Eigen::Vector3d::Zero()});
  EXPECT_NEAR(tilted.ink_area_px / level.ink_area_px, std::cos(0.5), 0.02);
  EXPECT_NEAR(tilted.ink_width_px, level.ink_width_px, 0.01 * level.ink_width_px);
  EXPECT_GT(tilted.hue, level.hue + 2.0 * kRadiansPerDegree);
  EXPECT_NEAR(tilted.ink_px.x(), level.ink_px.x(), 0.1);
  const TiltReading pressed = read_at(TiltMarker::flat, {0.0, {0, 0, -1}});
  EXPECT_GT(pressed.ink_area_px, 1.1 * level.ink_area_px);
  EXPECT_LT(pressed.hue, level.hue - 2.0 * kRadiansPerDegree);
  // A ball has no tilt of its own.
  const TiltReading ball = read_at(TiltMarker::ball, {});
  const TiltReading turned = read_at(TiltMarker::ball, {0.5, Eigen::Vector3d::Zero()});
  EXPECT_LT(std::abs(turned.hue - ball.hue), 0.2 * (tilted.hue - level.hue));
}

TEST(NearSetup, IsTheDevicesOwn) {
  const sim::DeviceSpec device = sim::read_device(datasets::scenes_folder() / "devices" / "chroma.yaml");
  const auto& lens = std::get<sim::LensSpec>(device.camera->optics);
  const TiltSetup setup = near_setup();
  EXPECT_EQ(setup.gel_mm, device.gel.thickness_mm);
  EXPECT_EQ(setup.plate_mm, device.plate.thickness_mm);
  EXPECT_EQ(setup.side_mm, device.coating->print->width_mm);
  EXPECT_EQ(setup.film_mm, device.films->side_mm);
  EXPECT_EQ(setup.lens_mm, lens.focal_length_mm);
  EXPECT_EQ(setup.camera_mm, -device.camera->position_mm.z());
  EXPECT_EQ(setup.pixel_pitch_um, device.camera->pixel_pitch_um);
  EXPECT_EQ(setup.f_number, lens.f_number);
}

TEST(MeasureTilt, FindsTheGainThatTheLensHas) {
  TiltSetup setup = far_setup();
  setup.samples = 8;
  setup.half_view_mm = 1.6;
  const TiltTable table = measure_tilt(setup, spectra(), TiltMarker::rigid, std::vector<double>{}, 5);
  EXPECT_TRUE(table.errors.empty());
  // 24 mm before what is 378 mm away, on pixels of 4.51 um.
  EXPECT_NEAR(table.calibration.centroid_gain, 24.0 / (378.0 - 24.0) / 4.51e-3, 0.6);
  EXPECT_NEAR(table.calibration.area_slope, 0.0, 0.03);
}

}  // namespace
}  // namespace touchstone::lab
