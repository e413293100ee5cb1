#pragma once
// Tables of estimates as one HDF5 file (docs/file-formats.md, "Tables as HDF5").

#include <filesystem>
#include <span>

#include "datasets/inspection/estimate_table.h"

namespace touchstone::datasets {

/// Writes each table as a group of its file's name without the ending, and in it each column as a dataset: numbers as
/// float64 (NaN where a cell is empty), else texts of one length in UTF-8. Units are attributes. The same tables make
/// the same bytes.
/// @throws Error if two tables have the same name, a name can't be one in HDF5, or the file can't be written
void write_hdf5(std::span<const EstimateTable> tables, const std::filesystem::path& file);

}  // namespace touchstone::datasets
