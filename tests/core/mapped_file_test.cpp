#include "core/mapped_file.h"

#include <gtest/gtest.h>

#include <string_view>

#include "core/error.h"
#include "core/whole_file.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

std::string_view text(const MappedFile& file) {
  return {file.bytes.get(), file.size};
}

TEST(MappedFile, HoldsTheFilesBytes) {
  const test::TemporaryFolder folder;
  const std::string content = std::string("a\0b", 3) + std::string(10000, 'x');
  write_whole_file(folder.path() / "file", content);
  const MappedFile file = map_file(folder.path() / "file");
  EXPECT_EQ(text(file), content);
}

TEST(MappedFile, OutlivesRemovalAndReplacement) {
  const test::TemporaryFolder folder;
  write_whole_file(folder.path() / "file", "first");
  const MappedFile first = map_file(folder.path() / "file");
  const MappedFile copy = first;
  write_whole_file(folder.path() / "file", "the second, longer one");
  EXPECT_EQ(text(copy), "first");
  EXPECT_EQ(text(map_file(folder.path() / "file")), "the second, longer one");
  std::filesystem::remove(folder.path() / "file");
  EXPECT_EQ(text(first), "first");
}

TEST(MappedFile, EmptyFileHasNoBytes) {
  const test::TemporaryFolder folder;
  write_whole_file(folder.path() / "file", "");
  EXPECT_EQ(map_file(folder.path() / "file").size, 0u);
}

TEST(MappedFile, WhatIsNoFileIsRefused) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(map_file(folder.path()), Error);
  EXPECT_THROW(map_file(folder.path() / "absent"), Error);
  EXPECT_THROW(map_file("/dev/null"), Error);
}

}  // namespace
}  // namespace touchstone
