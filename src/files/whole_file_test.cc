#include "files/whole_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST(WholeFile, ReadsEveryByte) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "x.bin";
  const std::string small("a\0b\r\n", 5);
  const std::string large(1'000'000, 'x');  // more than is read at once
  for (const std::string& bytes : {small, large, std::string()}) {
    test::WriteWhole(path, bytes);
    EXPECT_EQ(*ReadWholeFile(path, large.size()), bytes);
  }
}

TEST(WholeFile, NamesWhatCannotBeRead) {
  const test::TemporaryFolder folder;
  test::WriteWhole(folder.path() / "four", "1234");
  test::WriteWhole(folder.path() / "huge", "");
  fs::resize_file(folder.path() / "huge", std::uintmax_t{1} << 36);  // a hole: it takes no room
  const struct {
    fs::path path;
    const char* says;
  } cases[] = {{folder.path() / "none", "no such file"},
               {folder.path(), "is a folder"},
               {folder.path() / "four", "larger than 3 bytes"},
               {folder.path() / "huge", "larger than 3 bytes"}};
  for (const auto& bad : cases) {
    const auto read = ReadWholeFile(bad.path, 3);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr(bad.path.string()));
    EXPECT_THAT(read.error().message, HasSubstr(bad.says));
  }
  EXPECT_TRUE(ReadWholeFile(folder.path() / "four", 4));
}

}  // namespace
}  // namespace trammel::files
