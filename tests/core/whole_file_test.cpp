#include "core/whole_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <thread>
#include <vector>

#include "core/error.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;

class WholeFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("touchstone_whole_file_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  int entries() const {
    int count = 0;
    for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_)) ++count;
    return count;
  }

  fs::path folder_;
};

TEST_F(WholeFile, ReadsBackWhatWasWritten) {
  const std::string content("with\0zero\nand line", 18);
  write_whole_file(folder_ / "a.bin", content);
  EXPECT_EQ(read_whole_file(folder_ / "a.bin"), content);
  write_whole_file(folder_ / "a.bin", "");
  EXPECT_EQ(read_whole_file(folder_ / "a.bin"), "");
  EXPECT_EQ(entries(), 1);
}

TEST_F(WholeFile, WriterThatThrowsLeavesNothing) {
  const auto broken = [](const fs::path& temporary) {
    std::ofstream(temporary) << "half";
    throw std::runtime_error("broke");
  };
  EXPECT_THROW(write_whole_file(folder_ / "a.txt", broken), std::runtime_error);
  EXPECT_EQ(entries(), 0);
  write_whole_file(folder_ / "a.txt", "old");
  EXPECT_THROW(write_whole_file(folder_ / "a.txt", broken), std::runtime_error);
  EXPECT_EQ(read_whole_file(folder_ / "a.txt"), "old");
  EXPECT_EQ(entries(), 1);
}

TEST_F(WholeFile, TheTemporaryFileStandsBesideWithTheSameEnding) {
  fs::path seen;
  write_whole_file(folder_ / "a.png", [&](const fs::path& temporary) {
    seen = temporary;
    EXPECT_FALSE(fs::exists(folder_ / "a.png"));
    std::ofstream(temporary) << "x";
  });
  EXPECT_EQ(seen.parent_path(), folder_);
  EXPECT_EQ(seen.extension(), ".png");
  EXPECT_FALSE(fs::exists(seen));
}

// The names were .a.<process>.<number>.part.bin once: whoever may write into the folder could put links there.
TEST_F(WholeFile, LinksThatLieInWaitArentFollowed) {
  write_whole_file(folder_ / "victim", "precious");
  for (int serial = 0; serial < 1000; ++serial) {
    fs::create_symlink(folder_ / "victim",
                       folder_ / (".a." + std::to_string(getpid()) + "." + std::to_string(serial) + ".part.bin"));
  }
  write_whole_file(folder_ / "a.bin", "new");
  EXPECT_EQ(read_whole_file(folder_ / "victim"), "precious");
  EXPECT_EQ(read_whole_file(folder_ / "a.bin"), "new");
}

TEST_F(WholeFile, ALinkInTheFilesPlaceIsReplacedNotFollowed) {
  write_whole_file(folder_ / "victim", "precious");
  fs::create_symlink(folder_ / "victim", folder_ / "a.bin");
  write_whole_file(folder_ / "a.bin", "new");
  EXPECT_EQ(read_whole_file(folder_ / "victim"), "precious");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder_ / "a.bin")));
}

TEST_F(WholeFile, NoTwoTemporaryNamesAreAlikeAndTheFileIsThere) {
  std::set<fs::path> names;
  for (int i = 0; i < 100; ++i) {
    write_whole_file(folder_ / "a.bin", [&](const fs::path& temporary) {
      EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(temporary)));
      EXPECT_EQ(fs::file_size(temporary), 0u);
      EXPECT_TRUE(names.insert(temporary).second);
      std::ofstream(temporary) << "x";
    });
  }
}

TEST_F(WholeFile, ItsModeIsTheUmasks) {
  const mode_t before = umask(027);
  write_whole_file(folder_ / "a.txt", "x");
  umask(before);
  EXPECT_EQ(fs::status(folder_ / "a.txt").permissions(), fs::perms(0640));
}

TEST_F(WholeFile, LastingOnesAreWrittenAsOthersAre) {
  write_lasting_file(folder_ / "a.txt", "x");
  write_lasting_file(folder_ / "a.txt", "longer");
  EXPECT_EQ(read_whole_file(folder_ / "a.txt"), "longer");
  EXPECT_EQ(entries(), 1);
  EXPECT_THROW(write_lasting_file(folder_ / "missing" / "a.txt", "x"), Error);
  EXPECT_THROW(wait_for_disk(folder_ / "missing.txt"), Error);
}

TEST_F(WholeFile, WriterThatWritesNothingIsAnError) {
  EXPECT_THROW(write_whole_file(folder_ / "a.txt", [](const fs::path&) {}), Error);
  EXPECT_EQ(entries(), 0);
}

TEST_F(WholeFile, BadPlacesAreErrorsThatNameThem) {
  try {
    write_whole_file(folder_ / "missing" / "a.txt", "x");
    ADD_FAILURE() << "wrote into a folder that isn't there";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("missing/a.txt"), std::string::npos) << error.what();
  }
  EXPECT_THROW(read_whole_file(folder_ / "missing.txt"), Error);
  EXPECT_THROW(read_whole_file(folder_), Error);
  fs::create_directories(folder_ / "sub" / "subsub");
  EXPECT_THROW(write_whole_file(folder_ / "sub", "x"), Error);
  EXPECT_EQ(entries(), 1);
}

TEST_F(WholeFile, ManyWritersLeaveOneWholeFile) {
  std::vector<std::thread> writers;
  for (int i = 0; i < 8; ++i) {
    writers.emplace_back(
        [&, i] { write_whole_file(folder_ / "a.txt", std::string(10000, static_cast<char>('a' + i))); });
  }
  for (std::thread& writer : writers) writer.join();
  const std::string content = read_whole_file(folder_ / "a.txt");
  ASSERT_EQ(content.size(), 10000u);
  EXPECT_EQ(content, std::string(10000, content[0]));
  EXPECT_EQ(entries(), 1);
}

}  // namespace
}  // namespace touchstone
