#include "datasets/inspection/truth_overlay.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "render/cameras/first_hits.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_faces.h"

namespace touchstone::datasets {
namespace {

constexpr int kLeastWidth = 480;
constexpr int kMostScale = 8;
constexpr double kLongestArrow = 0.25;  // of the least width
constexpr double kMostArrow_px_per_N = 200.0;
constexpr double kShortestArrow_px = 6.0;  // shorter ones would be hidden by the cross
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
  cv::line(on, fine(from), fine(to), kDark, 4, cv::LINE_AA, kFraction);
  cv::line(on, fine(from), fine(to), colour, 2, cv::LINE_AA, kFraction);
}

/// The rims of a mask that is enlarged as the picture is. A bead before the contact makes a hole in it, which is no
/// rim.
void draw_mask_rim(cv::Mat& on, const cv::Mat& mask, const std::vector<cv::Point2d>& beads) {
  cv::Mat large;
  cv::resize(mask, large, on.size(), 0, 0, cv::INTER_NEAREST);
  std::vector<std::vector<cv::Point>> outlines;
  std::vector<cv::Vec4i> tree;
  cv::findContours(large, outlines, tree, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  std::vector<std::vector<cv::Point>> rims;
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    const bool hole = tree[i][3] >= 0;
    const bool of_bead = hole && std::any_of(beads.begin(), beads.end(), [&](const cv::Point2d& bead) {
                           return cv::pointPolygonTest(outlines[i], cv::Point2f(bead), false) >= 0.0;
                         });
    if (!of_bead) rims.push_back(outlines[i]);
  }
  cv::drawContours(on, rims, -1, kDark, 4);
  cv::drawContours(on, rims, -1, kRim, 2);
}

/// The gel's x and y at a point as directions in the picture; nothing where the camera doesn't see it.
std::optional<std::pair<cv::Point2d, cv::Point2d>> directions_at(const Eigen::Vector3d& point, const GelView& view) {
  constexpr double kStep_mm = 0.1;
  std::array<cv::Point2d, 2> along;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector3d step = kStep_mm * Eigen::Vector3d::Unit(axis);
    const auto before = view(point - step);
    const auto after = view(point + step);
    if (!before || !after) return std::nullopt;
    along[static_cast<std::size_t>(axis)] = *after - *before;
    const double length = cv::norm(along[static_cast<std::size_t>(axis)]);
    if (!(length > 0.0)) return std::nullopt;
    along[static_cast<std::size_t>(axis)] /= length;
  }
  return std::pair(along[0], along[1]);
}

}  // namespace

struct GelView::Parts {
  render::Scene layers;
  render::ReadyCamera camera;
};

GelView::GelView(const sim::DeviceSpec& device) {
  if (!device.camera) fail("device {}: has no camera", device.name);
  auto parts = std::make_shared<Parts>();
  parts->layers = sim::clear_layers(device);
  parts->camera = render::make_ready(sim::camera_of(*device.camera));
  parts_ = std::move(parts);
}

std::optional<cv::Point2d> GelView::operator()(const Eigen::Vector3d& point) const {
  const auto pixel = render::project_through_faces(parts_->layers, parts_->camera, point);
  if (!pixel || !pixel->allFinite()) return std::nullopt;
  return cv::Point2d(pixel->x(), pixel->y());
}

std::vector<std::pair<cv::Point2d, cv::Point2d>> contact_rim(const InspectedGel& gel, const GelView& view) {
  const auto touches = [&](int corner) { return gel.contact[static_cast<std::size_t>(corner)]; };
  const auto at = [&](int corner) -> const Eigen::Vector3d& { return gel.displaced[static_cast<std::size_t>(corner)]; };
  std::vector<std::pair<cv::Point2d, cv::Point2d>> rim;
  for (const std::array<int, 3>& corners : gel.triangles) {
    // Of a triangle's corners one differs from the other two, or none does.
    for (int k = 0; k < 3; ++k) {
      const int one = corners[k];
      const int next = corners[(k + 1) % 3];
      const int last = corners[(k + 2) % 3];
      if (touches(one) == touches(next) || touches(one) == touches(last)) continue;
      const auto from = view(0.5 * (at(one) + at(next)));
      const auto to = view(0.5 * (at(one) + at(last)));
      if (from && to) rim.emplace_back(*from, *to);
    }
  }
  return rim;
}

Eigen::Vector3d surface_point(const InspectedGel& gel, const Eigen::Vector2d& place) {
  for (const std::array<int, 3>& corners : gel.triangles) {
    const auto at = [&](int k) -> const Eigen::Vector3d& {
      return gel.displaced[static_cast<std::size_t>(corners[k])];
    };
    Eigen::Matrix2d sides;
    sides << (at(1) - at(0)).head<2>(), (at(2) - at(0)).head<2>();
    if (std::abs(sides.determinant()) < 1e-12) continue;  // it stands upright
    const Eigen::Vector2d weights = sides.inverse() * (place - at(0).head<2>());
    constexpr double kRounding = 1e-9;
    if (weights.minCoeff() < -kRounding || weights.sum() > 1.0 + kRounding) continue;
    const double z = (1.0 - weights.sum()) * at(0).z() + weights.x() * at(1).z() + weights.y() * at(2).z();
    return {place.x(), place.y(), z};
  }
  return {place.x(), place.y(), 0.0};
}

double arrow_scale_px_per_N(const std::vector<InspectedSample>& samples) {
  double largest = 0.0;
  for (const InspectedSample& sample : samples) largest = std::max(largest, sample.wrench.head<2>().norm());
  return largest > 0.0 ? std::min(kMostArrow_px_per_N, kLongestArrow * kLeastWidth / largest) : kMostArrow_px_per_N;
}

cv::Mat draw_truth(const cv::Mat& picture, const InspectedSample& sample, const InspectedGel& gel,
                   const std::optional<GelView>& view, const cv::Mat& contact, double arrow_px_per_N) {
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

  std::vector<cv::Point2d> beads;
  if (view) {
    for (const Eigen::Vector3d& bead : gel.beads) {
      if (const auto at = (*view)(bead)) beads.push_back(shown(*at));
    }
  }
  if (!contact.empty() && contact.size() == picture.size()) {
    draw_mask_rim(drawn, contact, beads);
  } else if (view) {
    const auto rim = contact_rim(gel, *view);
    // All of the dark line first: segments don't cover one another's colour.
    for (const auto& [from, to] : rim)
      cv::line(drawn, fine(shown(from)), fine(shown(to)), kDark, 4, cv::LINE_AA, kFraction);
    for (const auto& [from, to] : rim)
      cv::line(drawn, fine(shown(from)), fine(shown(to)), kRim, 2, cv::LINE_AA, kFraction);
  }
  for (const cv::Point2d& bead : beads) {
    cv::circle(drawn, fine(bead), 5 << kFraction, kDark, 4, cv::LINE_AA, kFraction);
    cv::circle(drawn, fine(bead), 5 << kFraction, kBead, 2, cv::LINE_AA, kFraction);
  }
  const Eigen::Vector3d force = sample.wrench.head<3>();
  if (view) {
    const Eigen::Vector3d place = surface_point(gel, sample.gel_from_object.translation.head<2>());
    if (const auto at = (*view)(place)) {
      const cv::Point2d foot = shown(*at);
      outlined(drawn, foot - cv::Point2d(6, 0), foot + cv::Point2d(6, 0), kForce);
      outlined(drawn, foot - cv::Point2d(0, 6), foot + cv::Point2d(0, 6), kForce);
      if (const auto along = directions_at(place, *view)) {
        const cv::Point2d arrow = arrow_px_per_N * (force.x() * along->first + force.y() * along->second);
        if (cv::norm(arrow) > kShortestArrow_px) {
          cv::arrowedLine(drawn, foot, foot + arrow, kDark, 5, cv::LINE_AA);
          cv::arrowedLine(drawn, foot, foot + arrow, kForce, 3, cv::LINE_AA);
        }
      }
    }
  }
  const std::string words = fmt::format("{:.2f} {:.2f} {:.2f} N", force.x(), force.y(), force.z());
  const cv::Point corner(8, drawn.rows - 10);
  cv::putText(drawn, words, corner, cv::FONT_HERSHEY_SIMPLEX, 0.6, kDark, 4, cv::LINE_AA);
  cv::putText(drawn, words, corner, cv::FONT_HERSHEY_SIMPLEX, 0.6, {255, 255, 255}, 1, cv::LINE_AA);
  return drawn;
}

}  // namespace touchstone::datasets
