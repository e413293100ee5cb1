#pragma once
// Tar files that are the same bytes whenever they hold the same files: no times, no owners.

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace touchstone::datasets {

/// Writes a tar file (ustar). Each function throws Error, naming the file, if it can't do what is asked.
class TarWriter {
 public:
  /// Begins the file, in the place of one of that name.
  explicit TarWriter(const std::filesystem::path& file);
  ~TarWriter();
  TarWriter(const TarWriter&) = delete;
  TarWriter& operator=(const TarWriter&) = delete;

  /// @pre `name` is at most 100 characters of ASCII
  void add(const std::string& name, std::string_view content);
  /// Ends the file; without this call it isn't whole.
  void close();

 private:
  struct Archive;
  void check(int result) const;

  std::string name_;
  std::unique_ptr<Archive> archive_;
};

}  // namespace touchstone::datasets
