#include "core/input_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <string>

#include "core/hdf5_file.h"
#include "core/mapped_file.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "core/yaml_reader.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(InputFile, GivesBytesUntilTheFileEnds) {
  const test::TemporaryFolder folder;
  InputFile file(folder.write("a", "seven b"));
  EXPECT_EQ(file.size(), 7u);
  std::array<char, 5> bytes{};
  EXPECT_EQ(file.read(bytes.data(), bytes.size()), 5u);
  EXPECT_EQ(std::string(bytes.data(), 5), "seven");
  EXPECT_EQ(file.read(bytes.data(), bytes.size()), 2u);
  EXPECT_EQ(file.read(bytes.data(), bytes.size()), 0u);
}

// A pipe that nobody writes into, whoever opens it: it is refused, and not waited for.
TEST(InputFile, APipeIsRefusedAtOnce) {
  const test::TemporaryFolder folder;
  const std::filesystem::path pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const auto refusal = AllOf(HasSubstr("pipe: can't be read"), HasSubstr("it is a pipe or a device"));
  EXPECT_THAT(message_of([&] { InputFile{pipe}; }), refusal);
  EXPECT_THAT(message_of([&] { map_file(pipe); }), refusal);
  EXPECT_THAT(message_of([&] { read_whole_file(pipe); }), refusal);
  EXPECT_THAT(message_of([&] { sha256_of_file(pipe); }), refusal);
  EXPECT_THAT(message_of([&] { YamlReader::open(pipe); }), refusal);
  EXPECT_THAT(message_of([&] { Hdf5Reader{pipe}; }), HasSubstr("there is no such file"));
}

TEST(InputFile, DevicesFoldersAndWhatIsntThereAreRefused) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(message_of([] { read_whole_file("/dev/zero"); }), HasSubstr("/dev/zero: can't be read"));  // has no end
  EXPECT_THAT(message_of([] { sha256_of_file("/dev/zero"); }), HasSubstr("/dev/zero: can't be read"));
  EXPECT_THAT(message_of([&] { InputFile{folder.path()}; }), HasSubstr("it is a folder"));
  EXPECT_THAT(message_of([&] { InputFile{folder.path() / "none"}; }), HasSubstr("No such file"));
}

// The system says of these files that they have no bytes.
TEST(InputFile, AFileThatDoesntKnowItsSizeIsReadWhole) {
  EXPECT_THAT(read_whole_file("/proc/self/status"), HasSubstr("Name:"));
}

}  // namespace
}  // namespace touchstone
