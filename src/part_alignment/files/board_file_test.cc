#include "part_alignment/files/board_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "part_alignment/files/camera_file.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHead =
    R"({"format": 1, "date": "2026-11-22", "sheet": "sheet.json",
        "camera": {"model": "brown_measured_to_ideal", "image_px": [2592, 1944],
                   "pixel_pitch_mm": 0.0022, "looks_along": "+z"},)";
constexpr const char* kTouches =
    R"("touches": [{"mark": 7, "spindle_mm": [1, 2, 3], "tool_length_mm": 120, "axes": "z",
                    "sigma_mm": 0.003}],)";
constexpr const char* kViews =
    R"("views": [{"picture": "a.png", "spindle_mm": [600, 400, 600]},
                 {"picture": "b.png", "spindle_mm": [610, 400, 600], "c_deg": 90}]})";
constexpr const char* kSheet =
    R"({"format": 1, "bits": 14, "radius_mm": 3, "targets": [
        {"number": 7, "word": 5, "page": 1, "x_mm": 20, "y_mm": 30},
        {"number": null, "word": null, "page": 1, "x_mm": 40, "y_mm": 30}]})";

class BoardFileTest : public testing::Test {
 protected:
  [[nodiscard]] Result<BoardFile> Read(const std::string& text,
                                       const std::string& sheet = kSheet) const {
    test::WriteWhole(folder_.path() / "sheet.json", sheet);
    const auto path = folder_.path() / "board.json";
    test::WriteWhole(path, text);
    return ReadBoardFile(path);
  }
  [[nodiscard]] std::string Message(const std::string& text,
                                    const std::string& sheet = kSheet) const {
    const auto read = Read(text, sheet);
    return read ? std::string() : read.error().message;
  }
  test::TemporaryFolder folder_;
};

TEST_F(BoardFileTest, WhatIsWrittenIsReadBackToTheLastBit) {
  const auto first = Must(Read(std::string(kHead) + kTouches +
                               R"("place": {"at_mm": [-2, 0, -320.1], "sigma_mm": [1, 1, 0.5]},
                             "machine": {"index_rad": 0.03},)" +
                               kViews));
  const auto again = Must(Read(BoardFileText(first, "sheet.json")));
  const auto& a = first.measurement;
  const auto& b = again.measurement;
  EXPECT_EQ(again.date, first.date);
  EXPECT_EQ(b.camera.width_px, 2592);
  EXPECT_EQ(b.camera.pixel_pitch_mm, a.camera.pixel_pitch_mm);
  EXPECT_EQ(b.layout.size(), a.layout.size());
  EXPECT_EQ(b.views[1].picture, "b.png");
  EXPECT_EQ(b.views[1].spindle_mm, a.views[1].spindle_mm);
  EXPECT_EQ(b.views[1].spindle_rotation, a.views[1].spindle_rotation);
  EXPECT_EQ(b.touches[0].mark, "7");
  EXPECT_EQ(b.touches[0].sigma_mm.z(), 0.003);
  EXPECT_TRUE(std::isinf(b.touches[0].sigma_mm.y()));
  EXPECT_EQ(b.place->at_mm, a.place->at_mm);
  EXPECT_EQ(b.place->sigma_mm, a.place->sigma_mm);
  EXPECT_EQ(b.machine.index_rad, 0.03);
  EXPECT_EQ(BoardFileText(again, "sheet.json"), BoardFileText(first, "sheet.json"));
}

TEST_F(BoardFileTest, ReadsPlacesTouchesAndTheSheet) {
  const auto read = Must(Read(std::string(kHead) + kTouches + kViews));
  const auto& measurement = read.measurement;
  ASSERT_EQ(measurement.views.size(), 2U);
  EXPECT_EQ(measurement.views[1].picture, "b.png");
  EXPECT_NEAR(measurement.views[1].spindle_rotation(1, 0), 1, 1e-15);
  EXPECT_EQ(measurement.views[0].spindle_rotation(1, 0), 0);
  ASSERT_EQ(measurement.touches.size(), 1U);
  EXPECT_EQ(measurement.touches[0].mark, "7");
  EXPECT_EQ(measurement.touches[0].sigma_mm.z(), 0.003);
  EXPECT_TRUE(std::isinf(measurement.touches[0].sigma_mm.x()));
  EXPECT_EQ(read.bits, 14);
  EXPECT_EQ(measurement.disc_radius_mm, 3);
  ASSERT_EQ(measurement.layout.size(), 1U);  // not the plain disc
  EXPECT_EQ(measurement.layout[0].id, "7");
  EXPECT_EQ(measurement.layout[0].at_mm.y(), -30);  // up
}

TEST_F(BoardFileTest, NamesThePlaceOfAFault) {
  const std::string head = kHead;
  EXPECT_THAT(Message(head + R"("views": [{"picture": "a", "spindle_mm": [1, 2]}]})"),
              HasSubstr("views[0].spindle_mm"));
  EXPECT_THAT(
      Message(head + R"("views": [{"picture": "a", "spindle_mm": [1, 2, 3], "c_deg": 1000}]})"),
      HasSubstr("c_deg"));
  EXPECT_THAT(Message(head + R"("views": [{"picture": "a", "spindle_mm": [1, 2, 3]},
                                          {"picture": "a", "spindle_mm": [1, 2, 3]}]})"),
              HasSubstr("views[1].picture"));
  EXPECT_THAT(Message(head + R"("touches": [{"mark": 1, "spindle_mm": [1, 2, 3],
                  "tool_length_mm": 1, "axes": "c", "sigma_mm": 1}],)" +
                      kViews),
              HasSubstr("axes"));
  EXPECT_THAT(Message(head + R"("speed": 3,)" + kViews), HasSubstr("speed"));
}

}  // namespace
}  // namespace trammel::files
