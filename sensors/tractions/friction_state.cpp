#include "sensors/tractions/friction_state.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

/// Of the markers that are wholly in contact, this part is taken for the object: those that went furthest.
constexpr double kObjectPart = 1.0 / 3.0;
constexpr int kLeastObjectMarkers = 2;
/// The contact slides over markers that move by less than this part of its own motion.
constexpr double kCarried = 0.5;
/// While the ratio of shear to normal force changes by more than this over the frames looked at, some of it sticks.
constexpr double kStillChanging = 0.1;
constexpr int kLeastSlideFrames = 4;
/// Frames that slide have errors in common (the map's, the contact's): their mean isn't better than a frame's by more.
constexpr double kCommonError = 0.02;  // relative

void check(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high)) fail("friction: {} is {}, it must be from {} to {}", name, value, low, high);
}

/// Of |q|/p, by what its two parts are uncertain.
double error_of_ratio(const Eigen::Vector2d& q, double p, const Eigen::Matrix3d& covariance) {
  const double shear = q.norm();
  const Eigen::Vector2d along = shear > 0.0 ? Eigen::Vector2d(q / shear) : Eigen::Vector2d(1.0, 0.0);
  // The ratio's slope in (q, t_z): p is -t_z.
  const Eigen::Vector3d slope(along.x() / p, along.y() / p, shear / (p * p));
  return std::sqrt(std::max(0.0, slope.dot(covariance * slope)));
}

}  // namespace

const char* name_of(MarkerSlip state) {
  switch (state) {
    case MarkerSlip::kNoContact:
      return "no contact";
    case MarkerSlip::kUnknown:
      return "unknown";
    case MarkerSlip::kStick:
      return "stick";
    case MarkerSlip::kSlip:
      return "slip";
  }
  return "?";
}

const char* name_of(ContactSlip state) {
  switch (state) {
    case ContactSlip::kNoContact:
      return "no contact";
    case ContactSlip::kUnknown:
      return "unknown";
    case ContactSlip::kSticking:
      return "sticking";
    case ContactSlip::kPartial:
      return "partial";
    case ContactSlip::kSliding:
      return "sliding";
  }
  return "?";
}

FrictionObserver::FrictionObserver(const FrictionSettings& settings) : settings_(settings) {
  constexpr double kTiny = 1e-9;
  check("lateral_noise_mm", settings.lateral_noise_mm, kTiny, 10.0);
  check("history_frames", settings.history_frames, kLeastSlideFrames, 1000);
  check("least_motion_mm", settings.least_motion_mm, kTiny, 100.0);
  check("whole_contact", settings.whole_contact, 0.3, 1.0);
  check("lag", settings.lag, kTiny, 1.0 - kTiny);
  check("saturation", settings.saturation, kTiny, 1.0 - kTiny);
  check("certainty", settings.certainty, 0.0, 10.0);
  check("slide_mm", settings.slide_mm, kTiny, 100.0);
}

void FrictionObserver::restart() {
  past_.clear();
  result_ = {};
  slid_.clear();
}

const FrictionState& FrictionObserver::update(const MarkerField& field, const TractionField& tractions) {
  const std::size_t count = field.displacement.size();
  if (field.measured.size() != count || tractions.markers.size() != count) {
    fail("friction: the field has {} markers, the tractions are of {}", count, tractions.markers.size());
  }
  if (!past_.empty() && past_.back().displacement.size() != count) {
    fail("friction: the field has {} markers, the one before had {}", count, past_.back().displacement.size());
  }
  if (!tractions.in_contact || tractions.wrench[2] <= 0.0) {
    restart();
    result_.markers.resize(count);
    return result_;
  }
  Past now;
  for (const Eigen::Vector3d& displacement : field.displacement) now.displacement.emplace_back(displacement.head<2>());
  now.measured = field.measured;
  now.centre = tractions.centre_of_pressure;
  past_.push_back(std::move(now));
  if (past_.size() > static_cast<std::size_t>(settings_.history_frames) + 1) past_.pop_front();

  result_.markers.resize(count);
  read_ratios(tractions);
  past_.back().ratio = result_.ratio;
  find_lags(tractions);
  find_slide(tractions);
  judge(tractions);
  read_friction();
  return result_;
}

void FrictionObserver::read_ratios(const TractionField& tractions) {
  for (std::size_t m = 0; m < result_.markers.size(); ++m) {
    MarkerFriction& marker = result_.markers[m];
    const MarkerTraction& of = tractions.markers[m];
    const Eigen::Vector2d q = of.traction.head<2>();
    marker.pressure = -of.traction.z();
    marker.shear = q.norm();
    marker.ratio = marker.ratio_error = 0.0;
    if (marker.pressure > 0.0) {
      marker.ratio = marker.shear / marker.pressure;
      marker.ratio_error = error_of_ratio(q, marker.pressure, of.covariance);
    }
    if (of.contact <= 0.0) {
      marker.state = MarkerSlip::kNoContact;
    } else if (marker.state == MarkerSlip::kNoContact || of.contact < settings_.whole_contact) {
      marker.state = MarkerSlip::kUnknown;
    }
  }
  const Eigen::Vector2d shear = tractions.wrench.head<2>();
  result_.ratio = shear.norm() / tractions.wrench[2];
  Eigen::Matrix3d covariance = tractions.uncertainty.topLeftCorner<3, 3>();
  covariance.col(2) *= -1.0;  // the force is against the traction, but along z it is the pressure's
  covariance.row(2) *= -1.0;
  result_.ratio_error = error_of_ratio(shear, tractions.wrench[2], covariance);
}

void FrictionObserver::find_lags(const TractionField& tractions) {
  for (MarkerFriction& marker : result_.markers) marker.lag.reset();
  result_.motion_mm = 0.0;
  const Past& now = past_.back();
  std::vector<std::size_t> whole;
  for (std::size_t m = 0; m < result_.markers.size(); ++m) {
    if (tractions.markers[m].contact >= settings_.whole_contact && now.measured[m]) whole.push_back(m);
  }
  std::vector<std::size_t> both;
  std::vector<double> along;
  for (std::size_t back = 1; back < past_.size(); ++back) {
    const Past& then = past_[past_.size() - 1 - back];
    both.clear();
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const std::size_t m : whole) {
      if (!then.measured[m]) continue;
      both.push_back(m);
      mean += now.displacement[m] - then.displacement[m];
    }
    if (both.size() <= kLeastObjectMarkers || mean.isZero(0.0)) continue;
    const Eigen::Vector2d direction = mean.normalized();
    along.clear();
    for (const std::size_t m : both) along.push_back((now.displacement[m] - then.displacement[m]).dot(direction));
    std::vector<double> furthest = along;
    std::sort(furthest.begin(), furthest.end(), std::greater<>());
    const auto object = std::max<std::size_t>(
        kLeastObjectMarkers, static_cast<std::size_t>(kObjectPart * static_cast<double>(furthest.size())));
    double motion = 0.0;
    for (std::size_t k = 0; k < object; ++k) motion += furthest[k] / static_cast<double>(object);
    if (motion < settings_.least_motion_mm) continue;
    result_.motion_mm = motion;
    for (std::size_t k = 0; k < both.size(); ++k) result_.markers[both[k]].lag = 1.0 - along[k] / motion;
    return;
  }
}

void FrictionObserver::find_slide(const TractionField& tractions) {
  result_.slide_mm = 0.0;
  const Past& now = past_.back();
  const Eigen::Vector2d shear = -tractions.wrench.head<2>();  // on the gel
  if (shear.isZero(0.0)) return;
  const Eigen::Vector2d direction = shear.normalized();
  for (std::size_t back = kLeastSlideFrames; back < past_.size(); ++back) {
    // The contact's motion by a line through its places, as a single one is noisy.
    const double middle = 0.5 * static_cast<double>(back);
    double sum = 0.0, ratios = 0.0, squares = 0.0, mean = 0.0;
    for (std::size_t k = 0; k <= back; ++k) {
      const double at = static_cast<double>(k) - middle;  // frames
      const Past& past = past_[past_.size() - 1 - back + k];
      sum += at * past.centre.dot(direction);
      ratios += at * past.ratio;
      mean += past.ratio / static_cast<double>(back + 1);
      squares += at * at;
    }
    const double moved = sum / squares * static_cast<double>(back);
    const double grown = ratios / squares * static_cast<double>(back);
    if (std::max(std::abs(grown), std::abs(now.ratio - mean)) > kStillChanging * mean) continue;
    const Past& then = past_[past_.size() - 1 - back];
    double carried = 0.0, weight = 0.0;
    for (std::size_t m = 0; m < result_.markers.size(); ++m) {
      if (!now.measured[m] || !then.measured[m] || result_.markers[m].pressure <= 0.0) continue;
      carried += result_.markers[m].pressure * (now.displacement[m] - then.displacement[m]).dot(direction);
      weight += result_.markers[m].pressure;
    }
    if (weight <= 0.0) continue;
    if (moved > result_.slide_mm && std::abs(carried / weight) < kCarried * moved) result_.slide_mm = moved;
  }
}

void FrictionObserver::judge(const TractionField& tractions) {
  if (result_.slide_mm >= settings_.slide_mm) {
    result_.state = ContactSlip::kSliding;
    for (std::size_t m = 0; m < result_.markers.size(); ++m) {
      if (tractions.markers[m].contact >= settings_.whole_contact) result_.markers[m].state = MarkerSlip::kSlip;
    }
    return;
  }
  // While nothing moves the contact and its markers keep what they were.
  if (result_.motion_mm <= 0.0) {
    if (result_.state == ContactSlip::kNoContact) result_.state = ContactSlip::kUnknown;
    const bool slid = result_.state == ContactSlip::kSliding && result_.friction;
    if (slid && result_.ratio < settings_.saturation * result_.friction->value) {
      result_.state = ContactSlip::kSticking;  // friction isn't used up any more: some of it sticks, whichever
      for (MarkerFriction& marker : result_.markers) {
        if (marker.state == MarkerSlip::kSlip) marker.state = MarkerSlip::kUnknown;
      }
    }
    return;
  }
  const double lag_error = std::sqrt(2.0) * settings_.lateral_noise_mm / result_.motion_mm;
  int sticking = 0, slipping = 0;
  for (MarkerFriction& marker : result_.markers) {
    if (!marker.lag) continue;
    // Lag, and the ratio where friction is known, on one scale: standard errors above what divides stick from slip.
    double evidence = (*marker.lag - settings_.lag) / lag_error;
    if (result_.friction && marker.ratio_error > 0.0) {
      const FrictionEstimate& friction = *result_.friction;
      const double error = std::hypot(marker.ratio_error, marker.ratio * friction.error / friction.value);
      evidence = (evidence + (marker.ratio - settings_.saturation * friction.value) / error) / std::sqrt(2.0);
    }
    marker.state = evidence > settings_.certainty    ? MarkerSlip::kSlip
                   : evidence < -settings_.certainty ? MarkerSlip::kStick
                                                     : MarkerSlip::kUnknown;
    sticking += marker.state == MarkerSlip::kStick;
    slipping += marker.state == MarkerSlip::kSlip;
  }
  if (slipping > 0) {
    result_.state = ContactSlip::kPartial;
  } else if (sticking > 0) {
    result_.state = ContactSlip::kSticking;
  } else {
    result_.state = ContactSlip::kUnknown;
  }
}

void FrictionObserver::read_friction() {
  if (result_.slide_mm >= settings_.slide_mm && result_.ratio_error > 0.0) {
    slid_.push_back({result_.ratio, result_.ratio_error});
    if (slid_.size() > static_cast<std::size_t>(settings_.history_frames)) slid_.pop_front();
    double weight = 0.0, sum = 0.0;
    for (const Slid& slid : slid_) {
      weight += 1.0 / (slid.error * slid.error);
      sum += slid.ratio / (slid.error * slid.error);
    }
    const double value = sum / weight;
    result_.friction = FrictionEstimate{value, std::hypot(1.0 / std::sqrt(weight), kCommonError * value), true};
    return;
  }
  if (!slid_.empty() || result_.state != ContactSlip::kPartial) return;  // what slid as a whole gave more
  double weight = 0.0, sum = 0.0;
  for (const MarkerFriction& marker : result_.markers) {
    if (marker.state != MarkerSlip::kSlip || !marker.lag || marker.ratio_error <= 0.0) continue;
    // Each by its pressure: the quotient of sums isn't drawn up by markers with little of it.
    weight += marker.pressure;
    sum += marker.shear;
  }
  if (weight <= 0.0) return;
  double square = 0.0;
  for (const MarkerFriction& marker : result_.markers) {
    if (marker.state != MarkerSlip::kSlip || !marker.lag || marker.ratio_error <= 0.0) continue;
    square += std::pow(marker.pressure * marker.ratio_error / weight, 2);
  }
  // Never below what the whole contact has held.
  const double value = std::max(sum / weight, result_.ratio);
  result_.friction = FrictionEstimate{value, std::hypot(std::sqrt(square), kCommonError * value), false};
}

}  // namespace touchstone::sensors
