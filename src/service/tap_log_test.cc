#include "service/tap_log.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class TapLog : public ::testing::Test {
 protected:
  static std::string Line(double z_mm, const std::string& printer = "voron") {
    return json{{"time", {1, 2, 3}},
                {kTapAnswer,
                 {{"printer", printer}, {"contact_z_mm", z_mm}, {"curve", {{"z_mm", {0, z_mm}}}}}}}
               .dump() +
           "\n";
  }
  void Write(const std::string& name, const std::string& text) {
    test::WriteWhole(folder_.path() / name, text);
  }
  std::vector<double> Heights(std::size_t last = 20) {
    std::vector<double> heights;
    for (const json& tap : NewestTaps(folder_.path(), "voron:7125", last)) {
      EXPECT_FALSE(tap.contains("curve"));
      heights.push_back(tap.at("contact_z_mm"));
    }
    return heights;
  }

  test::TemporaryFolder folder_;
};

TEST_F(TapLog, HasTheNewestTapsOfAPrinterFirst) {
  EXPECT_THAT(Heights(), IsEmpty());
  Write("taps-20260102T030405Z.jsonl", Line(1) + Line(2));
  Write("tap-20260103T030405Z.jsonl", Line(3) + "no tap\n" + Line(9, "ender") + Line(4));
  Write("taps-20260104T030405Z.jsonl", R"({"x_trammel": )");  // being written
  Write("other-20260105T030405Z.jsonl", Line(7));
  fs::create_symlink(folder_.path() / "other-20260105T030405Z.jsonl",
                     folder_.path() / "taps-20260106T030405Z.jsonl");
  EXPECT_THAT(Heights(), ElementsAre(4, 3, 2, 1));
  EXPECT_THAT(Heights(3), ElementsAre(4, 3, 2));
}

TEST_F(TapLog, FindsATapByItsName) {
  Write("taps-20260102T030405Z.jsonl", Line(1) + Line(2) + Line(3));
  for (const json& tap : NewestTaps(folder_.path(), "voron:7125", 3)) {
    const auto found = TapIn(folder_.path(), tap.at("tap"));
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->at("contact_z_mm"), tap.at("contact_z_mm"));
    EXPECT_EQ(found->at("curve").at("z_mm").at(1), tap.at("contact_z_mm"));
  }
  test::WriteWhole(folder_.path() / "secret.jsonl", Line(5));
  for (const char* name : {"", ":", "taps-20260102T030405Z", "taps-20260102T030405Z:1",
                           "taps-20260102T030405Z:9999999", "taps-20260102T030405Z:-1",
                           "taps-20260102T030405Z:99999999999999999999", "secret:0",
                           "../taps-20260102T030405Z:0", "none-20260102T030405Z:0"}) {
    EXPECT_FALSE(TapIn(folder_.path(), name)) << name;
  }
}

}  // namespace
}  // namespace trammel::service
