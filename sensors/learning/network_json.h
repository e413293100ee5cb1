#pragma once
// Networks and ranges within model files. For the .cpp files of models only, as json_field.h.

#include "sensors/learning/feed_forward_network.h"
#include "sensors/learning/range_scaling.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {

/// {"sigmoid": ..., "layers": [{"weights": [[...], ...], "biases": [...]}, ...]}
Json json_of(const FeedForwardNetwork& network);
/// @throws Error naming file and field for what doesn't fit; whether layers fit each other is checked by fault_of()
FeedForwardNetwork network_of(const JsonField& field);

/// {"low": [...], "high": [...]}
Json json_of(const RangeScaling& scaling);
/// @throws Error naming file and field for what doesn't fit; whether it's sound is checked by is_sound()
RangeScaling range_scaling_of(const JsonField& field);

}  // namespace touchstone::sensors
