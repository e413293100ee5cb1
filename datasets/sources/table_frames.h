#pragma once
// Frames that a table names in its lines, as those of a calibration do: pictures of a folder by their files' names, or
// frames of a video or a data set by their names in tables (name_in_table).

#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "core/error.h"

namespace touchstone::datasets {

/// The frames of one recording. Those that are named are kept in memory, once one of them is read, unless the recording
/// is a folder of pictures. Not for several threads.
class TableFrames {
 public:
  /// @throws Error for a live source
  explicit TableFrames(std::filesystem::path place);

  /// Notes that a line names a frame. Gives the path that it has in messages; a picture's is its file's.
  /// @throws Error at `where` for a folder without such a file
  std::filesystem::path named(const std::string& cell, const SourceLocation& where);
  /// The same of a picture that may also lie elsewhere: a file of that name, if there is one and no folder has it.
  std::filesystem::path named_or_file(const std::filesystem::path& name);

  /// A frame that was named, or another file's picture. @throws Error naming it if it can't be read
  cv::Mat read(const std::filesystem::path& frame);

 private:
  struct Frame {
    cv::Mat image;
    std::string fault;
  };
  void go_through();

  std::filesystem::path place_;
  bool is_folder_ = false;                             ///< of pictures
  std::map<std::string, std::optional<Frame>> named_;  ///< by path; none: not read yet, or not there
  bool gone_through_ = false;
};

}  // namespace touchstone::datasets
