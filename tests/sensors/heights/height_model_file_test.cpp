#include "sensors/heights/height_model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "tests/sensors/heights/painted_gel.h"
#include "tests/sensors/models/payload_file_laws.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class HeightModelFile : public ::testing::Test {
 protected:
  HeightModelFile() {
    HeightCalibrationSettings settings;
    settings.mm_per_px = 0.053;
    settings.table.most_cells = 20000;
    model_ = calibrate_height(painter_.presses(2, 2, 1.0, 0.7), painter_.background(), settings).model;
    bytes_ = to_bytes(model_);
  }
  auto reading(std::string bytes) {
    return [bytes = std::move(bytes)] { height_model_from_bytes(bytes, "m.gel"); };
  }
  std::string replaced(const std::string& from, const std::string& to) {
    return fixtures::with_line_changed(bytes_, from, to);
  }
  fixtures::GelPainter painter_{120, 90, 0.053, {.fall_off = 0.1}};
  HeightModel model_;
  std::string bytes_;
};

TEST_F(HeightModelFile, ReadingGivesTheSameBits) {
  const touchstone::test::TemporaryFolder folder;
  save(model_, folder.path() / "m.gel");
  const HeightModel read = load_height_model(folder.path() / "m.gel");
  EXPECT_EQ(to_bytes(read), bytes_);
  EXPECT_EQ(read.table.slopes, model_.table.slopes);
  const cv::Mat frame = painter_.press({{3.0, 2.5}, 2.0, 1.0}).frame;
  HeightEstimator first(model_);
  HeightEstimator second(read);
  EXPECT_EQ(cv::norm(first.estimate(frame).height_mm, second.estimate(frame).height_mm, cv::NORM_INF), 0.0);
}

TEST_F(HeightModelFile, DamageIsNoticed) {
  EXPECT_THAT(reading(""), ThrowsMessage<Error>(HasSubstr("m.gel: isn't a height model")));
  EXPECT_THAT(reading("PNG\n"), ThrowsMessage<Error>(HasSubstr("isn't a height model")));
  fixtures::expect_damage_is_noticed([](const std::string& bytes) { height_model_from_bytes(bytes, "m.gel"); }, bytes_);
}

TEST_F(HeightModelFile, FieldsAreChecked) {
  EXPECT_THAT(reading(replaced("\"mm_per_px\"", "\"mm_per_pixel\"")),
              ThrowsMessage<Error>(HasSubstr("'mm_per_pixel' isn't known (did you mean 'mm_per_px'?)")));
  EXPECT_THAT(reading(replaced("\"mm_per_px\":0.053", "\"mm_per_px\":-0.053")),
              ThrowsMessage<Error>(HasSubstr("mm_per_px is -0.053")));
  EXPECT_THAT(reading(replaced("\"version\":5", "\"version\":6")), ThrowsMessage<Error>(HasSubstr("version")));
  EXPECT_THAT(reading(replaced("\"version\":5", "\"version\":4")), ThrowsMessage<Error>(HasSubstr("calibrate again")));
  EXPECT_THAT(reading(replaced("\"lamp_columns\":8", "\"lamp_columns\":7")), ThrowsMessage<Error>(HasSubstr("lamps")));
  EXPECT_THAT(reading(replaced("\"width_px\":120", "\"width_px\":121")),
              ThrowsMessage<Error>(HasSubstr("bytes after its first line")));
  EXPECT_THAT(reading(replaced("\"correction\":\"fitted\"", "\"correction\":\"fited\"")),
              ThrowsMessage<Error>(HasSubstr("did you mean 'fitted'?")));
}

}  // namespace
}  // namespace touchstone::sensors
