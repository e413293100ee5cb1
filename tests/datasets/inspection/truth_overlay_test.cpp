#include "datasets/inspection/truth_overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "datasets/jobs/prepared_job.h"
#include "datasets/sets/generate.h"
#include "datasets/sets/manifest.h"
#include "sim/files/image_file.h"
#include "sim/view/pixel_truth.h"
#include "tests/support/small_job.h"

namespace touchstone::datasets {
namespace {

// A pad of 12 x 12 x 4 mm with 2 x 2 beads, seen askew by a camera that stands beside the middle.
constexpr const char* kDevice = R"(name: askew
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 4, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.45}
mesh: {fine_mm: 0.5, coarse_mm: 2, fine_half_extent_mm: [3.5, 3.5], fine_depth_mm: 1}
beads: {grid: 2, spacing_mm: 4.6, diameter_mm: 0.6, depth_mm: 0.8}
plate: {thickness_mm: 1, refractive_index: 1.5}
lamps:
  - {position_mm: [0, -10, -16], target_mm: [0, 0, -2], lens_radius_mm: 1, half_angle_deg: 25, power_W: [3, 3, 3]}
room_radiance: 0.1
camera: {width: 160, height: 120, pixel_pitch_um: 24, hole_diameter_um: 100, foil_thickness_um: 50, hole_to_sensor_mm: 5,
         hole_position_mm: [2, -1.5, -17], look_at_mm: [0.4, 0.3, 0], exposure_us: 500, full_well_e: 50000, read_noise_e: 5}
)";
constexpr const char* kObject = "name: ball\nshape: {type: sphere, radius_mm: 3}\nfriction: 0.8\n";
constexpr const char* kMotion =
    "start_mm: [0.9, -0.6, 3.05]\nkeys:\n  - {frames: 2, z: {position_mm: 2.5}}\n"
    "  - {frames: 2, x: {position_mm: 1.2}, y: {position_mm: -0.8}}\n";
constexpr const char* kScene =
    "device: device.yaml\nobject: object.yaml\nmotion: motion.yaml\nlight: {min_samples: 1, max_samples: 1}\n"
    "outputs: {frames: true, ids: true, contact: true}\n";
constexpr std::size_t kStraight = 2;  // the sample pressed straight down
constexpr std::size_t kSheared = 4;
constexpr double kEdge_mm = 0.5;
constexpr double kArrow_px_per_N = 40.0;

/// A set as `touchstone generate` makes it, made once: what is drawn is compared to its layers of pixel truth.
class TruthOverlay : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    folder_->write("device.yaml", kDevice);
    folder_->write("object.yaml", kObject);
    folder_->write("motion.yaml", kMotion);
    folder_->write("scene.yaml", kScene);
    const auto job = folder_->write(
        "job.yaml", "name: askew\nseed: 3\nscenes:\n  - {name: press, scene: scene.yaml, split: train}\n");
    generate(job, folder_->path() / "set", simulated(folder_->path() / "cache"));
    set_ = new InspectedSet(read_inspected_set(folder_->path() / "set"));
    view_ = new GelView(prepare_job(job).scenes.front().spec.device);
  }
  static void TearDownTestSuite() {
    delete view_;
    delete set_;
    delete folder_;
  }

  static const InspectedSample& sample(std::size_t i) { return set_->samples[i]; }
  static InspectedGel gel(std::size_t i) { return read_inspected_gel(*set_, i); }
  /// 255 where a pixel sees `id`.
  static cv::Mat seen(std::size_t i, int id) {
    const sim::LinearImage truth =
        sim::read_exr(set_->folder / picture_name("pixels", "press", sample(i).frame, "exr"));
    const auto at = std::find(truth.channel_names.begin(), truth.channel_names.end(), "id.ID");
    EXPECT_NE(at, truth.channel_names.end());
    cv::Mat ids;
    cv::extractChannel(truth.image, ids, static_cast<int>(at - truth.channel_names.begin()));
    return ids == id;
  }
  /// In pixels as a camera counts them: the corner is (0, 0).
  static cv::Point2d middle_of(const cv::Mat& mask) {
    const cv::Moments m = cv::moments(mask, true);
    EXPECT_GT(m.m00, 0.0);
    return {m.m10 / m.m00 + 0.5, m.m01 / m.m00 + 0.5};
  }
  static cv::Point2d bead_seen(std::size_t i, int bead) { return middle_of(seen(i, sim::PixelId::kFirstBead + bead)); }

  /// Black, so that all that isn't black was drawn.
  static cv::Mat picture() { return cv::Mat::zeros(120, 160, CV_8UC3); }
  static constexpr int kScale = 3;  // of what is drawn, at least 480 px wide
  static cv::Point2d in_picture(const cv::Point2d& drawn) { return drawn / kScale; }

  /// Nothing but a place: no force, no gel.
  static InspectedSample still(std::size_t i) {
    InspectedSample one = sample(i);
    one.wrench.setZero();
    return one;
  }

  // What was drawn in each of the colours, of all but the words in the corner.
  static cv::Mat without_words(cv::Mat mask) {
    mask.rowRange(mask.rows - 32, mask.rows).setTo(0);
    return mask;
  }
  static cv::Mat blue(const cv::Mat& drawn) {
    cv::Mat mask;
    cv::inRange(drawn, cv::Scalar(120, 60, 0), cv::Scalar(255, 220, 40), mask);
    return without_words(mask);
  }
  static cv::Mat green(const cv::Mat& drawn) {
    cv::Mat mask;
    cv::inRange(drawn, cv::Scalar(0, 110, 0), cv::Scalar(100, 255, 100), mask);
    return without_words(mask);
  }
  static cv::Mat red(const cv::Mat& drawn) {
    cv::Mat mask;
    cv::inRange(drawn, cv::Scalar(0, 0, 120), cv::Scalar(100, 120, 255), mask);
    return without_words(mask);
  }

  static test::TemporaryFolder* folder_;
  static InspectedSet* set_;
  static GelView* view_;
};
test::TemporaryFolder* TruthOverlay::folder_ = nullptr;
InspectedSet* TruthOverlay::set_ = nullptr;
GelView* TruthOverlay::view_ = nullptr;

TEST_F(TruthOverlay, CirclesStandAroundTheBeadsPixels) {
  for (int bead = 0; bead < 4; ++bead) {
    const cv::Point2d expected = bead_seen(kSheared, bead);
    InspectedGel one = gel(kSheared);
    one.beads = {one.beads[static_cast<std::size_t>(bead)]};
    const cv::Mat drawn = draw_truth(picture(), still(kSheared), one, *view_, {}, kArrow_px_per_N);
    ASSERT_EQ(drawn.size(), cv::Size(480, 360));
    const cv::Mat circle = blue(drawn);
    ASSERT_GT(cv::countNonZero(circle), 10) << "bead " << bead;
    const cv::Point2d circled = in_picture(middle_of(circle));
    EXPECT_LT(cv::norm(circled - expected), 0.5) << "bead " << bead << " at " << circled << ", seen at " << expected;
  }
  EXPECT_GT(cv::norm(bead_seen(kSheared, 0) - bead_seen(kSheared, 3)), 60.0) << "they are far apart";
}

TEST_F(TruthOverlay, TheCrossStandsWhereTheObjectIs) {
  // A ball pressed straight down touches round about its axis.
  const cv::Point2d expected = middle_of(seen(kStraight, sim::PixelId::kFirstObject));
  EXPECT_GT(cv::norm(expected - cv::Point2d(80, 60)), 8.0) << "not in the middle of the picture";
  InspectedGel bare = gel(kStraight);
  bare.beads.clear();
  bare.contact.assign(bare.contact.size(), false);
  const cv::Mat cross = red(draw_truth(picture(), still(kStraight), bare, *view_, {}, kArrow_px_per_N));
  ASSERT_GT(cv::countNonZero(cross), 10);
  const cv::Point2d drawn = in_picture(middle_of(cross));
  EXPECT_LT(cv::norm(drawn - expected), 0.7) << drawn << ", the contact's middle is " << expected;
}

TEST_F(TruthOverlay, TheRimOfTheMeshRunsAroundTheContactsPixels) {
  const cv::Mat contact = inspected_contact(*set_, kSheared);
  ASSERT_GT(cv::countNonZero(contact), 300);
  InspectedGel bare = gel(kSheared);
  bare.beads.clear();
  const cv::Mat rim = green(draw_truth(picture(), still(kSheared), bare, *view_, {}, kArrow_px_per_N));
  ASSERT_GT(cv::countNonZero(rim), 100);
  // Which mesh nodes touch is known to half an edge.
  const double px_per_mm = cv::norm(bead_seen(0, 1) - bead_seen(0, 0)) / 4.6;
  cv::Mat large, outside, to_inside, to_outside;
  cv::resize(contact, large, rim.size(), 0, 0, cv::INTER_NEAREST);
  cv::distanceTransform(large, to_outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(255 - large, to_inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  double worst = 0.0, off = 0.0;
  for (int row = 0; row < rim.rows; ++row) {
    for (int column = 0; column < rim.cols; ++column) {
      if (rim.at<unsigned char>(row, column) == 0) continue;
      const double outward = to_inside.at<float>(row, column) - to_outside.at<float>(row, column);
      worst = std::max(worst, std::abs(outward));
      off += outward;
    }
  }
  // Half an edge is 3.5 pixels; 5.0 were seen, with the line's own width.
  EXPECT_LT(worst / kScale, 0.5 * kEdge_mm * px_per_mm + 2.0);
  EXPECT_LT(std::abs(off / cv::countNonZero(rim)) / kScale, 0.25 * kEdge_mm * px_per_mm)
      << "neither too wide nor too narrow";
  // It goes all round: what is within it can't be left.
  cv::Mat closed = rim.clone();
  cv::floodFill(closed, cv::Point(0, 0), 255, nullptr, {}, {}, 4);
  const cv::Point2d inside = middle_of(contact) * kScale;
  EXPECT_EQ(closed.at<unsigned char>(static_cast<int>(inside.y), static_cast<int>(inside.x)), 0);
}

TEST_F(TruthOverlay, TheRimOfAMaskIsTheMasksOwn) {
  const cv::Mat contact = inspected_contact(*set_, kSheared);
  InspectedGel bare = gel(kSheared);
  bare.beads.clear();
  const cv::Mat rim = green(draw_truth(picture(), still(kSheared), bare, *view_, contact, kArrow_px_per_N));
  ASSERT_GT(cv::countNonZero(rim), 100);
  cv::Mat large, wide, narrow;
  cv::resize(contact, large, rim.size(), 0, 0, cv::INTER_NEAREST);
  cv::dilate(large, wide, cv::Mat::ones(5, 5, CV_8U));
  cv::erode(large, narrow, cv::Mat::ones(5, 5, CV_8U));
  EXPECT_EQ(cv::countNonZero(rim & narrow), 0) << "nothing within it";
  EXPECT_EQ(cv::countNonZero(rim & ~wide), 0) << "nothing outside it";
}

TEST_F(TruthOverlay, WhereABeadHidesTheContactThereIsNoRim) {
  InspectedGel one = gel(kSheared);
  one.beads.resize(1);
  const cv::Mat bead = seen(kSheared, sim::PixelId::kFirstBead);
  const cv::Point place = bead_seen(kSheared, 0);
  // Once the bead stands within what touches, once at its edge.
  for (const int off : {0, 30}) {
    const cv::Point real(place.x + off + 14, place.y);
    cv::Mat contact = cv::Mat::zeros(120, 160, CV_8U);
    cv::circle(contact, place + cv::Point(off, 0), 30, 255, cv::FILLED);
    cv::circle(contact, real, 5, 0, cv::FILLED);
    cv::Mat whole_rim = green(draw_truth(picture(), still(kSheared), one, *view_, contact, kArrow_px_per_N));
    contact.setTo(0, bead);
    const cv::Mat rim = green(draw_truth(picture(), still(kSheared), one, *view_, contact, kArrow_px_per_N));
    EXPECT_EQ(cv::countNonZero(rim != whole_rim), 0) << off << ": the bead's pixels make no difference";
    cv::Mat about_real = cv::Mat::zeros(rim.size(), CV_8U);
    cv::circle(about_real, kScale * real, kScale * 8, 255, cv::FILLED);
    EXPECT_GT(cv::countNonZero(rim & about_real), 50) << off << ": what isn't touched has a rim";
    cv::Mat on_bead;
    cv::resize(bead, on_bead, rim.size(), 0, 0, cv::INTER_NEAREST);
    EXPECT_EQ(cv::countNonZero(rim & on_bead), 0) << off;
  }
}

TEST_F(TruthOverlay, WithoutTheCameraNothingIsDrawnThatWouldNeedIt) {
  const cv::Mat contact = inspected_contact(*set_, kSheared);
  const cv::Mat with = draw_truth(picture(), sample(kSheared), gel(kSheared), {}, contact, kArrow_px_per_N);
  EXPECT_GT(cv::countNonZero(green(with)), 100) << "the mask is the picture's own";
  EXPECT_EQ(cv::countNonZero(red(with)) + cv::countNonZero(blue(with)), 0);
  const cv::Mat without = draw_truth(picture(), sample(kSheared), gel(kSheared), {}, {}, kArrow_px_per_N);
  cv::Mat grey;
  cv::cvtColor(without, grey, cv::COLOR_BGR2GRAY);
  EXPECT_GT(cv::countNonZero(grey), 0) << "the words";
  EXPECT_EQ(cv::countNonZero(without_words(grey)), 0);
}

TEST(ArrowScale, TheLargestForceAlongTheGelFillsAQuarterOfASmallPicture) {
  std::vector<InspectedSample> samples(3);
  EXPECT_DOUBLE_EQ(arrow_scale_px_per_N(samples), 200.0);
  samples[1].wrench << 0.9, -1.2, 7.0, 0, 0, 0;
  EXPECT_DOUBLE_EQ(arrow_scale_px_per_N(samples), 80.0);
  samples[1].wrench << 0.003, 0.004, 7.0, 0, 0, 0;
  EXPECT_DOUBLE_EQ(arrow_scale_px_per_N(samples), 200.0) << "next to nothing stays next to nothing";
}

TEST_F(TruthOverlay, TheArrowPointsAlongTheShear) {
  const InspectedSample& one = sample(kSheared);
  ASSERT_GT(one.wrench.head<2>().norm(), 0.1);
  InspectedSample strong = one;
  strong.wrench.head<2>() *= 2.0 / one.wrench.head<2>().norm();
  InspectedGel bare = gel(kSheared);
  bare.beads.clear();
  bare.contact.assign(bare.contact.size(), false);
  const cv::Mat cross = red(draw_truth(picture(), still(kSheared), bare, *view_, {}, kArrow_px_per_N));
  const cv::Mat both = red(draw_truth(picture(), strong, bare, *view_, {}, kArrow_px_per_N));
  const cv::Point2d foot = middle_of(cross);
  cv::Point2d tip = foot;
  for (int row = 0; row < both.rows; ++row) {
    for (int column = 0; column < both.cols; ++column) {
      const cv::Point2d here(column + 0.5, row + 0.5);
      if (both.at<unsigned char>(row, column) != 0 && cv::norm(here - foot) > cv::norm(tip - foot)) tip = here;
    }
  }
  // Where the gel's x and y run to in the picture: along the rows of undeformed beads.
  const cv::Point2d x = bead_seen(0, 1) - bead_seen(0, 0);
  const cv::Point2d y = bead_seen(0, 2) - bead_seen(0, 0);
  const cv::Point2d along = strong.wrench.x() * x / cv::norm(x) + strong.wrench.y() * y / cv::norm(y);
  const cv::Point2d arrow = tip - foot;
  ASSERT_GT(cv::norm(arrow), 40.0);
  EXPECT_NEAR(cv::norm(arrow), 80.0, 4.0) << "40 px a newton";
  EXPECT_GT(arrow.dot(along) / (cv::norm(arrow) * cv::norm(along)), std::cos(3.0 * CV_PI / 180.0))
      << arrow << " against " << along;
}

}  // namespace
}  // namespace touchstone::datasets
