#pragma once
// Another program beside us, in a process of its own.

#include <filesystem>
#include <string>
#include <vector>

namespace touchstone::bench {

/// Runs a program (by its full path) to its end with one BLAS thread, stdout and stderr in `log`; its exit code, or -1.
int run_to_end(const std::vector<std::string>& command, const std::filesystem::path& log);

/// Runs a program that only says whether it can run: its exit code.
int probe(const std::vector<std::string>& command);

/// An empty folder for files that peers exchange with us, removed at the end of the run.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace touchstone::bench
