#include "sensors/reflex/reflex_loop.h"

#include <cmath>
#include <utility>

#include "core/error.h"

namespace touchstone::sensors {

std::string name_of(ChipFault fault) {
  switch (fault) {
    case ChipFault::none:
      return "none";
    case ChipFault::impossible:
      return "impossible statistics";
    case ChipFault::dark:
      return "dark";
    case ChipFault::saturated:
      return "saturated";
    case ChipFault::flat:
      return "flat";
    case ChipFault::no_features:
      return "no features";
  }
  TS_ASSERT(false);
  return {};
}

ChipFault fault_of(const ChipStatistics& statistics, int flat_range) {
  constexpr int kWhite = 63;
  if (!is_possible(statistics)) return ChipFault::impossible;
  if (statistics.maximum == 0) return ChipFault::dark;
  if (statistics.minimum == kWhite) return ChipFault::saturated;
  if (statistics.maximum - statistics.minimum < flat_range) return ChipFault::flat;
  return statistics.squal == 0 ? ChipFault::no_features : ChipFault::none;
}

void check(const ReflexSettings& s) {
  if (!(s.stop_above_N >= 0.0) || !std::isfinite(s.stop_above_N)) {
    fail("stop_above_N is {}, it must be at least 0 and finite", s.stop_above_N);
  }
  if (s.stop_frames < 1) fail("stop_frames is {}, it must be at least 1", s.stop_frames);
  if (s.release_frames < 1) fail("release_frames is {}, it must be at least 1", s.release_frames);
  if (s.blind_frames < 1) fail("blind_frames is {}, it must be at least 1", s.blind_frames);
}

ReflexLoop::ReflexLoop(ReflexModel model, const ReflexSettings& settings)
    : model_(std::move(model)), settings_(settings), counts_(settings.release_frames) {
  check(settings_);
  if (const std::string fault = fault_of(model_); !fault.empty()) fail("reflex model: {}", fault);
}

ReflexDecision ReflexLoop::next(const ChipStatistics& statistics) {
  last_.fault = fault_of(statistics);
  if (last_.fault != ChipFault::none) {
    if (blind_ < settings_.blind_frames) ++blind_;
    if (settings_.stop_when_blind && blind_ >= settings_.blind_frames) last_.stop = true;
    return last_;
  }
  blind_ = 0;
  last_.force_present = force_present(model_.tree, statistics);
  last_.force_N = last_.force_present ? model_.force.force_N(statistics) : 0.0;
  const Eigen::Vector2d counts = counts_.next(statistics, last_.force_present);
  last_.shear_N.setZero();
  if (model_.shear && last_.force_present) last_.shear_N = model_.shear->force_N(counts, last_.force_N);
  const bool over = last_.force_present && (settings_.stop_above_N == 0.0 || last_.force_N > settings_.stop_above_N);
  above_ = over ? std::min(above_ + 1, settings_.stop_frames) : 0;
  if (above_ >= settings_.stop_frames) last_.stop = true;
  return last_;
}

void ReflexLoop::reset() {
  last_ = {};
  above_ = 0;
  blind_ = 0;
  counts_ = MotionCounts(settings_.release_frames);
}

}  // namespace touchstone::sensors
