#pragma once
// Marks of skin from pictures of any source, before and under pressure.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sources/frame_source.h"
#include "sensors/skin/skin_marks.h"

namespace touchstone::lab {

/// What came of all pictures under pressure.
struct MarkSummary {
  std::int64_t pictures = 0, erythema = 0, purpura = 0, unknown = 0;
  std::vector<std::string> faults = {};  ///< of pictures that are left out, naming them
};

/// Compares each picture with the one before pressure and writes `csv`:
/// `file,t_us,mark,kind,u_px,v_px,area_px,index_before,index_pressed,blanched,darkened,fault`, a line for each mark of
/// each picture, largest first. A picture with no mark has one line without one, as one that is left out.
/// @param before the picture before pressure; empty: the first one of each sequence
/// @throws Error for a picture before pressure that can't be used, or if no other can
MarkSummary write_skin_marks(const std::vector<datasets::FrameStream>& streams, const std::filesystem::path& before,
                             const sensors::SkinMarkSettings& settings, const std::filesystem::path& csv,
                             const Progress& progress = {});

}  // namespace touchstone::lab
