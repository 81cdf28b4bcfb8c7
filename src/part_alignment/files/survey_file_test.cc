#include "part_alignment/files/survey_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;

class SurveyFile : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path File(const std::string& text) const {
    const auto path = folder_.path() / "file";
    test::WriteWhole(path, text);
    return path;
  }
  test::TemporaryFolder folder_;
};

TEST_F(SurveyFile, GivesEveryNumberBack) {
  std::vector<part_alignment::SurveyPicture> pictures = {
      {"a.jpg", 4000, 3000, {{"7", 1.0 / 3, 2.0 / 7, 0.03}, {"T8", 3999, 2999, 0.1}}, {}},
      {"b \"c\".jpg", 4000, 3000, {}, {}}};
  pictures[0].discs = {{1.0 / 3, 2.0 / 7, 6.1, 5.9, 0.7}, {3999, 2999, 8, 7, -0.3}};
  pictures[1].plain = {{1.0 / 3, 2.0 / 7, 0.05}, {12, 13, 0.04, {{12, 13, 5.2, 4.1, 1.0 / 7}}}};
  const auto read = Must(ReadSurveyFile(File(SurveyFileText(pictures))));
  ASSERT_EQ(read.size(), 2U);
  EXPECT_TRUE(read[0].plain.empty());
  ASSERT_EQ(read[1].plain.size(), 2U);
  EXPECT_EQ(read[1].plain[0].row_px, 2.0 / 7);
  EXPECT_EQ(read[1].plain[0].sigma_px, 0.05);
  EXPECT_FALSE(read[1].plain[0].disc);
  ASSERT_TRUE(read[1].plain[1].disc);
  EXPECT_EQ(read[1].plain[1].disc->semi_minor_px, 4.1);
  EXPECT_EQ(read[1].plain[1].disc->angle_rad, 1.0 / 7);
  EXPECT_EQ(read[1].name, pictures[1].name);
  EXPECT_TRUE(read[1].observations.empty());
  EXPECT_EQ(read[0].width_px, 4000);
  EXPECT_EQ(read[0].height_px, 3000);
  ASSERT_EQ(read[0].observations.size(), 2U);
  EXPECT_EQ(read[0].observations[1].target, "T8");
  EXPECT_EQ(read[0].observations[0].column_px, 1.0 / 3);
  EXPECT_EQ(read[0].observations[0].row_px, 2.0 / 7);
  EXPECT_EQ(read[0].observations[0].sigma_px, 0.03);
  ASSERT_EQ(read[0].discs.size(), 2U);
  EXPECT_EQ(read[0].discs[0].semi_minor_px, 5.9);
  EXPECT_EQ(read[0].discs[1].angle_rad, -0.3);
  EXPECT_TRUE(read[1].discs.empty());
}

TEST_F(SurveyFile, NamesThePlaceOfAFault) {
  const auto message = [this](const std::string& text) {
    const auto read = ReadSurveyFile(File(text));
    return read ? std::string() : read.error().message;
  };
  EXPECT_THAT(message(R"({"format": 1, "pictures": []})"), HasSubstr("pictures"));
  EXPECT_THAT(
      message(
          R"({"format": 1, "pictures": [{"name": "a", "image_px": [40], "observations": []}]})"),
      HasSubstr("pictures[0].image_px"));
  EXPECT_THAT(
      message(R"({"format": 1, "pictures": [{"name": "a", "image_px": [40, 30], "observations":
           [{"target": 7, "column_px": 3, "row_px": 4, "sigma_px": 0.1, "x": 1}]}]})"),
      HasSubstr("observations[0]"));
}

TEST_F(SurveyFile, ReadsScaleBarsOfAnyObject) {
  const auto bars = Must(ReadScaleBarFile(File(
      R"({"format": 1, "surfaces": [], "scale_bars":
          [{"from": 41, "to": "42", "length_mm": 1000.1, "sigma_mm": 0.01}]})")));
  ASSERT_EQ(bars.size(), 1U);
  EXPECT_EQ(bars[0].from, "41");
  EXPECT_EQ(bars[0].length_mm, 1000.1);
  EXPECT_THAT(ReadScaleBarFile(File(R"({"format": 1})")), FailsWith("scale_bars is missing"));
}

}  // namespace
}  // namespace trammel::files
