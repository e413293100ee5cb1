#include "sensors/skin/colour_correction.h"

#include <Eigen/QR>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/cie_colour.h"
#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kLargest = 255;
constexpr double kDark = 0.6;  // of the brightness about a place: beads are darker
constexpr double kWide_px = 40.0;
constexpr double kLeastTrusted = 0.1;

void check_pair(const cv::Mat& picture, const FlatField& field, const cv::Mat& mask) {
  if (picture.type() != CV_8UC3 || picture.size() != field.white.size()) {
    fail("colour: a picture of {} x {} pixels; {} x {} of three bytes are needed", picture.cols, picture.rows,
         field.white.cols, field.white.rows);
  }
  if (mask.type() != CV_8UC1 || mask.size() != picture.size()) {
    fail("colour: a mask of {} x {} pixels; {} x {} of one byte are needed", mask.cols, mask.rows, picture.cols,
         picture.rows);
  }
}

/// Calls use(row, column) for trusted pixels of the mask. @returns how many there are
template <typename Use>
int for_trusted(const FlatField& field, const cv::Mat& mask, Use&& use) {
  int count = 0;
  for (int row = 0; row < mask.rows; ++row) {
    const auto* wanted = mask.ptr<std::uint8_t>(row);
    const auto* trusted = field.trusted.ptr<std::uint8_t>(row);
    for (int column = 0; column < mask.cols; ++column) {
      if (wanted[column] == 0 || trusted[column] == 0) continue;
      use(row, column);
      ++count;
    }
  }
  return count;
}

}  // namespace

FlatField flat_field(std::span<const cv::Mat> card, double smooth_px) {
  if (card.empty()) fail("flat field: there is no picture of a white card");
  cv::Mat sum(card.front().size(), CV_32FC3, cv::Scalar::all(0));
  for (const cv::Mat& picture : card) {
    if (picture.type() != CV_8UC3 || picture.size() != sum.size() || picture.empty()) {
      fail("flat field: a picture of {} x {} pixels beside one of {} x {}; all need three bytes a pixel and one size",
           picture.cols, picture.rows, sum.cols, sum.rows);
    }
    cv::accumulate(picture, sum);
  }
  FlatField field;
  sum.convertTo(field.white, CV_32F, 1.0 / static_cast<double>(card.size()));
  cv::Mat grey;
  cv::cvtColor(field.white, grey, cv::COLOR_BGR2GRAY);
  cv::Mat about;
  cv::GaussianBlur(grey, about, {}, kWide_px);
  cv::Mat channels = field.white.reshape(1, static_cast<int>(field.white.total()));
  cv::Mat brightest;
  cv::reduce(channels, brightest, 1, cv::REDUCE_MAX);
  brightest = brightest.reshape(1, grey.rows);
  field.trusted = (grey > kDark * about) & (brightest < kLargest) & (grey > 1.0);
  cv::erode(field.trusted, field.trusted, cv::getStructuringElement(cv::MORPH_ELLIPSE, {9, 9}));
  const double share = cv::countNonZero(field.trusted) / static_cast<double>(field.trusted.total());
  if (share < kLeastTrusted) {
    fail("flat field: {:.1f} % of the card's picture are neither dark nor at {}; at least {:.0f} % are needed",
         100 * share, kLargest, 100 * kLeastTrusted);
  }
  if (smooth_px > 0.0) {
    // A mean over what is trusted, weighted by the distance.
    cv::Mat weight;
    field.trusted.convertTo(weight, CV_32F, 1.0 / kLargest);
    cv::Mat three;
    cv::merge(std::vector<cv::Mat>(3, weight), three);
    cv::Mat kept = field.white.mul(three);
    cv::GaussianBlur(kept, kept, {}, smooth_px);
    cv::GaussianBlur(three, three, {}, smooth_px);
    cv::Mat smooth;
    cv::divide(kept, three, smooth);
    smooth.copyTo(field.white, field.trusted);
  }
  return field;
}

Eigen::Vector3d mean_of_white(const cv::Mat& picture, const FlatField& field, const cv::Mat& mask) {
  check_pair(picture, field, mask);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const int count = for_trusted(field, mask, [&](int row, int column) {
    const auto& value = picture.at<cv::Vec3b>(row, column);
    const auto& white = field.white.at<cv::Vec3f>(row, column);
    for (int k = 0; k < 3; ++k) sum[k] += value[2 - k] / static_cast<double>(white[2 - k]);
  });
  if (count == 0) fail("colour: no pixel of the mask is where the white card was seen");
  return sum / count;
}

Eigen::Vector3d mean_of_one_white(const cv::Mat& picture, const FlatField& field, const cv::Mat& mask) {
  check_pair(picture, field, mask);
  cv::Mat middle(mask.size(), CV_8UC1, cv::Scalar(0));
  middle(cv::Rect(mask.cols / 3, mask.rows / 3, mask.cols / 3, mask.rows / 3)).setTo(kLargest);
  Eigen::Vector3d white = Eigen::Vector3d::Zero();
  const int whites = for_trusted(field, middle, [&](int row, int column) {
    const auto& value = field.white.at<cv::Vec3f>(row, column);
    for (int k = 0; k < 3; ++k) white[k] += value[2 - k];
  });
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const int count = for_trusted(field, mask, [&](int row, int column) {
    const auto& value = picture.at<cv::Vec3b>(row, column);
    for (int k = 0; k < 3; ++k) sum[k] += value[2 - k];
  });
  if (whites == 0 || count == 0) fail("colour: no pixel of the mask is where the white card was seen");
  return (sum / count).cwiseQuotient(white / whites);
}

Eigen::Vector3d ColourMatrix::lab(const Eigen::Vector3d& rgb) const {
  return lab_from_xyz(xyz_from_rgb * rgb);
}

ColourMatrix fit_colour_matrix(const Eigen::MatrixX3d& rgb, const Eigen::MatrixX3d& xyz) {
  if (rgb.rows() != xyz.rows() || rgb.rows() < 3) {
    fail("colour matrix: {} measured and {} known patches; three or more of each are needed", rgb.rows(), xyz.rows());
  }
  if (!rgb.allFinite() || !xyz.allFinite()) fail("colour matrix: a patch's colour isn't finite");
  const Eigen::ColPivHouseholderQR<Eigen::MatrixX3d> solver(rgb);
  if (solver.rank() < 3) fail("colour matrix: the patches' colours are alike; no matrix follows from them");
  return {Eigen::Matrix3d(solver.solve(xyz).transpose())};
}

}  // namespace touchstone::sensors
