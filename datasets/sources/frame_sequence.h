#pragma once
// Pictures in the order of time, with the force where it's known: simulated or recorded, an estimator sees no
// difference.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "datasets/jobs/job.h"

namespace touchstone::datasets {

/// One picture's file, when it was taken, and the force at that time.
struct LabelledFrame {
  std::filesystem::path file;  ///< of a frame that has no file of its own, what tables call it: "clip-000012"
  std::int64_t t_us = 0;
  int frame = 0;                         ///< number within its sequence
  std::optional<Eigen::Vector3d> force;  ///< on the object, N, gel frame; none where it isn't known
  bool timed = true;                     ///< false: t_us only says which frame comes first
};

/// Frames that one tracker can follow. The first one shows the sensor without load.
struct FrameSequence {
  std::string name;
  std::vector<LabelledFrame> frames;
};

/// The scenes of a finished data set that belong to `split`, or all of them. Checks the manifest, not every picture.
/// @throws Error if the folder isn't a finished data set, has no frames, or has no scene of this split
std::vector<FrameSequence> frames_of_data_set(const std::filesystem::path& folder, std::optional<Split> split);

/// Has the file a name of a picture that is read?
bool is_picture_name(const std::filesystem::path& file);

/// The pictures of a folder in natural order (core/natural_order.h), whatever their kinds: PNG, JPEG, BMP, TIFF, WebP,
/// PPM. Hidden files, folders and files of other endings are passed over; what can't be read is among them.
/// @throws Error if it's no folder, or there is none; naming a picture of a kind that isn't read, or two of one stem
std::vector<std::filesystem::path> picture_files(const std::filesystem::path& folder);

/// Recorded frames: the picture_files of a folder. Their times aren't known, only their order. @throws Error as they do
FrameSequence frames_of_folder(const std::filesystem::path& folder);

/// Recorded frames with forces, as a CSV file with the columns `file,t_us,force_x_N,force_y_N,force_z_N` in this order
/// and a header line; files are relative to `folder`. @throws Error with file and line
FrameSequence frames_of_force_table(const std::filesystem::path& folder, const std::filesystem::path& csv);

/// Forces at frames that have no files of their own.
struct NumberedForce {
  std::int64_t frame = 0;  ///< from 0
  std::int64_t t_us = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  int line = 0;  ///< of the table
};

/// The same table with `frame` in the place of `file`: the number of a frame within a video. Both that and the times
/// grow from line to line. @throws Error with file and line
std::vector<NumberedForce> read_numbered_forces(const std::filesystem::path& csv);

}  // namespace touchstone::datasets
