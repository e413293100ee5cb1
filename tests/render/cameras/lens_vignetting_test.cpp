// Light that a lens loses towards the corners beside cos^4.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "render/cameras/lens_camera.h"
#include "tests/support/message_of.h"

namespace touchstone::render {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Its axis is 8 pixels to the right of the picture's middle. Half of the diagonal is 50 pixels.
LensCamera lens(std::optional<Vignetting> vignetting) {
  LensCamera camera;
  camera.width = 80;
  camera.height = 60;
  camera.pixel_pitch_um = 20.0;
  camera.aperture_mm = 1.0;
  camera.matrix = {200.0, 200.0, 47.5, 29.5};
  camera.vignetting = std::move(vignetting);
  return camera;
}

/// A ray's weight by that of the lens without vignetting.
double factor(const Vignetting& vignetting, double x, double y) {
  return lens_ray(prepare(lens(vignetting)), x, y, 0.3, 0.8).weight /
         lens_ray(prepare(lens({})), x, y, 0.3, 0.8).weight;
}

// 1 - 0.4 r^2 + 0.1 r^4: 1 on the axis at (48, 30); 25 pixels away, r = 1/2, it is 0.90625; 50 away, r = 1, 0.7.
TEST(LensVignetting, IsAPolynomialAroundTheAxis) {
  const std::vector<double> polynomial = {-0.4, 0.1};
  EXPECT_DOUBLE_EQ(factor(polynomial, 48.0, 30.0), 1.0);
  EXPECT_NEAR(factor(polynomial, 73.0, 30.0), 0.90625, 1e-12);
  EXPECT_NEAR(factor(polynomial, 48.0 - 15.0, 30.0 + 20.0), 0.90625, 1e-12);
  EXPECT_NEAR(factor(polynomial, 48.0 - 40.0, 30.0 - 30.0), 0.7, 1e-12);
}

TEST(LensVignetting, IsACurveThroughMeasuredPoints) {
  const Vignetting curve = MonotoneCurve({{0.0, 1.0}, {0.5, 0.9}, {1.2, 0.3}});
  EXPECT_NEAR(factor(curve, 73.0, 30.0), 0.9, 1e-12);
  EXPECT_LT(factor(curve, 8.0, 0.0), 0.6);
}

TEST(LensVignetting, WithoutItTheWeightIsTheThinLensOwn) {
  const PreparedLens plain = prepare(lens({}));
  EXPECT_EQ(lens_ray(plain, 10.0, 7.0, 0.2, 0.6).weight,
            lens_ray(prepare(lens(Vignetting(std::vector<double>{0.0}))), 10.0, 7.0, 0.2, 0.6).weight);
}

// The farthest corner is at (0, 0): 48 to the left and 30 up, r = 1.1321.
TEST(LensVignetting, MustCoverThePictureAndStayAFactor) {
  const auto message = [](Vignetting vignetting) {
    return message_of([&] { check_camera(lens(std::move(vignetting))); });
  };
  EXPECT_EQ(message(std::vector<double>{-0.4}), "no error");
  EXPECT_THAT(message(std::vector<double>{-0.9}), AllOf(HasSubstr("vignetting"), HasSubstr("from 0 to 10")));
  EXPECT_THAT(message(std::vector<double>{20.0}), HasSubstr("from 0 to 10"));
  EXPECT_THAT(message(MonotoneCurve({{0.0, 1.0}, {1.0, 0.5}})), HasSubstr("1.1321"));
  EXPECT_THAT(message(MonotoneCurve({{0.1, 1.0}, {1.2, 0.5}})), HasSubstr("from 0"));
}

}  // namespace
}  // namespace touchstone::render
