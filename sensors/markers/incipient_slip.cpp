#include "sensors/markers/incipient_slip.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// Terms of the field: translation (2), turn, swelling, lag (2).
constexpr int kTerms = 6;
/// How much less a surface lags along the motion than across it ([Johnson1985, eq. 3.91], for a Poisson's ratio of 1/2:
/// 2.5 x^2 + 3.5 y^2 along, -x y across).
constexpr double kAlong = 2.0 / 7.0;
/// A patch slides over the markers while they move by less than this part of its own motion against them. While they
/// move more it carries them, and is ahead of their mean by what the rim lags.
constexpr double kCarried = 0.5;
/// A mask that covers less of its patch is the rim of a flat end. Now this part of a rim is seen and now that, and the
/// patch's middle wanders with them: it tells no sliding.
constexpr double kLeastCover = 0.15;
/// Below this part of its largest one, a pivot says that the markers' places can't separate the terms.
constexpr double kLeastPivot = 1e-6;

/// Markers out of the patch aren't held by the object.
bool is_on(const ContactPatch& patch, const Eigen::Vector2d& place) {
  return patch.reach_squared(place) <= 1.0;
}

/// The patch shrunk about its centre.
ContactPatch inner_part(ContactPatch patch, double part) {
  patch.edge /= part * part;
  patch.area_px *= part * part;
  return patch;
}

void check(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    fail("incipient slip: {} is {}, it must be from {} to {}", name, value, low, high);
}

}  // namespace

const char* name_of(SlipState state) {
  switch (state) {
    case SlipState::kNoContact:
      return "no contact";
    case SlipState::kSticking:
      return "sticking";
    case SlipState::kIncipient:
      return "incipient";
    case SlipState::kSliding:
      return "sliding";
  }
  return "?";
}

IncipientSlipDetector::IncipientSlipDetector(const IncipientSlipSettings& settings) : settings_(settings) {
  check("history_frames", settings.history_frames, 2, 1000);
  check("least_motion_px", settings.least_motion_px, 1e-3, 1e3);
  check("patch_part", settings.patch_part, 0.2, 1.0);
  check("least_markers", settings.least_markers, 6, 1e6);
  check("lag_threshold", settings.lag_threshold, 0.0, 2.0);
  check("certainty", settings.certainty, 0.0, 10.0);
  check("slide_px", settings.slide_px, 1e-3, 1e3);
  check("least_shear_px", settings.least_shear_px, 0.0, 1e3);
  past_.resize(static_cast<std::size_t>(settings.history_frames));
}

const IncipientSlipDetector::Past& IncipientSlipDetector::back(int frames) const {
  const int size = settings_.history_frames;
  return past_[static_cast<std::size_t>((newest_ + 1 - frames + size) % size)];
}

bool IncipientSlipDetector::fit_lag(const TrackedMarkers& markers, const ContactPatch& patch, const Past& past) {
  Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Eigen::Matrix<double, kTerms, 1> right = Eigen::Matrix<double, kTerms, 1>::Zero();
  const double scale = 1.0 / std::sqrt(std::max(patch.area_px, 1.0));
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(patch.edge);
  const Eigen::Matrix2d to_unit = axes.operatorSqrt();  // the patch becomes the unit circle
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    const Eigen::Vector2d& place = markers.positions[i];
    if (!is_found(markers.status[i]) || past.found[i] == 0 || !is_on(patch, place)) continue;
    const Eigen::Vector2d x = scale * (place - patch.centre);
    const Eigen::Vector2d z = to_unit * (place - patch.centre);
    const Eigen::Matrix2d lag = z.squaredNorm() * Eigen::Matrix2d::Identity() - kAlong * z * z.transpose();
    const Eigen::Vector2d u = markers.displacement(i) - past.displacement[i];
    Eigen::Matrix<double, 2, kTerms> terms;
    terms << 1, 0, -x.y(), x.x(), -lag(0, 0), -lag(0, 1),  //
        0, 1, x.x(), x.y(), -lag(1, 0), -lag(1, 1);
    normal += terms.transpose() * terms;
    right += terms.transpose() * u;
    squares += u.squaredNorm();
    ++count;
  }
  result_.markers = count;
  if (count < settings_.least_markers) return false;
  const Eigen::LDLT<Eigen::Matrix<double, kTerms, kTerms>> factor(normal);
  const auto pivots = factor.vectorD();
  if (!(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return false;
  const Eigen::Matrix<double, kTerms, 1> field = factor.solve(right);
  const Eigen::Vector2d middle = field.head<2>();
  result_.motion_px = middle.norm();
  if (!(result_.motion_px >= settings_.least_motion_px)) return false;

  const Eigen::Vector2d along = middle / result_.motion_px;
  const double left_over = std::max(squares - field.dot(right), 0.0) / (2 * count - kTerms);
  Eigen::Matrix<double, kTerms, 1> lag_along = Eigen::Matrix<double, kTerms, 1>::Zero();
  lag_along.tail<2>() = along;
  result_.lag = field.tail<2>().dot(along) / result_.motion_px;
  result_.lag_error = std::sqrt(left_over * lag_along.dot(factor.solve(lag_along))) / result_.motion_px;
  return true;
}

void IncipientSlipDetector::find_lag(const TrackedMarkers& markers, const ContactPatch& patch) {
  // The fewest frames back that show enough motion: what slipped long ago has no say.
  for (int frames = 1; frames <= kept_; ++frames) {
    result_.frames = frames;
    if (fit_lag(markers, patch, back(frames))) return;
  }
}

void IncipientSlipDetector::find_slide(const TrackedMarkers& markers, const ContactPatch& patch) {
  const PatchMotion now = patch_motion(markers, patch);
  result_.shear_px = now.px.norm();
  if (!(result_.shear_px > 0.0) || patch.cover() < kLeastCover) return;
  const Eigen::Vector2d ahead = now.px / result_.shear_px;
  for (int frames = 1; frames <= kept_; ++frames) {
    const Past& past = back(frames);
    Eigen::Vector2d motion = Eigen::Vector2d::Zero();
    int count = 0;
    for (std::size_t i = 0; i < markers.rest.size(); ++i) {
      if (!is_found(markers.status[i]) || past.found[i] == 0 || !is_on(patch, markers.positions[i])) continue;
      motion += markers.displacement(i) - past.displacement[i];
      ++count;
    }
    if (count < settings_.least_markers) continue;
    motion /= count;
    const double slide = (patch.centre - past.patch_centre - motion).dot(ahead);
    if (motion.norm() <= kCarried * slide) result_.slide_px = std::max(result_.slide_px, slide);
  }
}

void IncipientSlipDetector::remember(const TrackedMarkers& markers, const ContactPatch& patch) {
  newest_ = (newest_ + 1) % settings_.history_frames;
  kept_ = std::min(kept_ + 1, settings_.history_frames);
  Past& past = past_[static_cast<std::size_t>(newest_)];
  past.patch_centre = patch.centre;
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    past.displacement[i] = markers.displacement(i);
    past.found[i] = is_found(markers.status[i]) ? 1 : 0;
  }
}

const IncipientSlip& IncipientSlipDetector::update(const TrackedMarkers& markers,
                                                   const std::optional<ContactPatch>& patch) {
  result_ = {};
  if (past_.front().found.size() != markers.rest.size()) {
    kept_ = 0;
    for (Past& past : past_) {
      past.displacement.resize(markers.rest.size());
      past.found.resize(markers.rest.size());
    }
  }
  if (!patch || markers.jumped) {
    kept_ = 0;
    if (patch) result_.state = SlipState::kSticking;
    return result_;
  }
  result_.state = SlipState::kSticking;
  const ContactPatch held = inner_part(*patch, settings_.patch_part);
  find_lag(markers, held);
  find_slide(markers, held);
  if (result_.slide_px >= settings_.slide_px && result_.shear_px >= settings_.least_shear_px) {
    result_.state = SlipState::kSliding;
  } else if (result_.lag && *result_.lag - settings_.certainty * result_.lag_error >= settings_.lag_threshold) {
    result_.state = SlipState::kIncipient;
  }
  remember(markers, held);
  return result_;
}

}  // namespace touchstone::sensors
