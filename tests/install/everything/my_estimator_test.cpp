// docs/testing.md in a program of somebody else's: a shipped object is pressed on a device of one's own, and a small
// estimator is held against the truth.

#include <datasets/jobs/scenes_folder.h>
#include <sensors/learning/gaussian_process_file.h>
#include <touchstone/testing.h>

#include <cstdlib>
#include <fstream>
#include <string>

using namespace touchstone::testing;
using ::testing::HasSubstr;
using ::testing::Not;

namespace {

const VirtualSensor& my_device() {
  return device(std::getenv("MY_DEVICE"));
}

/// Mean change of grey of the pixels.
double change(const Touch& held) {
  cv::Mat difference;
  cv::absdiff(held.frame, held.background, difference);
  const cv::Scalar mean = cv::mean(difference);
  return mean[0] + mean[1] + mean[2];
}

/// The force by a line through what two forces changed.
double my_force(const Touch& held) {
  static const double at_2 = change(my_device().press(object("ball-4mm"), {.force_N = 0.2}));
  static const double at_6 = change(my_device().press(object("ball-4mm"), {.force_N = 0.6}));
  return 0.2 + 0.4 * (change(held) - at_2) / (at_6 - at_2);
}

TEST(MyEstimator, ReadsFourTenthsOfANewton) {
  const Touch held = my_device().press(object("ball-4mm"), {.place_mm = {0.3, 0.2}, .force_N = 0.4});
  EXPECT_THAT(my_force(held), IsNormalForceOf(held, {.absolute = 0.06}));
  EXPECT_THAT(my_force(held) + 0.2, Not(IsNormalForceOf(held, {.absolute = 0.06})));
}

TEST(MyEstimator, WhatDoesNotMatchIsKeptAsPictures) {
  const Touch held = my_device().press(object("ball-4mm"), {.force_N = 0.4});
  EXPECT_THAT(keep_frames(held), HasSubstr("MyEstimator.WhatDoesNotMatchIsKeptAsPictures-1.png"));
}

TEST(InstalledCopy, KeepsTrainedModels) {
  namespace sensors = touchstone::sensors;
  const Eigen::MatrixXd changes = Eigen::Vector3d(0.0, 5.0, 9.0);
  const auto learned =
      sensors::condition({Eigen::VectorXd::Constant(1, 6.0), 0.5, 0.01}, changes, Eigen::Vector3d(0.0, 0.3, 0.6));
  const std::string file = ::testing::TempDir() + "force.json";
  sensors::save(learned, file);
  const Eigen::MatrixXd place = Eigen::MatrixXd::Constant(1, 1, 7.0);
  EXPECT_EQ(sensors::predict(sensors::load_gaussian_process(file), place), sensors::predict(learned, place));
}

TEST(InstalledCopy, HasScenesOfItsOwn) {
  EXPECT_EQ(touchstone::datasets::scenes_folder().string(),
            std::string(std::getenv("PREFIX")) + "/share/touchstone/scenes");
}

TEST(InstalledCopy, HasAnImageModuleOfItsOwn) {
  ASSERT_NE(keep_frames(my_device().rest()), "");  // writes pictures, which loads the module
  std::ifstream maps("/proc/self/maps");
  int seen = 0;
  for (std::string line; std::getline(maps, line);) {
    if (line.find("touchstone_image_module") == std::string::npos) continue;
    ++seen;
    EXPECT_THAT(line, HasSubstr(std::string(std::getenv("PREFIX")) + "/lib"));
  }
  EXPECT_GT(seen, 0);
}

}  // namespace
