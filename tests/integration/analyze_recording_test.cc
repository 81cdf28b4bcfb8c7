// trammel pa analyze on recorded laser scans, from the shell to the answer.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/analyze_result.h"
#include "support/lag_recording.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using test::AnalyzeToJson;
using test::ExpectRefusalText;
using test::ExpectRefused;
using test::ExpectRejected;
using test::LagRecording;
using ::testing::HasSubstr;

// The promise for virtual prints is 2 ms in 95 % of them; these worlds are milder than those.
constexpr double kTolerance_s = 0.002;

// A folder with the recording `rec` in it.
class AnalyzeRecording : public ::testing::Test {
 protected:
  AnalyzeRecording() { fs::create_directory(rec()); }

  [[nodiscard]] const fs::path& folder() const { return folder_.path(); }
  [[nodiscard]] fs::path rec() const { return folder_.path() / "rec"; }
  [[nodiscard]] json Scan() const { return json::parse(test::ReadWhole(rec() / "scan.json")); }
  void WriteScan(const json& scan) const { test::WriteWhole(rec() / "scan.json", scan.dump()); }
  [[nodiscard]] json Analyze(const std::string& options = "") const {
    return AnalyzeToJson("rec " + options, folder());
  }
  void ExpectGood(const json& answer, const LagRecording& recording) const {
    ASSERT_EQ(answer.at("verdict"), "good") << answer.at("reason");
    EXPECT_NEAR(answer.at("pressure_advance_s").get<double>(), recording.law.linear_s, kTolerance_s)
        << "seed " << recording.seed;
  }

 private:
  test::TemporaryFolder folder_;
};

// Enough lines for an answer, few enough to be quick.
LagRecording SixLines() {
  LagRecording recording;
  recording.pressure_advance_s = {0, 0.012, 0.024, 0.036, 0.048, 0.06};
  return recording;
}

TEST_F(AnalyzeRecording, AnswersWithEveryNumberInAgreement) {
  const LagRecording recording;
  WriteRecording(recording, rec());
  const json answer = Analyze("--report page.html");
  ExpectGood(answer, recording);
  EXPECT_EQ(answer.at("method"), "response");
  EXPECT_EQ(answer.at("report"), "page.html");
  EXPECT_THAT(test::ReadWhole(folder() / "page.html"), HasSubstr("</html>"));
  const json& lines = answer.at("lines");
  ASSERT_EQ(lines.size(), recording.pressure_advance_s.size());
  const json* lowest = &lines[0];
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i].at("pressure_advance_s"), recording.pressure_advance_s[i]);
    EXPECT_TRUE(lines[i].at("used").get<bool>());
    if (lines[i].at("deviation_px") < lowest->at("deviation_px")) lowest = &lines[i];
  }
  const json& deviation = answer.at("deviation");
  EXPECT_EQ(deviation.at("best_s"), lowest->at("pressure_advance_s"));
  EXPECT_GT(deviation.at("r_squared"), 0.5);
  ASSERT_EQ(deviation.at("cubic").size(), 4U);
  const double p = deviation.at("cubic_minimum_s");
  const std::vector<double> c = deviation.at("cubic");
  EXPECT_NEAR(c[1] + p * (2 * c[2] + p * 3 * c[3]), 0, 1e-6 * std::abs(c[1]));
  // The sign convention: starved filament's error is positive, falling with rising PA.
  const json& surplus = answer.at("acceleration").at("excess_s");
  EXPECT_GT(surplus.front(), 0);
  EXPECT_LT(surplus.back(), 0);
}

TEST_F(AnalyzeRecording, SaysWhatTheShapeOfTheLinesTellsInWordsAndInJson) {
  const LagRecording recording;
  WriteRecording(recording, rec());
  const json answer = Analyze("");
  const json& law = answer.at("law");
  // A linear lag is the same at all speeds.
  for (const char* key : {"slow_lag_s", "fast_lag_s"}) {
    EXPECT_GT(recording.law.linear_s, law.at(key).at("interval95")[0].get<double>()) << key;
    EXPECT_LT(recording.law.linear_s, law.at(key).at("interval95")[1].get<double>()) << key;
  }
  const double weight = law.at("weight");
  EXPECT_NEAR(weight * law.at("pressure_advance_s").get<double>() +
                  (1 - weight) * law.at("crossings").at("pressure_advance_s").get<double>(),
              answer.at("pressure_advance_s").get<double>(), 1e-9);
  const std::string words = test::RunTrammel("pa analyze rec", folder()).standard_output;
  EXPECT_THAT(words, HasSubstr(fmt::format("  shape of the lines  {:.4f} s",
                                           law.at("pressure_advance_s").get<double>())));
  EXPECT_THAT(words, HasSubstr(fmt::format("counts {:.0f} %\n", 100 * weight)));
  EXPECT_THAT(words, HasSubstr("\n  lag at 150 mm/s "));
  EXPECT_THAT(words, HasSubstr("\n  slip at 150 mm/s "));
  EXPECT_THAT(words, ::testing::EndsWith("\nnothing applied   trammel pa apply rec\n"));
}

TEST_F(AnalyzeRecording, ReadsWhatTheVirtualPrintShopWrites) {
  ASSERT_EQ(test::RunTrammel("pa pattern --material abs", folder()).exit_code, 0);
  fs::remove(rec());
  const auto scan = test::RunTrammel(
      "sim scan pattern.gcode --plan pattern.plan.json --frame 64x64 --seed 11 --out rec",
      folder());
  ASSERT_EQ(scan.exit_code, 0) << scan.output;
  const json truth = json::parse(test::ReadWhole(rec() / "truth.json"));
  const json answer = Analyze();
  ASSERT_EQ(answer.at("verdict"), "good") << answer.at("reason");
  // Guarantee for each pattern: pressure_advance_study counts those within 2 ms.
  const double truth_s = truth.at("pressure_advance_s");
  EXPECT_GT(truth_s, answer.at("interval95_s")[0].get<double>());
  EXPECT_LT(truth_s, answer.at("interval95_s")[1].get<double>());
  EXPECT_LT(answer.at("standard_uncertainty_s").get<double>(), kTolerance_s);
}

TEST_F(AnalyzeRecording, AnswersTheSameWithoutScaleAndWithCaptureTimes) {
  const LagRecording recording = SixLines();
  WriteRecording(recording, rec());
  const json scan = Scan();
  const json reference = Analyze();
  ExpectGood(reference, recording);
  json changed = scan;
  changed.erase("px_per_mm");
  changed["x_note"] = {{"anything", {1, 2, 3}}};
  WriteScan(changed);
  const json without_scale = Analyze();
  ASSERT_EQ(without_scale.at("verdict"), "good") << without_scale.at("reason");
  EXPECT_NEAR(without_scale.at("pressure_advance_s").get<double>(),
              reference.at("pressure_advance_s").get<double>(), 1e-9);
  changed = scan;
  changed["frames_per_s"] = 15;  // only the times count
  for (json& line : changed["lines"]) {
    for (int i = 0; i < 99; ++i) line["frame_times_s"].push_back(1000 + i / 30.0);
  }
  WriteScan(changed);
  const json timed = Analyze();
  ASSERT_EQ(timed.at("verdict"), "good") << timed.at("reason");
  EXPECT_NEAR(timed.at("pressure_advance_s").get<double>(),
              reference.at("pressure_advance_s").get<double>(), 1e-9);
}

TEST_F(AnalyzeRecording, SweepsInEitherDirectionTellTheSame) {
  const LagRecording recording = SixLines();
  WriteRecording(recording, rec());
  json scan = Scan();
  // Every second line was printed to the left, and all were swept to the right.
  Random random(recording.seed + 1);
  for (std::size_t i = 0; i < scan["lines"].size(); ++i) {
    json& line = scan["lines"][i];
    line["sweep_direction"] = "+x";
    line["print_direction"] = i % 2 == 0 ? "+x" : "-x";
    if (i % 2 == 0) continue;
    std::vector<Frame> frames = RecordSweep(recording, line["pressure_advance_s"], random);
    std::reverse(frames.begin(), frames.end());
    test::WriteAvi(rec() / line["video"].get<std::string>(), frames, 0);
  }
  WriteScan(scan);
  ExpectGood(Analyze(), recording);
}

TEST_F(AnalyzeRecording, DoesWithoutALineThatShowsNoLaser) {
  const LagRecording recording = SixLines();
  WriteRecording(recording, rec());
  test::LaserWorld dark = recording.world;
  dark.plate_amplitude = dark.bead_amplitude = 0;
  std::vector<Frame> frames;
  Random random(recording.seed);
  for (int i = 0; i < 99; ++i) frames.push_back(DrawLaserFrame(dark, 0, random));
  test::WriteAvi(rec() / "line4.avi", frames, 0);
  const json answer = Analyze();
  ExpectGood(answer, recording);
  EXPECT_FALSE(answer.at("lines")[4].at("used").get<bool>());
  EXPECT_TRUE(answer.at("acceleration").at("excess_s")[4].is_null());
  EXPECT_TRUE(answer.at("lines")[3].at("used").get<bool>());
}

// Overwrites every video with 30 frames of one kind.
void FillVideos(const json& scan, const fs::path& rec, const std::function<Frame()>& draw) {
  std::vector<Frame> frames;
  for (int i = 0; i < 30; ++i) frames.push_back(draw());
  for (const json& line : scan.at("lines")) {
    test::WriteAvi(rec / line.at("video").get<std::string>(), frames, 30);
  }
}

TEST_F(AnalyzeRecording, RefusesPicturesWithoutLaser) {
  WriteRecording(SixLines(), rec());
  const json scan = Scan();
  const auto flat = [](std::uint8_t level) {
    return [level] {
      Frame frame(45, 60);
      std::fill(frame.bgr.begin(), frame.bgr.end(), level);
      return frame;
    };
  };
  Random random(5);
  const auto noise = [&random] {
    return DrawLaserFrame(test::LaserWorld{.plate_amplitude = 0, .bead_amplitude = 0}, 0, random);
  };
  for (const std::function<Frame()>& draw :
       {std::function<Frame()>(flat(0)), std::function<Frame()>(flat(255)),
        std::function<Frame()>(noise)}) {
    FillVideos(scan, rec(), draw);
    WriteScan(scan);
    ExpectRefused("rec", folder(), {"no line could be measured"});
    json no_crop = scan;
    no_crop.erase("crop_px");
    WriteScan(no_crop);
    ExpectRefused("rec", folder(), {"crop_px", "line3.avi"});
  }
}

TEST_F(AnalyzeRecording, RefusesBrokenVideosByName) {
  LagRecording recording = SixLines();
  WriteRecording(recording, rec());
  const fs::path video = rec() / "line1.avi";
  const std::string whole = test::ReadWhole(video);
  fs::remove(video);
  ExpectRefused("rec", folder(), {"line1.avi", "no such"});
  ExpectRefusalText("rec", folder(), {"line1.avi", "no such"});
  test::WriteWhole(video, whole.substr(0, whole.size() / 2));
  ExpectRefused("rec", folder(), {"line1.avi", "record"});
  test::WriteWhole(video, "");
  ExpectRefused("rec", folder(), {"line1.avi"});
  test::WriteWhole(video, "once upon a time");
  ExpectRefused("rec", folder(), {"line1.avi"});
  test::WriteAvi(video, {}, 99);
  ExpectRefused("rec", folder(), {"line1.avi", "no frame"});
  recording.world.height = 50;
  recording.world.bead_row_px = 25;
  Random random(3);
  test::WriteAvi(video, RecordSweep(recording, 0.012, random), 99);
  ExpectRefused("rec", folder(), {"line1.avi", "45x50", "line0.avi", "45x60"});
}

// The reader's own tests have the rest of what a description can be wrong in.
TEST_F(AnalyzeRecording, RejectsDescriptionsThatCannotBe) {
  WriteRecording(SixLines(), rec());
  const json good = Scan();
  const struct {
    const char* at;
    json value;
    std::vector<std::string> words;
  } cases[] = {
      {"/lines/2/pressure_advance_s", -0.01, {"lines[2].pressure_advance_s", "-0.01", "0"}},
      {"/lines/2/video", "../c.avi", {"lines[2].video", ".."}},
      {"/pa_step", 0.01, {"pa_step", "known"}},
      {"/crop_px/x", 1, {"crop_px", "45x60"}},
  };
  for (const auto& bad : cases) {
    json scan = good;
    scan[json::json_pointer(bad.at)] = bad.value;
    WriteScan(scan);
    SCOPED_TRACE(bad.at);
    ExpectRejected("rec", folder(), bad.words);
  }
  for (const char* text : {"", R"({"format": 1e999})", "\xff\xfe"}) {
    test::WriteWhole(rec() / "scan.json", text);
    SCOPED_TRACE(text);
    ExpectRejected("rec", folder(), {"scan.json"});
  }
}

TEST_F(AnalyzeRecording, RejectsWhatIsNoRecording) {
  ExpectRejected("rec", folder(), {"rec", "no scan.json"});
  ExpectRejected("nowhere", folder(), {"nowhere", "no such file or folder"});
  ExpectRejected("", folder(), {"needs PATH"});
  ExpectRejected("rec --colour", folder(), {"--colour"});
  for (const char* option : {"--pa 0:0.1:0.005", "--segments 1:5", "--start left", "--from bottom",
                             "--plan rec/a.plan.json"}) {
    ExpectRejected("rec " + std::string(option), folder(), {std::string(option).substr(0, 4)});
  }
}

TEST_F(AnalyzeRecording, RejectsAReportThatCannotBeWritten) {
  LagRecording recording = SixLines();
  recording.pressure_advance_s.resize(4);
  WriteRecording(recording, rec());
  ExpectRejected("rec --report nowhere/page.html", folder(), {"--report", "nowhere", "folder"});
  EXPECT_FALSE(fs::exists(folder() / "nowhere"));
  test::WriteWhole(folder() / "taken", "a file");
  ExpectRejected("rec --figures taken", folder(), {"--figures", "taken"});
}

}  // namespace
}  // namespace trammel
