// Gives a fuzz target all that once failed, its seeds, and seeds with cheap damage, the same each time. What is looked
// for is that the program goes on: see fuzz_target.h.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "core/whole_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace touchstone::fuzz {
namespace {

const std::filesystem::path kFolder = TOUCHSTONE_SOURCE_DIR "/tests/fuzz";
constexpr const char* kTarget = TOUCHSTONE_FUZZ_TARGET;
constexpr const char* kMoreSeeds = TOUCHSTONE_FUZZ_MORE_SEEDS;   // folders of shipped files, with : between them
constexpr int kDamaged = TOUCHSTONE_FUZZ_DAMAGED;                // inputs made of all seeds together
constexpr const char* kMoreDamaged = "TOUCHSTONE_FUZZ_DAMAGED";  // in the environment: another number, other inputs

std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder, const std::string& ending = "") {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().string().ends_with(ending)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::filesystem::path> seeds() {
  auto files = files_below(kFolder / "corpus" / kTarget);
  std::istringstream folders(kMoreSeeds);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const auto more = files_below(folder, ".yaml");
    files.insert(files.end(), more.begin(), more.end());
  }
  return files;
}

/// One piece of damage, as disks, networks and people with editors do it.
void damage(std::string& bytes, const std::string& other, std::mt19937& random) {
  const auto below = [&](std::size_t end) {
    return static_cast<std::size_t>(random()) % std::max<std::size_t>(1, end);
  };
  const std::size_t at = below(bytes.size());
  const std::size_t length = 1 + below(32);
  static const std::array<std::string, 12> kWords = {"0",
                                                     "-1",
                                                     "1e308",
                                                     "nan",
                                                     "9223372036854775807",
                                                     "4294967296",
                                                     "[[[[[[[[",
                                                     "&a [*a, *a]",
                                                     "\"",
                                                     "{",
                                                     ": ",
                                                     std::string("\xff\xff\xff\x7f\0\0\0\x80", 8)};
  switch (random() % 7) {
    case 0:
      bytes.resize(at);
      break;
    case 1:
      if (!bytes.empty()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
      break;
    case 2:
      if (!bytes.empty()) bytes[at] = static_cast<char>(random());
      break;
    case 3:
      bytes.erase(at, length);
      break;
    case 4:
      bytes.insert(at, bytes.substr(below(bytes.size()), length));
      break;
    case 5:
      bytes.replace(at, random() % 2 == 0 ? 0 : length, kWords[random() % kWords.size()]);
      break;
    default:
      bytes.replace(at, length, other, below(other.size()), 2 * length);
  }
}

TEST(FuzzReplay, WhatOnceFailedIsReadOrRefused) {
  for (const auto& file : files_below(kFolder / "found" / kTarget)) {
    SCOPED_TRACE(file.string());
    const auto start = std::chrono::steady_clock::now();
    EXPECT_NO_THROW(reads(read_whole_file(file)));
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    RecordProperty(file.filename().string(), std::to_string(taken.count()) + " s");
  }
}

TEST(FuzzReplay, EverySeedIsRead) {
  const auto files = seeds();
  ASSERT_FALSE(files.empty());
  for (const auto& file : files) {
    SCOPED_TRACE(file.string());
    EXPECT_TRUE(reads(read_whole_file(file)));
  }
}

TEST(FuzzReplay, DamagedSeedsAreReadOrRefused) {
  std::vector<std::string> all;
  for (const auto& file : seeds()) all.push_back(read_whole_file(file));
  ASSERT_FALSE(all.empty());
  const char* const wanted = std::getenv(kMoreDamaged);
  const int count = wanted != nullptr ? std::atoi(wanted) : kDamaged;
  std::mt19937 random(static_cast<unsigned>(count));
  for (int i = 0; i < count; ++i) {
    std::string bytes = all[static_cast<std::size_t>(i) % all.size()];
    const int times = 1 + static_cast<int>(random() % 4);
    for (int k = 0; k < times; ++k) damage(bytes, all[random() % all.size()], random);
    SCOPED_TRACE(i);
    ASSERT_NO_THROW(reads(bytes));
  }
}

}  // namespace
}  // namespace touchstone::fuzz
