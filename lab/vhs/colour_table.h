#pragma once
// Colours of what a clear gel touches, from pictures on disk: patches that are known, and regions that aren't.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sources/frame_source.h"
#include "lab/vhs/region_table.h"
#include "sensors/skin/colour_model.h"

namespace touchstone::lab {

/// A model, and how it does.
struct ColourCalibration {
  sensors::ColourModel model;
  std::vector<double> left_out_de2000;   ///< CIEDE2000 of each patch by a model of the others; empty where too few
  double trusted_share = 0.0;            ///< of the picture
  std::vector<std::string> faults = {};  ///< of patches that are left out, naming table and line
};
/// @param frames those of the patches, in which the card may be, too @param card pictures of an even white card through
/// the gel @param smooth_px as sensors::flat_field's
/// @throws Error as read_patch_table and sensors::flat_field; naming a picture of the card that can't be read; if no
/// patch can be used
ColourCalibration calibrate_colour(datasets::TableFrames& frames, const std::vector<std::filesystem::path>& card,
                                   double smooth_px, const std::vector<KnownPatch>& patches,
                                   const Progress& progress = {});

/// Of a grey picture: each number in it but 0 is a region of that name. @throws Error naming it
std::vector<NamedRegion> read_region_mask(const std::filesystem::path& picture, const cv::Size& size);

/// What came of all pictures.
struct ColourSummary {
  std::int64_t pictures = 0;             ///< that were used
  std::int64_t colours = 0;              ///< that were found in them
  std::vector<std::string> faults = {};  ///< of pictures that are left out, naming them
};
/// Writes `csv`: `file,t_us,region,L,a,b,trusted_percent,fault`, a line for each region of each picture; a picture that
/// is left out has one. @throws Error if no picture can be used
ColourSummary write_colours(const sensors::ColourModel& model, const std::vector<NamedRegion>& regions,
                            const std::vector<datasets::FrameStream>& streams, const std::filesystem::path& csv,
                            const Progress& progress = {});

}  // namespace touchstone::lab
