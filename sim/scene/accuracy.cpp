#include "sim/scene/accuracy.h"

namespace touchstone::sim {

void fields(YamlReader& in, AccuracySpec& accuracy) {
  accuracy.where = in.where();
  in.optional("force_percent", accuracy.force_percent, Allowed::above_up_to(0.0, 100.0));
  in.optional("pixel_noise", accuracy.pixel_noise, Allowed::above_up_to(0.0, 1e4));
  in.optional("marker_px", accuracy.marker_px, Allowed::above_up_to(0.0, 1e3));
  in.optional("height_um", accuracy.height_um, Allowed::above_up_to(0.0, 1e4));
  in.optional("event_percent", accuracy.event_percent, Allowed::above_up_to(0.0, 1e4));
}

std::optional<AccuracySpec> merged(const std::optional<AccuracySpec>& first,
                                   const std::optional<AccuracySpec>& second) {
  if (!first || !second) return first ? first : second;
  AccuracySpec both = *first;
  for (const auto one : {&AccuracySpec::force_percent, &AccuracySpec::pixel_noise, &AccuracySpec::marker_px,
                         &AccuracySpec::height_um, &AccuracySpec::event_percent}) {
    if (!(both.*one)) both.*one = (*second).*one;
  }
  return both;
}

std::optional<Accuracy> accuracy_of(const std::optional<AccuracySpec>& first,
                                    const std::optional<AccuracySpec>& second) {
  const std::optional<AccuracySpec> spec = merged(first, second);
  if (!spec) return std::nullopt;
  const Accuracy usual;
  return Accuracy{spec->force_percent.value_or(usual.force_percent), spec->pixel_noise.value_or(usual.pixel_noise),
                  spec->marker_px.value_or(usual.marker_px), spec->height_um.value_or(usual.height_um),
                  spec->event_percent.value_or(usual.event_percent)};
}

}  // namespace touchstone::sim
