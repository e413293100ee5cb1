#include "core/sha256.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/error.h"
#include "core/whole_file.h"

namespace touchstone {
namespace {

// The examples of FIPS 180-4.
TEST(Sha256, GivesTheKnownAnswers) {
  EXPECT_EQ(sha256_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_of(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesGiveTheSumOfTheWhole) {
  Sha256 sum;
  sum.add("a");
  sum.add("");
  sum.add("bc");
  EXPECT_EQ(sum.digest(), sha256_of("abc"));
}

TEST(Sha256, FileGivesTheSumOfItsBytes) {
  const std::string content = std::string(200000, 'x') + std::string("\0y", 2);  // more than one buffer
  const auto path = std::filesystem::path(testing::TempDir()) / "touchstone_sha256_test.bin";
  write_whole_file(path, content);
  EXPECT_EQ(sha256_of_file(path), sha256_of(content));
  std::filesystem::remove(path);
  EXPECT_THROW(sha256_of_file(path), Error);
  EXPECT_THROW(sha256_of_file(testing::TempDir()), Error) << "a folder has no bytes";
}

}  // namespace
}  // namespace touchstone
