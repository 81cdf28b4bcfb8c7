#include "service/result_picture.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "session/fake_printer.h"

namespace trammel::service {
namespace {

using nlohmann::json;
using procedure::testing::FakePrinter;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A printer whose config/trammel holds files; notes what is removed.
class ResultPictureTest : public ::testing::Test {
 protected:
  ResultPictureTest() {
    printer_.server = [this](const std::string& method, const json& params) -> Result<json> {
      if (method == "server.files.get_directory") {
        EXPECT_EQ(params["path"], "config/trammel");
        return listed_;
      }
      EXPECT_EQ(method, "server.files.delete_file");
      removed_.push_back(params["path"]);
      return json::object();
    };
  }
  void Holds(const std::string& name) { listed_["files"].push_back({{"filename", name}}); }
  void HoldsMonths(int months) {
    for (int i = months; i >= 1; --i) Holds(fmt::format("tap-2026{:02}02T030405Z.png", i));
  }

  FakePrinter printer_;
  json listed_ = {{"dirs", json::array()}, {"files", json::array()}};
  std::vector<std::string> removed_;
};

TEST_F(ResultPictureTest, LiesInAFolderBesideTheConfiguration) {
  ASSERT_TRUE(StorePicture(printer_, "pressure_advance-20260102T030405Z", "png", {1}));
  EXPECT_EQ(printer_.config_files["trammel/pressure_advance-20260102T030405Z.png"], "png");
  EXPECT_THAT(removed_, IsEmpty());
}

TEST_F(ResultPictureTest, TheOldestOfMoreThanTwentyAreRemoved) {
  HoldsMonths(12);
  Holds("pressure_advance-20250102T030405Z-2.png");
  for (int day = 10; day < 19; ++day) Holds(fmt::format("pa-202701{}T030405Z.png", day));
  ASSERT_TRUE(StorePicture(printer_, "pa-20270120T030405Z", "png", {1}));
  EXPECT_THAT(removed_, ElementsAre("config/trammel/pressure_advance-20250102T030405Z-2.png",
                                    "config/trammel/tap-20260102T030405Z.png"));
}

TEST_F(ResultPictureTest, FilesOfOtherNamesAreNeitherCountedNorRemoved) {
  HoldsMonths(12);
  for (int i = 0; i < 30; ++i) {
    Holds(fmt::format("holiday{}.png", i));
    Holds(fmt::format("pa-20260102T030405Z.{}.png", i));
    Holds(fmt::format("pa-2026010XT0304{:02}Z.png", i));
    Holds(fmt::format("pa-202601{:02}.png", i));
    Holds(fmt::format("../pa-202601{:02}T030405Z.png", i));
  }
  listed_["files"].push_back(5);
  listed_["files"].push_back({{"filename", 5}});
  ASSERT_TRUE(StorePicture(printer_, "pa-20270120T030405Z", "png", {1}));
  EXPECT_THAT(removed_, IsEmpty());
}

TEST_F(ResultPictureTest, OneThatIsTooLargeIsRefused) {
  EXPECT_FALSE(StorePicture(printer_, "pa-1", std::string(kMostPictureBytes + 1, 'x'), {1}));
  EXPECT_THAT(printer_.config_files, IsEmpty());
}

}  // namespace
}  // namespace trammel::service
