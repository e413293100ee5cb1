#include "sensors/markers/marker_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

constexpr double kNeighbourReach = 1.6;  ///< of the spacing: the eight round a marker of a square grid
constexpr double kAreaLearning = 0.05;   ///< how fast a marker's usual area follows the measured one, a frame
constexpr double kRestSpread =
    2.5;  ///< of markers' areas at rest, up and down; chosen after a real board with one faint dot
constexpr double kAtRest = 0.1;  ///< of the spacing
constexpr std::size_t kLeastNeighbours = 3, kMostNeighbours = 12;
constexpr double kFarthest = 1.5;  ///< of the median spacing: a marker that stands alone isn't searched for farther off
constexpr double kStray = 0.6;  ///< of the distance to the nearest neighbour: off the median of the neighbours' motion
constexpr double kClearlyLess = 0.7;  ///< of the misfit: only then markers are expected to go on as they went
constexpr double kMostSteps = 4.0;    ///< of the last step, where frames were dropped

/// The nearest of `places` to `from`, -1 if there's none.
template <typename Places, typename PlaceOf>
int nearest(const Places& places, PlaceOf place_of, const Eigen::Vector2d& from) {
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double distance = (place_of(places[i]) - from).squaredNorm();
    if (distance < least) {
      least = distance;
      best = static_cast<int>(i);
    }
  }
  return best;
}

const Eigen::Vector2d& place_of_blob(const MarkerBlob& blob) {
  return blob.centroid;
}
const Eigen::Vector2d& itself(const Eigen::Vector2d& place) {
  return place;
}

bool holds(const MarkerBlob& blob, const Eigen::Vector2d& place) {
  return place.x() >= blob.left - 1 && place.x() <= blob.right + 2 && place.y() >= blob.top - 1 &&
         place.y() <= blob.bottom + 2;
}

}  // namespace

const char* name_of(MarkerStatus status) {
  switch (status) {
    case MarkerStatus::kFound:
      return "found";
    case MarkerStatus::kFoundAgain:
      return "found again";
    case MarkerStatus::kHidden:
      return "hidden";
    case MarkerStatus::kMerged:
      return "merged";
    case MarkerStatus::kAtBorder:
      return "at border";
    case MarkerStatus::kTooFar:
      return "too far";
    case MarkerStatus::kStray:
      return "stray";
  }
  return "?";
}

int TrackedMarkers::found() const {
  return static_cast<int>(std::count_if(status.begin(), status.end(), [](MarkerStatus one) { return is_found(one); }));
}

MarkerTracker::MarkerTracker(const MarkerTrackerSettings& settings) : settings_(settings) {
  if (settings.appearance) MarkerFinder{*settings.appearance};  // which checks it
  if (!(settings.longest_step >= 0.05 && settings.longest_step <= 0.5)) {
    fail("marker longest_step is {}, it must be from 0.05 to 0.5 of the spacing", settings.longest_step);
  }
  if (!(settings.max_area_change > 1.0) || !std::isfinite(settings.max_area_change)) {
    fail("marker max_area_change is {}, it must be above 1", settings.max_area_change);
  }
  nearest_marker_.reserve(MarkerFinder::kMostBlobs);
  claimed_.reserve(MarkerFinder::kMostBlobs);
}

const TrackedMarkers& MarkerTracker::track(const Frame& frame) {
  const bool first = result_.rest.empty();
  if (!first && frame.t_us <= result_.t_us) {
    fail("markers: the frame's time {} us isn't after the last one's, {} us", frame.t_us, result_.t_us);
  }
  if (first) {
    MarkerFinder finder(settings_.appearance ? *settings_.appearance : learn_appearance(frame.image));
    const std::vector<MarkerBlob>& blobs = finder.find(frame.image);
    if (finder.light() != FrameLight::kNormal) fail("markers: the frame at rest is {}", name_of(finder.light()));
    begin(blobs);
    finder_ = std::move(finder);
    seen_us_ = static_cast<double>(frame.t_us);
    step_us_ = 0.0;
  } else {
    const std::vector<MarkerBlob>& blobs = finder_->find(frame.image);
    if (finder_->light() == FrameLight::kNormal) {
      follow(blobs, frame.t_us);
    } else {
      std::fill(result_.status.begin(), result_.status.end(), MarkerStatus::kHidden);
      std::fill(result_.area_px.begin(), result_.area_px.end(), 0);
      result_.unclaimed = 0;
    }
  }
  result_.light = finder_->light();
  result_.t_us = frame.t_us;
  return result_;
}

void MarkerTracker::begin(const std::vector<MarkerBlob>& blobs) {
  // A blob much larger or smaller than most, or a long one, is none of the markers.
  std::vector<int> areas;
  for (const MarkerBlob& blob : blobs) {
    if (!blob.at_border) areas.push_back(blob.area_px);
  }
  double usual = 0.0;
  if (!areas.empty()) {
    const auto middle = areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2);
    std::nth_element(areas.begin(), middle, areas.end());
    usual = *middle;
  }
  std::vector<Eigen::Vector2d> rest;
  std::vector<double> usual_area;
  std::vector<int> area_px;
  for (const MarkerBlob& blob : blobs) {
    const bool is_marker =
        blob.area_px <= kRestSpread * usual && blob.area_px * kRestSpread >= usual && is_compact(blob);
    if (blob.at_border || !is_marker) continue;
    rest.push_back(blob.centroid);
    usual_area.push_back(blob.area_px);
    area_px.push_back(blob.area_px);
  }
  if (static_cast<int>(rest.size()) < kLeastMarkers) {
    fail("markers: the frame at rest shows {} of them, at least {} are needed", rest.size(), kLeastMarkers);
  }

  std::vector<std::vector<std::pair<double, int>>> others(rest.size());  // nearest first
  std::vector<double> distances;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    for (std::size_t j = 0; j < rest.size(); ++j) {
      if (i != j) others[i].emplace_back((rest[i] - rest[j]).norm(), static_cast<int>(j));
    }
    const std::size_t nearest_ones = std::min(kMostNeighbours, others[i].size());
    std::partial_sort(others[i].begin(), others[i].begin() + static_cast<std::ptrdiff_t>(nearest_ones),
                      others[i].end());
    others[i].resize(nearest_ones);
    distances.push_back(others[i].front().first);
  }
  std::vector<double> sorted = distances;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  spacing_px_ = *middle;
  for (double& distance : distances) distance = std::min(distance, kFarthest * spacing_px_);
  distance_px_ = std::move(distances);

  neighbours_.clear();
  neighbour_begin_.assign(1, 0);
  for (const auto& near : others) {
    for (std::size_t k = 0; k < near.size(); ++k) {
      if (k < kLeastNeighbours || near[k].first <= kNeighbourReach * spacing_px_) {
        neighbours_.push_back(near[k].second);
      }
    }
    neighbour_begin_.push_back(static_cast<int>(neighbours_.size()));
  }
  result_ = {};
  result_.rest = std::move(rest);
  result_.positions = result_.rest;
  result_.status.assign(result_.rest.size(), MarkerStatus::kFound);
  result_.area_px = std::move(area_px);
  usual_area_ = std::move(usual_area);
  expected_ = result_.rest;
  before_ = result_.rest;
  step_.assign(result_.rest.size(), Eigen::Vector2d::Zero());
  nearest_blob_.assign(result_.rest.size(), -1);
  found_.assign(result_.rest.size(), 1);
  triples_ = opposite_neighbours(result_.rest, spacing_px_);
  strays_.clear();
  strays_.reserve(result_.rest.size());
}

bool MarkerTracker::is_at_rest(const std::vector<MarkerBlob>& blobs) {
  const double reach = kAtRest * spacing_px_;
  return std::all_of(result_.rest.begin(), result_.rest.end(), [&](const Eigen::Vector2d& home) {
    const int blob = nearest(blobs, place_of_blob, home);
    return blob >= 0 && (blobs[static_cast<std::size_t>(blob)].centroid - home).norm() <= reach;
  });
}

Eigen::Vector2d MarkerTracker::carried_by_neighbours(std::size_t marker) const {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int found = 0;
  for (int i = neighbour_begin_[marker]; i < neighbour_begin_[marker + 1]; ++i) {
    const auto other = static_cast<std::size_t>(neighbours_[static_cast<std::size_t>(i)]);
    if (!is_found(result_.status[other])) continue;
    sum += result_.displacement(other);
    ++found;
  }
  if (found == 0) return result_.positions[marker];
  return result_.rest[marker] + sum / found;
}

/// How badly blobs fit markers that were found and have gone on by so many of their last steps.
double MarkerTracker::misfit(const std::vector<MarkerBlob>& blobs, double steps) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < result_.rest.size(); ++i) {
    if (!is_found(result_.status[i])) continue;
    const Eigen::Vector2d place = result_.positions[i] + steps * step_[i];
    const int blob = nearest(blobs, place_of_blob, place);
    const double most = settings_.longest_step * distance_px_[i];
    const double off = blob < 0 ? most : (blobs[static_cast<std::size_t>(blob)].centroid - place).norm();
    sum += std::min(off * off, most * most);
  }
  return sum;
}

void MarkerTracker::predict(const std::vector<MarkerBlob>& blobs, std::int64_t t_us) {
  double steps = 0.0;
  if (step_us_ > 0.0) {
    const double standing = misfit(blobs, 0.0);
    double least = kClearlyLess * standing;
    // By the clock more than one step may have passed since the last frame with light.
    const double passed = (static_cast<double>(t_us) - seen_us_) / step_us_;
    for (const double tried : {1.0, std::clamp(passed, 1.0, kMostSteps)}) {
      const double moving = misfit(blobs, tried);
      if (moving < least) {
        least = moving;
        steps = tried;
      }
    }
  }
  for (std::size_t i = 0; i < expected_.size(); ++i) {
    expected_[i] = (is_found(result_.status[i]) ? result_.positions[i] : carried_by_neighbours(i)) + steps * step_[i];
  }
}

void MarkerTracker::follow(const std::vector<MarkerBlob>& blobs, std::int64_t t_us) {
  if (result_.jumped && is_at_rest(blobs)) {
    expected_ = result_.rest;
    result_.jumped = false;
  } else {
    predict(blobs, t_us);
  }
  match(blobs);
  reject_strays();
  for (std::size_t i = 0; i < result_.rest.size(); ++i) {
    if (!is_found(result_.status[i])) result_.positions[i] = carried_by_neighbours(i);
  }
  note_steps(t_us);
  doubt_rest();
}

void MarkerTracker::doubt_rest() {
  for (std::size_t i = 0; i < found_.size(); ++i) found_[i] = is_found(result_.status[i]) ? 1 : 0;
  result_.rest_doubt = rest_doubt(triples_, result_.rest, result_.positions, found_);
  result_.rest_was_touched |= !result_.jumped && result_.rest_doubt.rest_was_touched();
}

void MarkerTracker::match(const std::vector<MarkerBlob>& blobs) {
  const std::size_t markers = result_.rest.size();
  for (std::size_t i = 0; i < markers; ++i) nearest_blob_[i] = nearest(blobs, place_of_blob, expected_[i]);
  nearest_marker_.resize(blobs.size());
  claimed_.assign(blobs.size(), 0);
  for (std::size_t b = 0; b < blobs.size(); ++b) nearest_marker_[b] = nearest(expected_, itself, blobs[b].centroid);

  for (std::size_t i = 0; i < markers; ++i) {
    const bool was_found = is_found(result_.status[i]);
    MarkerStatus& status = result_.status[i];
    result_.area_px[i] = 0;
    status = MarkerStatus::kHidden;
    const int index = nearest_blob_[i];
    if (index < 0) continue;  // the picture has no blob at all
    const MarkerBlob& blob = blobs[static_cast<std::size_t>(index)];
    const bool mutual = nearest_marker_[static_cast<std::size_t>(index)] == static_cast<int>(i);
    const bool is_large = blob.area_px > settings_.max_area_change * usual_area_[i];
    if (is_large && (mutual || holds(blob, expected_[i]))) {
      status = MarkerStatus::kMerged;
    } else if (mutual && (blob.centroid - expected_[i]).norm() <= settings_.longest_step * distance_px_[i]) {
      claimed_[static_cast<std::size_t>(index)] = 1;
      if (blob.at_border) {
        status = MarkerStatus::kAtBorder;
      } else if (blob.area_px * settings_.max_area_change >= usual_area_[i]) {
        status = was_found ? MarkerStatus::kFound : MarkerStatus::kFoundAgain;
        result_.positions[i] = blob.centroid;
        result_.area_px[i] = blob.area_px;
        usual_area_[i] += kAreaLearning * (blob.area_px - usual_area_[i]);
      }
    }
  }

  // Blobs as large as a marker that nobody claims: come into view, or gone too far from where they were.
  result_.unclaimed = 0;
  for (std::size_t b = 0; b < blobs.size(); ++b) {
    if (claimed_[b] != 0 || blobs[b].at_border) continue;
    const auto marker = static_cast<std::size_t>(nearest_marker_[b]);
    const bool is_whole = blobs[b].area_px <= settings_.max_area_change * usual_area_[marker] &&
                          blobs[b].area_px * settings_.max_area_change >= usual_area_[marker];
    if (!is_whole) continue;
    ++result_.unclaimed;
    if (result_.status[marker] == MarkerStatus::kHidden &&
        (blobs[b].centroid - expected_[marker]).norm() <= spacing_px_) {
      result_.status[marker] = MarkerStatus::kTooFar;
      result_.jumped = true;
    }
  }
}

void MarkerTracker::reject_strays() {
  strays_.clear();
  for (std::size_t i = 0; i < result_.rest.size(); ++i) {
    if (!is_found(result_.status[i])) continue;
    std::array<double, kMostNeighbours> x{}, y{};
    std::size_t count = 0;
    for (int n = neighbour_begin_[i]; n < neighbour_begin_[i + 1]; ++n) {
      const auto other = static_cast<std::size_t>(neighbours_[static_cast<std::size_t>(n)]);
      if (!is_found(result_.status[other])) continue;
      const Eigen::Vector2d moved = result_.displacement(other);
      x[count] = moved.x();
      y[count++] = moved.y();
    }
    if (count < kLeastNeighbours) continue;
    const auto middle = static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(x.begin(), x.begin() + middle, x.begin() + static_cast<std::ptrdiff_t>(count));
    std::nth_element(y.begin(), y.begin() + middle, y.begin() + static_cast<std::ptrdiff_t>(count));
    const Eigen::Vector2d usual(x[count / 2], y[count / 2]);
    if ((result_.displacement(i) - usual).norm() > kStray * distance_px_[i]) strays_.push_back(static_cast<int>(i));
  }
  for (const int stray : strays_) {  // only now: each was judged by all that were found
    result_.status[static_cast<std::size_t>(stray)] = MarkerStatus::kStray;
    result_.area_px[static_cast<std::size_t>(stray)] = 0;
  }
}

void MarkerTracker::note_steps(std::int64_t t_us) {
  for (std::size_t i = 0; i < before_.size(); ++i) {
    step_[i] = result_.positions[i] - before_[i];
    before_[i] = result_.positions[i];
  }
  step_us_ = static_cast<double>(t_us) - seen_us_;
  seen_us_ = static_cast<double>(t_us);
}

}  // namespace touchstone::sensors
