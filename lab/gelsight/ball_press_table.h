#pragma once
// The frames of a ball-press calibration on disk: pictures and a table that says what is pressed where.

#include <filesystem>
#include <optional>
#include <vector>

#include "core/error.h"
#include "datasets/sources/table_frames.h"
#include "sensors/heights/background.h"
#include "sensors/heights/ball_press.h"

namespace touchstone::lab {

/// One line of the table.
struct AnnotatedPress {
  std::filesystem::path file;
  std::optional<sensors::ContactCircle> circle;  ///< absent: to be found
  double ball_diameter_mm = 0.0;
  SourceLocation where;
};

/// Reads a CSV file with the header `file,u_px,v_px,radius_px,ball_diameter_mm`: the outline of the touched part of the
/// ball in each picture (u right, v down, the first pixel's centre at 0.5), or three empty cells where it is to be
/// found. Files are `frames`. @throws Error with file, line and field
std::vector<AnnotatedPress> read_ball_press_table(datasets::TableFrames& frames, const std::filesystem::path& csv);

/// Pictures of the untouched gel by their names: those of the table's frames, or files elsewhere.
std::vector<std::filesystem::path> rest_files(datasets::TableFrames& frames,
                                              const std::vector<std::filesystem::path>& names);

/// The mean of some of them. @throws Error naming the picture that's unfit
sensors::Background read_background(datasets::TableFrames& frames, const std::vector<std::filesystem::path>& files);

/// Reads the pictures of the table. @throws Error with the table's line for a picture that can't be read
std::vector<sensors::BallPress> read_ball_presses(datasets::TableFrames& frames,
                                                  const std::vector<AnnotatedPress>& table);

}  // namespace touchstone::lab
