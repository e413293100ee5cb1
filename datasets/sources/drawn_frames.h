#pragma once
// The frames of a data set that was drawn (docs/datasets.md), from its blocks.

#include <filesystem>
#include <optional>
#include <vector>

#include "datasets/sources/frame_source.h"

namespace touchstone::datasets {

/// A stream for each unit that has samples of `split`, or all of them: frames in the order of the samples, whose number
/// and force they have; they are presses by themselves, without times. The picture at rest is the unit's background.
/// @throws Error if it isn't a finished data set that was drawn, has no frames, or no sample of this split
std::vector<FrameStream> drawn_streams(const std::filesystem::path& folder, std::optional<Split> split);

}  // namespace touchstone::datasets
