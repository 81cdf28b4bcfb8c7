#include "base/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace trammel {
namespace {

TEST(Utf8, ReplacesWhatIsNotUtf8AndKeepsTheRest) {
  EXPECT_EQ(Utf8OrReplaced("µm ≥ 1\n"), "µm ≥ 1\n");
  EXPECT_EQ(Utf8OrReplaced("a\xC0\x80"), "a\xEF\xBF\xBD\xEF\xBF\xBD");     // overlong
  EXPECT_EQ(Utf8OrReplaced("\xED\xA0\x80").substr(0, 3), "\xEF\xBF\xBD");  // surrogate
  EXPECT_EQ(Utf8OrReplaced("x\xE2\x82"), "x\xEF\xBF\xBD\xEF\xBF\xBD");     // cut short
  EXPECT_EQ(Utf8OrReplaced(std::string_view("\0\x1b", 2)), "\xEF\xBF\xBD\xEF\xBF\xBD");
}

TEST(Utf8, BoundsTheLengthAtAWholeCharacter) {
  EXPECT_EQ(Utf8OrReplaced("0123456789", 10), "0123456789");
  EXPECT_EQ(Utf8OrReplaced("0123456789a", 10), "0123456…");
  EXPECT_EQ(Utf8OrReplaced("012345µµµµ", 10), "012345…");  // the seventh byte begins a character
  EXPECT_LE(Utf8OrReplaced(std::string(1000, '\xFF'), 100).size(), 100U);
  EXPECT_EQ(Utf8OrReplaced("aaaaaaaaaa\xFF", 9), "aaaaaa…");
}

TEST(Utf8, OfAFileIsItsTextWhateverItsMarkSays) {
  const std::string text = "id,µ,≥,😀\r\n";
  EXPECT_EQ(Utf8OfFile(text), text);
  EXPECT_EQ(Utf8OfFile("\xEF\xBB\xBF" + text), text);
  for (const bool low_first : {true, false}) {
    std::string bytes;
    for (const char16_t unit : std::u16string(u"\uFEFFid,µ,≥,😀\r\n")) {
      const char low = static_cast<char>(unit & 0xFF);
      const char high = static_cast<char>(unit >> 8);
      bytes += low_first ? std::string{low, high} : std::string{high, low};
    }
    EXPECT_EQ(Utf8OfFile(bytes), text);
    EXPECT_EQ(Utf8OfFile(bytes + "x"), text + "\xEF\xBF\xBD");  // cut within a character
  }
  EXPECT_EQ(Utf8OfFile(std::string("\xFF\xFE\x3D\xD8"
                                   "a\0",
                                   6)),
            "\xEF\xBF\xBD"
            "a");
  EXPECT_EQ(Utf8OfFile("\xFF\xFE"), "");
  EXPECT_EQ(Utf8OfFile(""), "");
}

TEST(EscapedForTerminal, ShowsWhatATerminalWouldObey) {
  EXPECT_EQ(EscapedForTerminal("a\tµm ≥ 1\n"), "a\tµm ≥ 1\n");
  EXPECT_EQ(EscapedForTerminal("\x1b[2J\r\a"), "\\u001b[2J\\u000d\\u0007");
  EXPECT_EQ(EscapedForTerminal("\xC2\x9B"
                               "1m"),
            "\\u009b1m");  // CSI in one character
  EXPECT_EQ(EscapedForTerminal("\xE2\x80\xAE"
                               "gnp"),
            "\\u202egnp");  // turns what follows
  EXPECT_EQ(EscapedForTerminal("\x7F\xFF"), "\\u007f\xEF\xBF\xBD");
  EXPECT_EQ(EscapedForTerminal("😀"), "😀");
}

TEST(IncompleteUtf8, CountsTheBytesThatBeginACharacter) {
  EXPECT_EQ(IncompleteUtf8("abc"), 0U);
  EXPECT_EQ(IncompleteUtf8("µ"), 0U);
  EXPECT_EQ(IncompleteUtf8("a\xC2"), 1U);
  EXPECT_EQ(IncompleteUtf8("a\xE2\x82"), 2U);
  EXPECT_EQ(IncompleteUtf8("a\xF0\x9F\x98"), 3U);
  EXPECT_EQ(IncompleteUtf8("\x80\x80\x80\x80"), 0U);  // never becomes one
}

}  // namespace
}  // namespace trammel
