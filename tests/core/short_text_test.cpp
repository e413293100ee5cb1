#include "core/short_text.h"

#include <gtest/gtest.h>

namespace touchstone {
namespace {

TEST(ShortText, ShortOnesStayAndLongOnesAreCut) {
  EXPECT_EQ(short_text(""), "");
  EXPECT_EQ(short_text("3 mm"), "3 mm");
  EXPECT_EQ(short_text(std::string(60, 'a')), std::string(60, 'a'));
  EXPECT_EQ(short_text(std::string(61, 'a')), std::string(60, 'a') + "...");
}

TEST(ShortText, NoLetterIsCutApart) {
  const std::string euro = "\xe2\x82\xac";
  EXPECT_EQ(short_text(std::string(58, 'a') + euro + "b"), std::string(58, 'a') + "...");
  EXPECT_EQ(short_text(std::string(57, 'a') + euro + "b"), std::string(57, 'a') + euro + "...");
  EXPECT_EQ(short_text(std::string(200, '\x80')).size(), 60u);  // no UTF-8 at all
}

TEST(ShortText, ControlCharactersAreWrittenOut) {
  using namespace std::string_view_literals;
  EXPECT_EQ(short_text("a\0b\x1b[2J\n\x7f"sv), "a\\x00b\\x1b[2J\\x0a\\x7f");
}

}  // namespace
}  // namespace touchstone
