#include "base/file_kind.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace trammel {
namespace {

using std::string_view_literals::operator""sv;

std::string Kind(std::string_view bytes) {
  const auto kind = KindByContent(bytes);
  return kind ? std::string(kind->name) : "";
}

TEST(FileKind, NamesForeignFilesByTheirFirstBytes) {
  EXPECT_EQ(Kind("PK\3\4xxxx"), "a ZIP archive");
  EXPECT_EQ(Kind("\x1f\x8b\x08\0"sv), "a gzip archive");
  EXPECT_EQ(Kind("GCDE\1\0\0\0"sv), "binary G-code");
  EXPECT_EQ(Kind("\xff\xfe{\0"sv), "text in UTF-16");
  EXPECT_EQ(Kind("\xff\xfe\0\0{\0\0\0"sv), "text in UTF-32");
  EXPECT_EQ(Kind("\n <!DOCTYPE HTML><html>"), "a web page");
  EXPECT_EQ(Kind("%PDF-1.7"), "a PDF");
  EXPECT_EQ(Kind(std::string(257, 'x') + "ustar\0"), "a tar archive");
}

TEST(FileKind, LeavesTextAlone) {
  for (const std::string_view text : {""sv, "{"sv, "[1]"sv, "\xef\xbb\xbf{}"sv, "; G-code\nG28\n"sv,
                                      "G1 X1"sv, "P"sv, "PK"sv, "solid a"sv}) {
    EXPECT_EQ(Kind(text), "") << text;
  }
}

}  // namespace
}  // namespace trammel
