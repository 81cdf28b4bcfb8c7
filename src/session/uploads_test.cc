#include "session/uploads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>

#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using testing::FakePrinter;
using ::testing::Field;

TEST(Uploads, TheFoldersOwnFilesComeByTheirTime) {
  FakePrinter printer;
  printer.server = [](const std::string&, const nlohmann::json&) -> Result<nlohmann::json> {
    return nlohmann::json::parse(R"([
      {"path": "printer.cfg", "modified": 9}, {"path": "trammel/b.png", "modified": 7.5},
      {"path": "trammel/old/c.png", "modified": 8}, {"path": "trammel/a.png", "modified": 3},
      {"path": "trammel/untold.png", "modified": null}, {"path": 7}, 3,
      {"path": "trammel/notes.txt", "modified": 8}])");
  };
  const auto uploads = ListUploads({printer, {}, {}},
                                   [](const std::string& name) { return name.ends_with(".png"); });
  ASSERT_TRUE(uploads);
  EXPECT_THAT(*uploads, ElementsAre(Field(&UploadedFile::name, "untold.png"),
                                    Field(&UploadedFile::name, "a.png"),
                                    Field(&UploadedFile::name, "b.png")));
}

TEST(Uploads, ALargerFileThanIsWantedIsRefused) {
  FakePrinter printer;
  printer.config_files["trammel/a.png"] = "12345";
  EXPECT_EQ(DownloadUpload({printer, {}, {}}, "a.png", 5).value_or(""), "12345");
  EXPECT_FALSE(DownloadUpload({printer, {}, {}}, "a.png", 4));
}

TEST(Uploads, EndingsCountInCapitalsTooAndNeitherFoldersNorHiddenNamesHaveOne) {
  constexpr std::array<std::string_view, 2> kEndings = {".png", ".pdf"};
  EXPECT_EQ(EndingAmong(kEndings, "Scan 1.PDF"), ".pdf");
  for (const char* name : {"png", ".png", "a.jpg", "a/b.png", "../a.png", "a.png.txt", ""}) {
    EXPECT_EQ(EndingAmong(kEndings, name), "") << name;
  }
}

}  // namespace
}  // namespace trammel::procedure
