#include "pressure_advance/files/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "base/check.h"
#include "base/frame.h"
#include "support/sweep_world.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

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

// Given a scan that stopped before it had placed a frame.
class UnplacedScan : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name) << text;
  }
  Error Read() {
    const auto scan = ReadScan(folder_.path());
    return scan ? Error{} : scan.error();
  }
  test::TemporaryFolder folder_;
};

TEST_F(UnplacedScan, ThatEndedInItsFirstLineSaysWhatIsMissing) {
  Write("sweeps.json", R"({"format": 1, "kind": "laser_sweeps", "sweeps": []})");
  Write("line0.avi.times",
        "# trammel frame times, format 1\n# frame\n0 1.5 - - - - - none\n- 1.6 - - - - - cut_off\n"
        "1 1.7 - - - - - none\n2 1.");
  const Error error = Read();
  EXPECT_EQ(error.kind, ErrorKind::kMeasurement);
  EXPECT_THAT(error.message,
              AllOf(HasSubstr(folder_.path().string()), HasSubstr("ended in its first sweep"),
                    HasSubstr("2 frames in line0.avi"), HasSubstr("scan the pattern again")));
}

TEST_F(UnplacedScan, WhoseFramesHaveNoPlaceSaysWhy) {
  Write("sweeps.json", R"({"format": 1, "sweeps": [{"video": "line0.avi"}, {"video": "line1.avi"}],
    "not_placed": [{"video": "line0.avi", "why": "x"},
                   {"video": "line1.avi", "why": "frames came up to 186 ms late"}]})");
  const Error error = Read();
  EXPECT_EQ(error.kind, ErrorKind::kMeasurement);
  EXPECT_THAT(error.message,
              AllOf(HasSubstr("2 sweeps"), HasSubstr("line1.avi: frames came up to 186 ms late")));
}

TEST_F(UnplacedScan, OfNonsenseNamesTheFile) {
  for (const char* text : {"", "[]", "7", R"({"sweeps": 3})", R"({"swee)"}) {
    Write("sweeps.json", text);
    const Error error = Read();
    EXPECT_EQ(error.kind, ErrorKind::kInput) << text;
    EXPECT_THAT(error.message, HasSubstr("sweeps.json")) << text;
  }
  Write("sweeps.json", R"({"sweeps": [1], "not_placed": [3]})");
  EXPECT_EQ(Read().kind, ErrorKind::kMeasurement);
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
      {"/px_per_mm_sigma", 0, "px_per_mm_sigma", "1000"},
      {"/laser_angle_deg", 90, "laser_angle_deg", "85"},
      {"/laser_angle_sigma_deg", 11, "laser_angle_sigma_deg", "10"},
      {"/height_direction", "-z", "height_direction", "-z"},
      {"/crop_px/x", -1, "crop_px.x", "-1"},
      {"/found_crop_px",
       {{"x", 0}, {"y", 0}, {"width", 7}, {"height", 9}},
       "found_crop_px.width",
       "7"},
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

TEST(ReadScan, RefusesPositionsThatNoSweepCanHave) {
  struct Case {
    json value;
    const char* says;
  };
  const std::vector<Case> cases{
      {json::array(), "lines[0].frame_positions_mm"},
      {{1}, "lines[0].frame_positions_mm"},
      {"all", "must be a list"},
      {{nullptr, 1, nullptr}, "has 1 number(s); it must have at least 2"},
      {{nullptr, nullptr}, "has 0 number(s)"},
      {{1, 2, "3"}, "frame_positions_mm[2] is \"3\"; it must be a number or null"},
      {{1, true}, "frame_positions_mm[1]"},
      {{1, 2000.5}, "frame_positions_mm[1] is 2000.5"},
      {{-2001, 2}, "frame_positions_mm[0] is -2001"},
      {{1, 1}, "frame_positions_mm[1] is 1 after 1; the positions must all rise or all fall"},
      {{1, nullptr, 2, nullptr, 1.5}, "frame_positions_mm[4] is 1.5 after 2"},
      {{3, 2, nullptr, 2}, "frame_positions_mm[3] is 2 after 2"},
  };
  for (const Case& one : cases) {
    EXPECT_THAT(MessageWith("/lines/0/frame_positions_mm", one.value), HasSubstr(one.says))
        << one.value;
  }
  EXPECT_THAT(MessageWith("/lines/1/frame_positions_mm", {1, 2}),
              HasSubstr("lines[1].frame_positions_mm has 2 entries, frame_times_s 3"));
}

/// A scan with everything that one can say.
pressure_advance::Scan FullScan() {
  pressure_advance::Scan scan;
  scan.frames_per_s = 29.97;
  scan.scan_speed_mm_s = 20.0 / 3;
  scan.px_per_mm = 44.1;
  scan.px_per_mm_sigma = 0.07;
  scan.laser_angle_sigma_rad = 0.2 * std::numbers::pi / 180;
  scan.laser_angle_rad = 40 * std::numbers::pi / 180;
  scan.height_direction = AxisDirection::kPlusY;
  scan.crop = PixelRect{837, 341, 45, 60};
  scan.found_crop = PixelRect{820, 315, 83, 114};
  scan.line_start_mm = 0.1;
  scan.motion = {.segments = {{1.0 / 3, 5}, {1.0 / 3, 150}, {1.0 / 3, 7.5}},
                 .length_mm = 40,
                 .acceleration_mm_s2 = 4000};
  scan.lines.resize(2);
  scan.commanded_area_mm2 = 0.1104;
  scan.opaque_plate = true;
  scan.lines[0].video = "a/line0.avi";
  scan.lines[0].frame_times_s = {1.0 / 3, 0.5, 123456.789012345};
  scan.lines[0].frame_positions_mm = {std::nullopt, 4.1, 1.0 / 3};
  scan.lines[1].pattern = 3;
  scan.lines[1].pressure_advance_s = 0.006666666666666667;
  scan.lines[1].video = "line \"1\".avi";
  scan.lines[1].print_direction = AxisDirection::kMinusY;
  scan.lines[1].sweep_direction = AxisDirection::kPlusY;
  return scan;
}

TEST(FormatScan, ReadsBackAsTheSameScanWithOrWithoutKeysOfOnesOwn) {
  pressure_advance::Scan sparse = FullScan();
  sparse.px_per_mm.reset();
  sparse.crop.reset();
  sparse.found_crop.reset();
  sparse.lines.resize(1);
  for (const auto& scan : {FullScan(), sparse}) {
    for (const json& extra : {json(), json::object(),
                              json{{"x_note", "a\xff\n"}, {"x_steps", {1, {{"a", nullptr}}}}}}) {
      const std::string text = FormatScan(scan, extra);
      const auto read = ParseScan(text, "scan.json");
      ASSERT_TRUE(read.has_value()) << read.error().message << '\n' << text;
      EXPECT_EQ(FormatScan(*read, extra), text);
      EXPECT_NEAR(read->laser_angle_rad, scan.laser_angle_rad, 1e-10);
      EXPECT_EQ(read->commanded_area_mm2, scan.commanded_area_mm2);
      EXPECT_EQ(read->opaque_plate, scan.opaque_plate);
      EXPECT_EQ(read->lines[0].frame_positions_mm, scan.lines[0].frame_positions_mm);
      EXPECT_EQ(text.find("x_note") != std::string::npos, extra.contains("x_note"));
    }
  }
  EXPECT_THAT(FormatScan(FullScan(), json()), HasSubstr("\"laser_angle_deg\": 40.0,\n"));
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

TEST(HeightScale, CarriesWhatScaleAndAngleLeaveOpen) {
  pressure_advance::Scan scan = FullScan();
  const auto known = HeightScaleOf(scan);
  ASSERT_TRUE(known && known->height_share && known->area_share);
  // Heights and areas scale with scale and angle.
  const auto height = [](double px_per_mm, double angle_rad) {
    return 1 / (px_per_mm * std::tan(angle_rad));
  };
  const double scale = *scan.px_per_mm, angle = scan.laser_angle_rad;
  const double by_scale = height(scale - *scan.px_per_mm_sigma, angle) / height(scale, angle) - 1;
  const double by_angle =
      height(scale, angle - *scan.laser_angle_sigma_rad) / height(scale, angle) - 1;
  EXPECT_NEAR(known->height_mm_per_px, height(scale, angle), 1e-12);
  EXPECT_NEAR(*known->height_share, std::hypot(by_scale, by_angle), 1e-4);
  EXPECT_NEAR(*known->area_share, std::hypot(2 * by_scale, by_angle), 1e-4);
  scan.laser_angle_sigma_rad.reset();
  EXPECT_FALSE(HeightScaleOf(scan)->height_share);
  scan.px_per_mm.reset();
  EXPECT_FALSE(HeightScaleOf(scan));
}

const CameraKeys kKeys = {{"offset_x", "28.5"}, {"crop", "[1, 2, 30, 40]"}};

TEST(PutCameraKeys, AddsASectionWhereThereIsNone) {
  EXPECT_EQ(PutCameraKeys("", kKeys), "[camera]\noffset_x = 28.5\ncrop = [1, 2, 30, 40]\n");
  EXPECT_EQ(PutCameraKeys("[scan]\nspeed = 5", kKeys),
            "[scan]\nspeed = 5\n\n[camera]\noffset_x = 28.5\ncrop = [1, 2, 30, 40]\n");
}

TEST(PutCameraKeys, LeavesAllElseAsItIsAndOldValuesAsComments) {
  const std::string text =
      "# mine\n[camera]\nurl = \"http://a/b?[x]\"  # stays\n  offset_x = 27 # measured\n"
      "crop = [\n  5, 6,\n  7, 8]\noffset_y = 50\n[scan]\noffset_x_of_mine = 1\n";
  EXPECT_EQ(PutCameraKeys(text, kKeys),
            "# mine\n[camera]\noffset_x = 28.5\ncrop = [1, 2, 30, 40]\n"
            "url = \"http://a/b?[x]\"  # stays\n# before pa setup: offset_x = 27 # measured\n"
            "# before pa setup: crop = [\n# before pa setup: 5, 6,\n# before pa setup: 7, 8]\n"
            "offset_y = 50\n[scan]\noffset_x_of_mine = 1\n");
}

TEST(PutCameraKeys, ComesToAnEndInWhateverIsWritten) {
  for (const char* text :
       {"[camera", "[camera]\ncrop = [", "=\n[camera]\n=\n[", "\r\n\r\n[camera]\r\n"}) {
    EXPECT_THAT(PutCameraKeys(text, kKeys), HasSubstr("offset_x = 28.5")) << text;
  }
}

}  // namespace
}  // namespace trammel::files
