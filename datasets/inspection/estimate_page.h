#pragma once
// What an estimator made of a recording, as one page that needs nothing else: curves over time with their error bars
// and true values, errors in words, contact and slip, frames that aren't to be trusted, pictures.

#include <filesystem>
#include <string>
#include <vector>

#include "datasets/inspection/estimate_table.h"

namespace touchstone::datasets {

/// How much is shown.
struct EstimatePageOptions {
  int most_sequences = 6;  ///< with curves of their own
  int most_frames = 30;    ///< named of those that aren't trusted
  int most_tiles = 12;     ///< pictures
  int columns = 4;
  int tile_width = 300;
};

/// The tables (*.csv) of a folder by name, or the one table that the path is. @throws Error if there is none, or as
/// read_estimate_table
std::vector<EstimateTable> estimate_tables(const std::filesystem::path& place);

/// All pictures below a folder, in natural order; none if there's no such folder.
std::vector<std::filesystem::path> pictures_below(const std::filesystem::path& folder);

/// The page, HTML in UTF-8. The same tables and pictures make the same bytes.
/// @param pictures of the frames with what was estimated of them @throws Error naming a picture that can't be read
std::string estimate_page(const std::string& title, const std::vector<EstimateTable>& tables,
                          const std::vector<std::filesystem::path>& pictures, const EstimatePageOptions& options = {});

}  // namespace touchstone::datasets
