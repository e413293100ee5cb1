#pragma once
// A finished drawn data set (docs/datasets.md) as inspection sees it: its sensors stand in the place of scenes.

#include "datasets/inspection/inspected_set.h"

namespace touchstone::datasets {

/// What a drawn set's blocks hold, for `set`, which knows its folder and its manifest's figures already.
/// @throws Error if a block can't be read
void read_drawn_samples(const Manifest& manifest, InspectedSet& set);

/// A sample's picture, BGR or grey, and 255 where what a pixel sees is in contact; empty if the set has none.
cv::Mat drawn_frame(const InspectedSet& set, std::size_t sample);
/// CV_8UC1, of the frame's size: 255 where the object touches what the pixel sees, else 0; empty if the set has none.
cv::Mat drawn_contact(const InspectedSet& set, std::size_t sample);

/// The part of the gel's surface that the camera sees, from the sample's height map: pressed in along z alone, which is
/// all that the set says. Empty if it has no heights or its device isn't known.
InspectedGel drawn_gel(const InspectedSet& set, std::size_t sample);

}  // namespace touchstone::datasets
