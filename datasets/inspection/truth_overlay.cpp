#include "datasets/inspection/truth_overlay.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "render/cameras/first_hits.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_faces.h"
#include "sim/view/visible_scene.h"

namespace touchstone::datasets {
namespace {

constexpr int kLeastWidth = 480;
constexpr int kMostScale = 8;
constexpr double kArrow_px_per_N = 40.0;
constexpr double kLongestArrow = 0.4;  // of the picture's width
// BGR. Light things stand on a dark line, so that they are seen on any picture.
const cv::Scalar kDark(0, 0, 0);
const cv::Scalar kRim(60, 220, 60);
const cv::Scalar kBead(255, 200, 0);
const cv::Scalar kForce(40, 80, 255);

/// Drawing with parts of pixels: four bits of fraction.
constexpr int kFraction = 4;
cv::Point fine(const cv::Point2d& at) {
  return {static_cast<int>(std::lround(at.x * (1 << kFraction))),
          static_cast<int>(std::lround(at.y * (1 << kFraction)))};
}

void outlined(cv::Mat& on, const cv::Point2d& from, const cv::Point2d& to, const cv::Scalar& colour) {
  cv::line(on, fine(from), fine(to), kDark, 3, cv::LINE_AA, kFraction);
  cv::line(on, fine(from), fine(to), colour, 1, cv::LINE_AA, kFraction);
}

}  // namespace

struct GelView::Parts {
  render::Scene faces;
  render::ReadyCamera camera;
};

GelView::GelView(const sim::DeviceSpec& device) {
  if (!device.camera) fail("device {}: has no camera", device.name);
  auto parts = std::make_shared<Parts>();
  parts->faces.faces = sim::flat_faces(device);
  parts->camera = render::make_ready(sim::camera_of(*device.camera));
  parts_ = std::move(parts);
}

std::optional<cv::Point2d> GelView::operator()(const Eigen::Vector3d& point) const {
  const auto pixel = render::project_through_faces(parts_->faces, parts_->camera, point);
  if (!pixel || !pixel->allFinite()) return std::nullopt;
  return cv::Point2d(pixel->x(), pixel->y());
}

std::vector<std::pair<cv::Point2d, cv::Point2d>> contact_rim(const InspectedGel& gel, const GelView& view) {
  std::map<std::pair<int, int>, int> uses;
  for (const std::array<int, 3>& corners : gel.triangles) {
    if (!std::all_of(corners.begin(), corners.end(), [&](int c) { return gel.contact[static_cast<std::size_t>(c)]; })) {
      continue;
    }
    for (int k = 0; k < 3; ++k) ++uses[std::minmax(corners[k], corners[(k + 1) % 3])];
  }
  std::vector<std::pair<cv::Point2d, cv::Point2d>> rim;
  for (const auto& [edge, count] : uses) {
    if (count != 1) continue;
    const auto from = view(gel.displaced[static_cast<std::size_t>(edge.first)]);
    const auto to = view(gel.displaced[static_cast<std::size_t>(edge.second)]);
    if (from && to) rim.emplace_back(*from, *to);
  }
  return rim;
}

cv::Mat draw_truth(const cv::Mat& picture, const InspectedSample& sample, const InspectedGel& gel,
                   const std::optional<GelView>& view, const cv::Mat& contact) {
  const int scale = std::clamp((kLeastWidth + picture.cols - 1) / picture.cols, 1, kMostScale);
  cv::Mat bgr;
  if (picture.channels() == 1) {
    cv::cvtColor(picture, bgr, cv::COLOR_GRAY2BGR);
  } else {
    bgr = picture;
  }
  if (bgr.depth() == CV_16U) bgr.convertTo(bgr, CV_8U, 1.0 / 256.0);
  cv::Mat drawn;
  cv::resize(bgr, drawn, {}, scale, scale, cv::INTER_NEAREST);
  // Pixel (0, 0) has its centre at (0.5, 0.5) and, for OpenCV's drawing, at (0, 0).
  const auto shown = [&](const cv::Point2d& at) { return cv::Point2d(scale * at.x - 0.5, scale * at.y - 0.5); };

  if (!contact.empty() && contact.size() == picture.size()) {
    cv::Mat large;
    cv::resize(contact, large, drawn.size(), 0, 0, cv::INTER_NEAREST);
    std::vector<std::vector<cv::Point>> outlines;
    cv::findContours(large, outlines, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
    cv::drawContours(drawn, outlines, -1, kDark, 3);
    cv::drawContours(drawn, outlines, -1, kRim, 1);
  }
  cv::Point2d foot(0.5 * picture.cols, 0.5 * picture.rows);
  cv::Point2d right(1, 0), down(0, 1);  // of the gel's x and y in the picture
  if (view) {
    for (const auto& [from, to] : contact_rim(gel, *view)) outlined(drawn, shown(from), shown(to), kRim);
    for (const Eigen::Vector3d& bead : gel.beads) {
      const auto at = (*view)(bead);
      if (!at) continue;
      cv::circle(drawn, fine(shown(*at)), 4 << kFraction, kDark, 3, cv::LINE_AA, kFraction);
      cv::circle(drawn, fine(shown(*at)), 4 << kFraction, kBead, 1, cv::LINE_AA, kFraction);
    }
    const Eigen::Vector2d place = sample.gel_from_object.translation.head<2>();
    const auto at = (*view)({place.x(), place.y(), 0.0});
    const auto along_x = (*view)({place.x() + 0.1, place.y(), 0.0});
    const auto along_y = (*view)({place.x(), place.y() + 0.1, 0.0});
    if (at && along_x && along_y) {
      foot = *at;
      right = (*along_x - *at) / cv::norm(*along_x - *at);
      down = (*along_y - *at) / cv::norm(*along_y - *at);
    }
  }
  const cv::Point2d middle = shown(foot);
  outlined(drawn, middle - cv::Point2d(6, 0), middle + cv::Point2d(6, 0), kForce);
  outlined(drawn, middle - cv::Point2d(0, 6), middle + cv::Point2d(0, 6), kForce);
  const Eigen::Vector3d force = sample.wrench.head<3>();
  cv::Point2d arrow = kArrow_px_per_N * (force.x() * right + force.y() * down);
  const double length = cv::norm(arrow);
  if (length > kLongestArrow * drawn.cols) arrow *= kLongestArrow * drawn.cols / length;
  if (length > 2.0) {
    cv::arrowedLine(drawn, middle, middle + arrow, kDark, 4, cv::LINE_AA);
    cv::arrowedLine(drawn, middle, middle + arrow, kForce, 2, cv::LINE_AA);
  }
  const std::string words = fmt::format("{:.2f} {:.2f} {:.2f} N", force.x(), force.y(), force.z());
  const cv::Point corner(8, drawn.rows - 10);
  cv::putText(drawn, words, corner, cv::FONT_HERSHEY_SIMPLEX, 0.6, kDark, 4, cv::LINE_AA);
  cv::putText(drawn, words, corner, cv::FONT_HERSHEY_SIMPLEX, 0.6, {255, 255, 255}, 1, cv::LINE_AA);
  return drawn;
}

}  // namespace touchstone::datasets
