#pragma once
// Recordings of real sensors. They aren't part of the repository: tests that need them are skipped where they aren't.

#include <cstdlib>
#include <filesystem>

namespace touchstone::test {

/// The folder of a sensor's recordings: in $TOUCHSTONE_RECORDINGS, or where they lie beside the repository. It
/// may not be there.
inline std::filesystem::path recordings_of(const char* sensor) {
  const char* const given = std::getenv("TOUCHSTONE_RECORDINGS");
  const std::filesystem::path all =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(TOUCHSTONE_SOURCE_DIR).parent_path() / "shared" / "recordings";
  return all / sensor;
}

}  // namespace touchstone::test

/// Skips the test, naming the folder, where a sensor has no recordings.
#define TS_NEEDS_RECORDINGS(folder) \
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no recordings in " << (folder).string()
