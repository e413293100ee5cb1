#pragma once
// The frames of a ball-press calibration of a gel that shows depth as darkness, on disk.

#include <filesystem>
#include <vector>

#include "lab/gelsight/ball_press_table.h"
#include "sensors/heights/darkness_press.h"

namespace touchstone::lab {

/// The mean of some pictures of the untouched gel, grey or in colour. @throws Error naming the picture that's unfit
sensors::RestPicture read_rest_picture(datasets::TableFrames& frames, const std::vector<std::filesystem::path>& files);

/// Reads the pictures of a table (read_ball_press_table); where no circle is given it is found.
/// @throws Error with the table's line: a picture that can't be read or is unfit, or a circle that isn't found
std::vector<sensors::BallPress> read_dark_presses(datasets::TableFrames& frames,
                                                  const std::vector<AnnotatedPress>& table,
                                                  const sensors::RestPicture& rest,
                                                  const sensors::DarkeningSettings& settings,
                                                  const sensors::PressScale& scale);

}  // namespace touchstone::lab
