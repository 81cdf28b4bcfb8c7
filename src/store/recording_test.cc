#include "store/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "support/laser_world.h"

namespace trammel::store {
namespace {

using nlohmann::json;
using pressure_advance::AxisDirection;
using testing::AllOf;
using testing::HasSubstr;

json Valid() {
  return json::parse(R"({"format": 1, "eye": "laser", "scan_speed_mm_s": 6.667, "px_per_mm": 44.0,
    "crop_px": {"x": 837, "y": 341, "width": 45, "height": 60},
    "lines": [{"pressure_advance_s": 0.0, "video": "line0.avi"},
              {"pressure_advance_s": 0.02, "video": "line1.avi", "print_direction": "-x",
               "sweep_direction": "+x", "frame_times_s": [0.5, 0.6, 0.75]}]})");
}

std::string Message(const std::string& text) {
  const auto scan = ParseScan(text, "scan.json");
  if (scan) {
    return "";
  }
  EXPECT_EQ(scan.error().kind, ErrorKind::kInput);
  return scan.error().message;
}

/// The message for the valid scan with one JSON pointer set to a value.
std::string MessageWith(const std::string& pointer, const json& value) {
  json scan = Valid();
  scan[json::json_pointer(pointer)] = value;
  return Message(scan.dump());
}

TEST(ReadScan, TakesDefaultsFromTheFormat) {
  const auto scan = ParseScan(Valid().dump(), "scan.json");
  ASSERT_TRUE(scan.has_value()) << scan.error().message;
  EXPECT_EQ(scan->frames_per_s, 30);
  EXPECT_NEAR(scan->laser_angle_rad, std::numbers::pi / 4, 1e-12);
  EXPECT_EQ(scan->height_direction, AxisDirection::kMinusX);
  EXPECT_EQ(scan->line_start_mm, 4);
  EXPECT_EQ(scan->motion.length_mm, 30);
  EXPECT_EQ(scan->motion.acceleration_mm_s2, 3000);
  ASSERT_EQ(scan->motion.segments.size(), 3U);
  EXPECT_EQ(scan->motion.segments[1].speed_mm_s, 150);
  EXPECT_EQ(scan->crop->height, 60);
  EXPECT_EQ(scan->lines[1].frame_times_s.size(), 3U);
  EXPECT_EQ(scan->lines[1].sweep_direction, AxisDirection::kPlusX);
}

TEST(ReadScan, IgnoresKeysOfOnesOwnAndRefusesUnknownOnes) {
  EXPECT_EQ(MessageWith("/x_camera", "endoscope"), "");
  EXPECT_EQ(MessageWith("/lines/0/x_note", {1, 2}), "");
  EXPECT_THAT(MessageWith("/px_per_mmm", 44), HasSubstr("px_per_mmm"));
  EXPECT_THAT(MessageWith("/lines/1/vidoe", "a"), AllOf(HasSubstr("lines[1]"), HasSubstr("vidoe")));
  EXPECT_THAT(MessageWith("/crop_px/depth", 1), AllOf(HasSubstr("crop_px"), HasSubstr("depth")));
}

TEST(ReadScan, NamesThePathTheValueAndTheBound) {
  struct Case {
    const char* pointer;
    json value;
    const char* path;
    const char* detail;
  };
  const std::vector<Case> cases{
      {"/format", 2, "format", "2"},
      {"/eye", "photo", "eye", "photo"},
      {"/lines", json::array(), "lines", "1000"},
      {"/lines", "all", "lines", "list"},
      {"/lines/1/pressure_advance_s", -0.1, "lines[1].pressure_advance_s", "-0.1"},
      {"/lines/1/pressure_advance_s", 11, "lines[1].pressure_advance_s", "10"},
      {"/lines/1/pressure_advance_s", "0.1", "lines[1].pressure_advance_s", "number"},
      {"/lines/1/pressure_advance_s", nullptr, "lines[1].pressure_advance_s", "null"},
      {"/lines/1/pressure_advance_s", 0.0, "lines[1].pressure_advance_s", "lines[0]"},
      {"/lines/0/video", 7, "lines[0].video", "7"},
      {"/lines/0/video", "../line0.avi", "lines[0].video", "'..'"},
      {"/lines/0/video", "a/../../b.avi", "lines[0].video", "'..'"},
      {"/lines/0/video", "/etc/passwd", "lines[0].video", "absolute"},
      {"/lines/0/video", "", "lines[0].video", "name"},
      {"/lines/0/print_direction", "up", "lines[0].print_direction", "+x"},
      {"/lines/0/sweep_direction", "+y", "lines[0].sweep_direction", "across"},
      {"/lines/1/frame_times_s", {0.1, 0.1}, "lines[1].frame_times_s[1]", "increase"},
      {"/lines/1/frame_times_s", {0.1, "b"}, "lines[1].frame_times_s[1]", "number"},
      {"/frames_per_s", 0, "frames_per_s", "1"},
      {"/scan_speed_mm_s", 0, "scan_speed_mm_s", "1000"},
      {"/px_per_mm", 0.5, "px_per_mm", "10000"},
      {"/laser_angle_deg", 90, "laser_angle_deg", "85"},
      {"/height_direction", "-z", "height_direction", "-z"},
      {"/crop_px/x", -1, "crop_px.x", "-1"},
      {"/crop_px/width", 45.5, "crop_px.width", "whole"},
      {"/crop_px/width", 1e300, "crop_px.width", "whole"},
      {"/line_start_mm", 31, "line_start_mm", "30"},
      {"/line_length_mm", -30, "line_length_mm", "2000"},
      {"/acceleration_mm_s2", 0, "acceleration_mm_s2", "1000000"},
      {"/segments", {{{"fraction", 0.5}, {"speed_mm_s", 5}}}, "segments", "0.5"},
      {"/segments", json::array(), "segments", "1"},
  };
  for (const Case& one : cases) {
    EXPECT_THAT(MessageWith(one.pointer, one.value),
                AllOf(HasSubstr("scan.json"), HasSubstr(one.path), HasSubstr(one.detail)))
        << one.pointer << " = " << one.value;
  }
}

TEST(ReadScan, SaysWhichKeyIsMissing) {
  for (const char* key : {"format", "eye", "lines", "scan_speed_mm_s"}) {
    json scan = Valid();
    scan.erase(key);
    EXPECT_THAT(Message(scan.dump()), AllOf(HasSubstr(key), HasSubstr("missing")));
  }
}

TEST(ReadScan, RefusesWhatIsNotStrictJson) {
  EXPECT_NE(Message(""), "");
  EXPECT_NE(Message("[]"), "");
  EXPECT_NE(Message(R"({"format": NaN})"), "");
  EXPECT_NE(Message(R"({"format": 1e999})"), "");
  EXPECT_NE(Message(R"({"format": 1,)"), "");
  EXPECT_NE(Message(std::string(100000, '[')), "");
  EXPECT_THAT(Message(R"({"format": 1, "format": 1})"), HasSubstr("format"));
}

TEST(ReadScan, SaysWhatAFolderLacks) {
  const test::TemporaryFolder folder;
  const auto nothing = ReadScan(folder.path());
  ASSERT_FALSE(nothing.has_value());
  EXPECT_THAT(nothing.error().message, HasSubstr("scan.json"));
  const auto nowhere = ReadScan(folder.path() / "none");
  ASSERT_FALSE(nowhere.has_value());
  EXPECT_THAT(nowhere.error().message, HasSubstr("none"));
  std::ofstream(folder.path() / "scan.json") << Valid().dump();
  EXPECT_TRUE(ReadScan(folder.path()).has_value());
}

TEST(FormatScan, ReadsBackAsTheSameScan) {
  json full = Valid();
  full["height_direction"] = "+y";
  full["laser_angle_deg"] = 40;
  full["lines"][0]["frame_positions_mm"] = {nullptr, 4.25, 4.5, nullptr, 4.75};
  const auto first = ParseScan(full.dump(), "scan.json");
  ASSERT_TRUE(first.has_value()) << first.error().message;
  const std::string text = FormatScan(*first, {{"x_camera", "somewhere"}});
  const auto second = ParseScan(text, "again.json");
  ASSERT_TRUE(second.has_value()) << second.error().message;
  EXPECT_EQ(FormatScan(*second, {{"x_camera", "somewhere"}}), text);
  EXPECT_EQ(second->lines[0].frame_positions_mm, first->lines[0].frame_positions_mm);
  EXPECT_EQ(second->lines[1].frame_times_s, first->lines[1].frame_times_s);
  EXPECT_EQ(second->crop->width, 45);
  EXPECT_THAT(text, HasSubstr("x_camera"));
}

TEST(ReadScan, PositionsOfFramesRiseOrFallAndAtLeastTwoAreKnown) {
  const std::string key = "/lines/0/frame_positions_mm";
  EXPECT_EQ(MessageWith(key, {nullptr, 4.0, 5.0}), "");
  EXPECT_EQ(MessageWith(key, {5.0, nullptr, 4.0}), "");
  EXPECT_THAT(MessageWith(key, {4.0, 5.0, 4.5}), HasSubstr("frame_positions_mm[2] is 4.5 after 5"));
  EXPECT_THAT(MessageWith(key, {4.0, nullptr}), HasSubstr("at least 2"));
  EXPECT_THAT(MessageWith(key, {4.0, "5"}), HasSubstr("number or null"));
  EXPECT_THAT(MessageWith(key, {4.0, 1e9}), HasSubstr("2000"));
}

}  // namespace
}  // namespace trammel::store
