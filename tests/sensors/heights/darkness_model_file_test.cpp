#include "sensors/heights/darkness_model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "sensors/heights/darkness_calibration.h"
#include "tests/sensors/heights/painted_darkness.h"
#include "tests/sensors/models/payload_file_laws.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class DarknessModelFile : public ::testing::Test {
 protected:
  DarknessModelFile() {
    fixtures::DarknessPainter painter;
    painter.width = 160;
    painter.height = 120;
    DarknessCalibrationSettings settings;
    settings.scale.mm_per_px = painter.mm_per_px;
    const std::vector presses{painter.press({{4.1, 2.9}, 2.0, 0.7, fixtures::Layer::thin})};
    const std::vector<cv::Mat> rest{painter.rest(1), painter.rest(2)};
    model_ = calibrate_darkness(presses, mean_rest(rest), settings).model;
    bytes_ = to_bytes(model_);
  }
  auto reading(std::string bytes) {
    return [bytes = std::move(bytes)] { darkness_model_from_bytes(bytes, "m.dark"); };
  }
  std::string replaced(const std::string& from, const std::string& to) {
    return fixtures::with_line_changed(bytes_, from, to);
  }
  DarknessModel model_;
  std::string bytes_;
};

TEST_F(DarknessModelFile, ReadingGivesTheSameBits) {
  const touchstone::test::TemporaryFolder folder;
  save(model_, folder.path() / "m.dark");
  const DarknessModel read = load_darkness_model(folder.path() / "m.dark");
  EXPECT_EQ(to_bytes(read), bytes_);
  EXPECT_EQ(read.curve.heights_mm, model_.curve.heights_mm);
  EXPECT_EQ(read.rest.noise_DN, model_.rest.noise_DN);
  EXPECT_EQ(cv::norm(read.rest.mean, model_.rest.mean, cv::NORM_INF), 0.0);
}

TEST_F(DarknessModelFile, DamageIsNoticed) {
  EXPECT_THAT(reading(""), ThrowsMessage<Error>(HasSubstr("m.dark: isn't a darkness model")));
  fixtures::expect_damage_is_noticed([](const std::string& bytes) { darkness_model_from_bytes(bytes, "m.dark"); },
                                     bytes_);
}

TEST_F(DarknessModelFile, FieldsAreChecked) {
  EXPECT_THAT(reading(replaced("\"mm_per_px\"", "\"mm_per_pixel\"")),
              ThrowsMessage<Error>(HasSubstr("'mm_per_pixel'")));
  EXPECT_THAT(reading(replaced("touchstone.darkness_model", "touchstone.height_model")),
              ThrowsMessage<Error>(HasSubstr("m.dark: format: is 'touchstone.height_model'")));
  EXPECT_THAT(reading(replaced("\"version\":1", "\"version\":2")), ThrowsMessage<Error>(HasSubstr("version: is 2")));
  EXPECT_THAT(reading(replaced("\"channels\":3", "\"channels\":2")),
              ThrowsMessage<Error>(HasSubstr("neither 1 nor 3 channels")));
  EXPECT_THAT(reading(replaced("\"width_px\":160", "\"width_px\":161")), ThrowsMessage<Error>(HasSubstr("are needed")));
  EXPECT_THAT(reading(replaced("\"smoothing_px\":1.5", "\"smoothing_px\":-1.5")),
              ThrowsMessage<Error>(HasSubstr("smoothing_px is -1.5; it must be 0 to 10")));
}

TEST_F(DarknessModelFile, FaultyCurvesAreNamed) {
  const auto fault = [&](auto change) {
    DarknessModel model = model_;
    change(model.curve);
    return fault_of(model);
  };
  EXPECT_EQ(fault([](DarknessCurve&) {}), "");
  EXPECT_THAT(fault([](DarknessCurve& c) { c.heights_mm.front() = 9.0; }), HasSubstr("falls"));
  EXPECT_THAT(fault([](DarknessCurve& c) { c.first = 1; }), HasSubstr("from darkening 0 upwards"));
  EXPECT_THAT(fault([](DarknessCurve& c) { c.heights_mm.back() = NAN; }), HasSubstr("aren't finite"));
  EXPECT_THAT(fault([](DarknessCurve& c) { c.spread_mm.pop_back(); }), HasSubstr("spread"));
  EXPECT_THAT(fault([](DarknessCurve& c) {
                for (double& h : c.heights_mm) h += 0.01;
              }),
              HasSubstr("isn't 0 at"));
  EXPECT_THAT(fault([](DarknessCurve& c) { c.heights_mm.assign(c.heights_mm.size(), 0.0); }),
              HasSubstr("doesn't rise"));
  EXPECT_THAT(fault([](DarknessCurve& c) { c.heights_mm.resize(1); }), HasSubstr("1 knots"));
}

}  // namespace
}  // namespace touchstone::sensors
