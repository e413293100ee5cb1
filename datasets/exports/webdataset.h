#pragma once
// A drawn data set as tar files, as WebDataset reads them: OUT/train-000000.tar with 00000012.frame.png,
// 00000012.height.npy, 00000012.contact.png and 00000012.json for each sample; OUT/units/ with what is once a sensor;
// OUT/index.json, written last. See docs/datasets.md.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"

namespace touchstone::datasets {

/// What is exported, and into how many files.
struct WebDatasetOptions {
  std::vector<std::string> splits;      ///< of train, validate, test; empty: all that have samples
  std::int64_t samples_per_tar = 1000;  ///< at most so many; samples are dealt to tars evenly
  int threads = 0;                      ///< at most so many; 0: as many as the machine has
};

/// What an export has written.
struct WebDatasetReport {
  std::int64_t samples = 0, tars = 0, bytes = 0;
};

/// Writes the set in `folder` as tars into `out`. The same set and options give the same bytes. A split's samples are
/// dealt to its tars like cards: each tar has some of every unit, as a loader shuffles only what is close together.
/// @throws Error if `folder` isn't a finished drawn set or is damaged; if `out` holds other files or a finished export
///   (what a killed export left is written over); for a split that isn't known or has no samples; if it can't be
///   written
WebDatasetReport export_webdataset(const std::filesystem::path& folder, const std::filesystem::path& out,
                                   const WebDatasetOptions& options, const Progress& progress = {});

/// A NumPy file (format 1.0) of 32 bit floats, row by row: `values` has the product of `shape` numbers.
std::string npy_of(const std::vector<std::int64_t>& shape, const std::vector<float>& values);

}  // namespace touchstone::datasets
