#include "core/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

TEST(TextFile, AMarkOfUtf8IsPassedOver) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(read_text_file(folder.write("plain", "a\r\n\xff")), "a\r\n\xff");
  EXPECT_EQ(read_text_file(folder.write("marked",
                                        "\xef\xbb\xbf"
                                        "a\n")),
            "a\n");
  EXPECT_EQ(read_text_file(folder.write("empty", "")), "");
  EXPECT_EQ(read_text_file(folder.write("half", "\xef\xbb")), "\xef\xbb");
}

TEST(TextFile, OtherEncodingsAreNamed) {
  const test::TemporaryFolder folder;
  for (const std::string& text : {std::string("\xff\xfe"
                                              "a\0",
                                              4),
                                  std::string("\xfe\xff\0a", 4), std::string("\0\0\xfe\xff\0\0\0a", 8)}) {
    const auto file = folder.write("table.csv", text);
    EXPECT_THAT(test::message_of([&] { read_text_file(file); }),
                testing::HasSubstr("table.csv: is text in UTF-16 or UTF-32; save it as UTF-8"));
  }
}

TEST(TextFile, Utf8IsTold) {
  for (const char* good : {"", "a", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80", "\xf4\x8f\xbf\xbf", "\x01\x7f"}) {
    EXPECT_TRUE(is_utf8(good)) << good;
  }
  // A byte of Latin-1, a letter cut off, too long a form, a half of a pair, beyond the last letter.
  for (const char* bad : {"\xe9t\xe9", "\xc3", "\xe2\x82", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80",
                          "\xf4\x90\x80\x80", "\xff", "\x80", "\xf0\x80\x80\x80"}) {
    EXPECT_FALSE(is_utf8(bad)) << bad;
  }
}

}  // namespace
}  // namespace touchstone
