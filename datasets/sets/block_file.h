#pragma once
// A file of samples of a drawn data set: OUT/blocks/000012.h5. HDF5, before which stands a line of JSON (a user block
// of 512 bytes, which HDF5 passes over) that says whose it is and holds the checksum of the rest: so a file tells by
// itself whether it's whole. See docs/datasets.md for its arrays.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "datasets/sets/block_record.h"
#include "datasets/sets/manifest.h"

namespace touchstone::datasets {

/// blocks/000012.h5
std::string block_name(const DrawnBlock& block);

/// Writes a block so that it's there whole or not at all. `identity` stands for the run (run_checksum). Pictures are
/// packed by many threads; the same samples give the same bytes. Not from several threads at once.
void write_block(const std::filesystem::path& out, const std::string& identity, const PreparedDraw& prepared,
                 const DrawnBlock& block, const DrawnUnit& unit, const UnitSensor& sensor,
                 std::span<const BlockRecord> records);

/// What stands where a block's file is expected.
enum class BlockState {
  absent,
  whole,
  damaged,  ///< cut off or changed: it is to be made again
  foreign   ///< whole, but of another job, another run or another place in it
};
/// Reads the whole file and checks it against its checksum; a file that can't be parsed is `damaged`. `identity` is the
/// run's, as for write_block. @throws Error if the file can't be read
BlockState state_of_block(const std::filesystem::path& out, const std::string& identity, const DrawnBlock& block);

/// All of a block but its pictures, column by column.
struct BlockColumns {
  std::vector<std::int64_t> sample;
  std::vector<int> unit, object, split, attempt;
  std::vector<double> force_N, shear_N, deepest_mm, contact_area_mm2, largest_strain, force_error_N;
  std::vector<double> place_x_mm, place_y_mm, turn_deg, tilt_deg, drag_mm;
  std::int64_t under_resolved = 0;
  std::string light;
};
/// Of a block that is `whole`. @throws Error naming the file, where an array is missing or of another length than the
/// block
BlockColumns read_block_columns(const std::filesystem::path& out, const DrawnBlock& block);

}  // namespace touchstone::datasets
