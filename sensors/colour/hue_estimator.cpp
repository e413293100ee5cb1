#include "sensors/colour/hue_estimator.h"

#include "core/error.h"

namespace touchstone::sensors {

HueEstimator::HueEstimator(const HueModel& model, const ColourMarkerReading& rest) : model_(model), rest_(rest) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("hue model: {}", fault);
  map_ = map_of_rest(rest, model.spacing_mm);
  places_ = grid_places(rest.grid, model.spacing_mm);
  gains_.resize(places_.size());
  for (const MarkerGain& gain : model.gains) {
    if (gain.marker >= static_cast<std::int64_t>(gains_.size())) {
      fail("hue model: it has gains for marker {}, the grid has {} markers", gain.marker, gains_.size());
    }
    gains_[static_cast<std::size_t>(gain.marker)] = gain;
  }
  terms_ = terms_of(model);
}

HueEstimate HueEstimator::estimate(std::size_t marker, const ColourMarker& seen) const {
  TS_ASSERT(marker < places_.size());
  HueEstimate out;
  if (seen.flaw != MarkerFlaw::kNone || rest_.markers[marker].flaw != MarkerFlaw::kNone) return out;
  MarkerChange change = change_of(seen, rest_.markers[marker], map_);
  if (!features_of(model_).of_surroundings()) change.forget_surroundings();
  const SeenDisplacement displacement = displacement_of(model_, terms_, change);
  if (!displacement.determined) return out;
  const double press = gains_[marker].press * displacement.press_mm;
  out.displacement_mm.head<2>() =
      model_.parallax.true_one(gains_[marker].lateral * displacement.lateral_mm, press, places_[marker]);
  out.displacement_mm.z() = -press;
  out.measured = out.displacement_mm.allFinite();
  out.extrapolated = out.measured && is_beyond(model_.range, change);
  return out;
}

HueField HueEstimator::estimate(const ColourMarkerReading& reading) const {
  if (reading.grid != rest_.grid || reading.markers.size() != rest_.markers.size()) {
    fail("hue model: the reading has a grid of {} x {}, the one at rest {} x {}", reading.grid.x(), reading.grid.y(),
         rest_.grid.x(), rest_.grid.y());
  }
  HueField out;
  out.field.grid = reading.grid;
  for (std::size_t i = 0; i < reading.markers.size(); ++i) {
    const HueEstimate one = estimate(i, reading.markers[i]);
    out.field.displacement.push_back(one.displacement_mm);
    out.field.measured.push_back(one.measured ? 1 : 0);
    out.extrapolated.push_back(one.extrapolated ? 1 : 0);
  }
  return out;
}

}  // namespace touchstone::sensors
