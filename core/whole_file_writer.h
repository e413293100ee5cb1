#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

namespace touchstone {

/// A file that is there whole or not at all (core/whole_file.h) and is written piece by piece, as what it is about
/// comes: the table of a long recording.
class WholeFileWriter {
 public:
  /// @throws Error that names `path` if it can't be written
  explicit WholeFileWriter(const std::filesystem::path& path);
  /// Without finish() there is no file.
  ~WholeFileWriter();
  WholeFileWriter(const WholeFileWriter&) = delete;
  WholeFileWriter& operator=(const WholeFileWriter&) = delete;

  /// @throws Error that names `path`, as where the disk is full
  void append(std::string_view content);
  /// What is written until finish() gives it its name: for a library that writes to a file by its name.
  const std::filesystem::path& temporary() const;
  /// Gives the file its name. @pre once, at the end
  void finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone
