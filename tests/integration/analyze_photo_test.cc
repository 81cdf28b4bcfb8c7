// trammel pa analyze on photos that are drawn or taken of virtual prints, from the shell to the
// answer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/photo/photo_test_support.h"
#include "support/analyze_result.h"
#include "support/matchers.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using pressure_advance::DrawnPhoto;
using pressure_advance::ToMat;
using test::AnalyzeToJson;
using test::ExpectRefusalText;
using test::ExpectRefused;
using test::ExpectRejected;
using ::testing::HasSubstr;
using ::testing::Not;

// Half a step of the drawn lines: what is promised for real photos.
constexpr double kTolerance_s = 0.0025;
constexpr const char* kPa = "--pa 0:0.06:0.005";

// A folder in which photo.jpg can be put.
class AnalyzePhoto : public ::testing::Test {
 protected:
  AnalyzePhoto() { drawn_.pressure_advance_s = pressure_advance::Steps(); }

  [[nodiscard]] const fs::path& folder() const { return folder_.path(); }
  void Write(const cv::Mat& picture, const std::string& name = "photo.jpg") const {
    ASSERT_TRUE(cv::imwrite((folder() / name).string(), picture));
  }
  [[nodiscard]] json Analyze(const std::string& options = "",
                             const test::RunLimits& limits = {}) const {
    return AnalyzeToJson("photo.jpg " + std::string(kPa) + " " + options, folder(), limits);
  }
  void ExpectAnswer(const json& answer, double right_s) const {
    ASSERT_EQ(answer.at("verdict"), "good") << answer.at("reason");
    EXPECT_NEAR(answer.at("pressure_advance_s").get<double>(), right_s, kTolerance_s);
  }

  DrawnPhoto drawn_;

 private:
  test::TemporaryFolder folder_;
};

TEST_F(AnalyzePhoto, AnswersWithFiguresAndReport) {
  Write(ToMat(Draw(drawn_)));
  const json answer = Analyze("--report page.html --figures figures");
  ExpectAnswer(answer, drawn_.right_value_s);
  EXPECT_EQ(answer.at("lines").size(), drawn_.pressure_advance_s.size());
  for (const char* key : {"best_s", "cubic_minimum_s", "r_squared"}) {
    EXPECT_TRUE(answer.at("deviation").at(key).is_null()) << key;
  }
  EXPECT_THAT(test::ReadWhole(folder() / "page.html"), HasSubstr("</html>"));
  EXPECT_FALSE(fs::is_empty(folder() / "figures"));
}

TEST_F(AnalyzePhoto, ReadsWhatTheVirtualPrintShopShoots) {
  ASSERT_EQ(test::RunTrammel("pa pattern --material abs --set preset=paper", folder()).exit_code,
            0);
  ASSERT_THAT(test::RunTrammel("sim photo pattern.gcode --seed 3 --size 720x1280 "
                               "--pressure-advance 0.025 --out photo.jpg",
                               folder()),
              Ends(0));
  const json answer =
      AnalyzeToJson("photo.jpg --pa 0:0.06:10 --segments 0.25:5,0.5:150,0.25:5", folder());
  ExpectAnswer(answer, 0.025);
}

TEST_F(AnalyzePhoto, TakesValuesAndSegmentsFromThePlanOfThePrint) {
  ASSERT_THAT(
      test::RunTrammel(
          "pa pattern --material abs --pa 0:0.06:0.005 --set "
          "'segments=[{fraction=0.15,speed=10},{fraction=0.6,speed=100},{fraction=0.25,speed=10}]' "
          "--set preset=paper --set "
          "line_spacing=1.5",
          folder()),
      Ends(0));
  ASSERT_THAT(test::RunTrammel("sim photo pattern.gcode --seed 3 --size 720x1280 "
                               "--pressure-advance 0.025 --out photo.jpg",
                               folder()),
              Ends(0));
  const json planned = AnalyzeToJson("photo.jpg --plan pattern.plan.json", folder());
  ExpectAnswer(planned, 0.025);
  for (const json& notice : planned.at("notices")) {
    EXPECT_THAT(notice.get<std::string>(), Not(HasSubstr("was given")));
  }
  const json told =
      AnalyzeToJson("photo.jpg --pa 0:0.06:0.005 --segments 0.15:10,0.6:100,0.25:10", folder());
  EXPECT_EQ(planned.at("pressure_advance_s"), told.at("pressure_advance_s"));
  EXPECT_EQ(planned.at("lines"), told.at("lines"));
}

// Printed for a photo, photographed, and handed on mirrored and turned as chats do.
TEST_F(AnalyzePhoto, ReadsThePatternForAPhotoAnyWayUp) {
  ASSERT_EQ(test::RunTrammel("pa pattern --material abs --photo", folder()).exit_code, 0);
  ASSERT_THAT(test::RunTrammel("sim photo pattern.gcode --seed 4 --size 1080x1440 "
                               "--pressure-advance 0.042 --out photo.jpg",
                               folder()),
              Ends(0));
  const cv::Mat upright = cv::imread((folder() / "photo.jpg").string());
  const json reference = AnalyzeToJson("photo.jpg --plan pattern.plan.json", folder());
  ExpectAnswer(reference, 0.042);
  for (const int code : {-1, 0, 1}) {
    cv::Mat flipped;
    cv::flip(upright, flipped, code);
    Write(flipped, "flipped.png");
    for (const char* told : {"--photo", "--plan pattern.plan.json"}) {
      const json answer = AnalyzeToJson(std::string("flipped.png ") + told, folder());
      ExpectAnswer(answer, 0.042);
      EXPECT_THAT(answer.at("notices").dump(), Not(HasSubstr("was given")));
    }
  }
}

// A list that was printed, and is not that of the usual pattern: guessed, it would answer 0.0411 s.
TEST_F(AnalyzePhoto, TakesNoListThatNobodyNamed) {
  fs::create_directories(folder() / "state");
  ASSERT_EQ(setenv("XDG_STATE_HOME", (folder() / "state").c_str(), 1), 0);
  ASSERT_EQ(
      test::RunTrammel("pa pattern --material abs --photo --pa 0:0.05:0.0025", folder()).exit_code,
      0);
  ASSERT_THAT(test::RunTrammel("sim photo pattern.gcode --seed 4 --size 1080x1440 "
                               "--pressure-advance 0.02 --out photo.jpg",
                               folder()),
              Ends(0));
  fs::create_directories(folder() / "downloads");
  fs::rename(folder() / "photo.jpg", folder() / "downloads" / "photo.jpg");
  // Neither beside a plan nor after a print that is noted.
  for (const char* options : {"", " --photo", " --from bottom"}) {
    ExpectRefused("downloads/photo.jpg" + std::string(options), folder(),
                  {"No plan", "photo.jpg", "--plan", "--gcode", "--pa"});
  }
  // Beside its plan.
  const auto beside = folder() / "downloads" / "pattern.plan.json";
  fs::copy_file(folder() / "pattern.plan.json", beside);
  for (const char* options : {"", " --photo"}) {
    const json answer = AnalyzeToJson("downloads/photo.jpg" + std::string(options), folder());
    ExpectAnswer(answer, 0.02);
    EXPECT_THAT(answer.at("notices").dump(),
                Containing("21 from 0 to 0.05 s", "pattern.plan.json"));
  }
  // The same plan twice is one; two lists are none.
  fs::copy_file(beside, folder() / "downloads" / "copy.plan.json");
  ExpectAnswer(AnalyzeToJson("downloads/photo.jpg", folder()), 0.02);
  ASSERT_EQ(
      test::RunTrammel("pa pattern --material abs --photo --out downloads/other.gcode", folder())
          .exit_code,
      0);
  ExpectRejected("downloads/photo.jpg", folder(),
                 {"cannot tell which values", "copy.plan.json and other.plan.json", "--plan"});
  fs::remove(folder() / "downloads" / "other.plan.json");
  // A plan that no photo can be of says why.
  fs::remove(beside);
  test::WriteWhole(folder() / "downloads" / "copy.plan.json", "{}");
  ExpectRejected("downloads/photo.jpg", folder(), {"copy.plan.json", "format is missing"});
  fs::remove(folder() / "downloads" / "copy.plan.json");
  // The last print that is noted, unless the photo is older.
  const auto note = [&](const char* utc, const std::string& printer, const fs::path& run) {
    Must(files::NotePatternPrint(folder() / "state" / "trammel" / files::kPatternPrintsFile,
                                 {utc, printer, run.string(), "", true, {}}));
  };
  fs::create_directories(folder() / "state" / "trammel");
  note("2026-01-02T00:00:00Z", "voron", folder());
  const json printed = AnalyzeToJson("downloads/photo.jpg", folder());
  ExpectAnswer(printed, 0.02);
  EXPECT_THAT(printed.at("notices").dump(), Containing("21 from 0 to 0.05 s", "of the last print"));
  note("2999-01-02T00:00:00Z", "voron", folder());
  ExpectRejected("downloads/photo.jpg", folder(),
                 {"cannot tell which values", "older than the pattern's last print"});
  unsetenv("XDG_STATE_HOME");
}

TEST_F(AnalyzePhoto, RejectsPlansThatCannotBe) {
  Write(cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(90)));
  ExpectRejected("photo.jpg --plan none.plan.json", folder(), {"none.plan.json", "no such file"});
  test::WriteWhole(folder() / "a.plan.json", R"({"format": 1})");
  ExpectRejected("photo.jpg --plan a.plan.json", folder(), {"a.plan.json", "kind is missing"});
  ExpectRejected("photo.jpg --plan a.plan.json --pa 0:0.1:0.01", folder(), {"--plan", "--pa"});
  ExpectRejected("photo.jpg --plan a.plan.json --segments 0.1:10,0.6:100,0.3:10", folder(),
                 {"--plan", "--segments"});
  ASSERT_EQ(test::RunTrammel("pa pattern --material abs --set alternate_directions=true", folder())
                .exit_code,
            0);
  ExpectRejected("photo.jpg --plan pattern.plan.json", folder(),
                 {"pattern.plan.json", "opposite directions"});
}

TEST_F(AnalyzePhoto, PrintsTheAnswerAlsoWhereItsFilesCannotBeWritten) {
  Write(ToMat(Draw(drawn_)));
  // A folder in which nobody can make a file, root neither.
  const auto run = test::RunTrammel(
      "pa analyze photo.jpg --json --report /proc/page.html --figures figures " + std::string(kPa),
      folder());
  EXPECT_THAT(run, Fails(1, "page.html: cannot be written"));
  const json answer = json::parse(run.standard_output);
  ExpectAnswer(answer, drawn_.right_value_s);
  EXPECT_TRUE(answer.at("report").is_null());
  EXPECT_FALSE(fs::is_empty(folder() / "figures"));
}

TEST_F(AnalyzePhoto, RefusesPicturesWithoutAPattern) {
  DrawnPhoto empty = drawn_;
  empty.frame = false;
  empty.bead_mm = 0;
  DrawnPhoto no_lines = drawn_;
  no_lines.bead_mm = 0;
  const cv::Mat pictures[] = {ToMat(Draw(empty)), ToMat(Draw(no_lines)),
                              cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(0)),
                              cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255)),
                              cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(99))};
  for (const cv::Mat& picture : pictures) {
    Write(picture);
    ExpectRefused("photo.jpg " + std::string(kPa), folder(), {"photo.jpg"});
  }
  ExpectRefusalText("photo.jpg " + std::string(kPa), folder(), {"photo.jpg"});
}

// No option, no plan and no numbers: kept as any refusal is.
TEST_F(AnalyzePhoto, KeepsTheReportOfAPhotoWithoutAnyOption) {
  ASSERT_EQ(test::RunTrammel("pa pattern --material abs --photo", folder()).exit_code, 0);
  ASSERT_THAT(test::RunTrammel("sim photo pattern.gcode --seed 4 --size 1080x1440 --out photo.jpg",
                               folder()),
              Ends(0));
  fs::remove(folder() / "pattern.plan.json");
  ExpectRefused("photo.jpg --report seen.html --figures seen --result seen.json", folder(),
                {"photo.jpg", "numbers cannot be read", "--gcode", "--pa"});
  Write(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255)));
  ExpectRefused("photo.jpg --report none.html --figures none --result none.json", folder(),
                {"photo.jpg", "no equally spaced lines"});
  for (const std::string name : {"seen", "none"}) {
    EXPECT_TRUE(fs::exists(folder() / name / "answer.png"));
    EXPECT_TRUE(fs::exists(folder() / name / "photo.png"));
    EXPECT_EQ(
        json::parse(test::ReadWhole(folder() / (name + ".json"))).at("answers")[0].at("verdict"),
        "refused");
  }
  EXPECT_THAT(test::ReadWhole(folder() / "seen.html"), HasSubstr("The outline holds"));
  EXPECT_THAT(test::ReadWhole(folder() / "none.html"), HasSubstr("No pattern was found in it"));
}

// Prints another tool's pattern as `name`.gcode, and returns its photo, `name`.jpg.
cv::Mat Shoot(const fs::path& folder, const std::string& pattern, const std::string& name,
              const std::string& size = "1600x1200") {
  const std::string gcode = name + ".gcode", photo = name + ".jpg";
  EXPECT_THAT(test::RunTrammel("sim pattern " + pattern + " -o " + gcode, folder), Ends(0));
  EXPECT_THAT(test::RunTrammel("sim photo " + gcode +
                                   " --phone --scene black-on-gold --pressure-advance 0.045 "
                                   "--seed 33 -o " +
                                   photo + " --size " + size,
                               folder),
              Ends(0));
  return cv::imread((folder / photo).string());
}

TEST_F(AnalyzePhoto, ReadsABatchInOnePictureAndRefusesItMirrored) {
  cv::Mat picture =
      Shoot(folder(), "orca-batch --pa 0:0.08:0.005 --speeds 100,150 --accelerations 1000", "batch",
            "2400x1800");
  const auto end = test::RunTrammel("pa photo batch.jpg --gcode batch.gcode --json", folder());
  ASSERT_THAT(end, Ends(0));
  const json told = json::parse(end.standard_output);
  ASSERT_EQ(told.at("patterns").size(), 2U);
  for (const json& pattern : told.at("patterns")) {
    ASSERT_EQ(pattern.at("verdict"), "good") << pattern.at("reason");
    EXPECT_LT(pattern.at("interval95_s")[0], 0.045);
    EXPECT_GT(pattern.at("interval95_s")[1], 0.045);
  }
  cv::flip(picture, picture, 1);
  Write(picture);
  ExpectRefusalText("photo.jpg --gcode batch.gcode", folder(), {"mirrored", "its numbers"});
  const auto refused = test::RunTrammel("pa photo photo.jpg --gcode batch.gcode --json", folder());
  const json why = json::parse(refused.standard_output).at("patterns");
  ASSERT_EQ(why.size(), 2U);
  EXPECT_EQ(why[1].at("verdict"), "refused");
  EXPECT_THAT(why[1].at("reason").get<std::string>(), HasSubstr("mirrored"));
}

// Side by side, one above the other, and of both kinds: neither is taken silently.
TEST_F(AnalyzePhoto, NamesTwoPatternsInOnePicture) {
  const auto shoot = [&](const char* pattern, const char* name) {
    return Shoot(folder(), pattern, name);
  };
  const cv::Mat lines = shoot("marlin-lines --pa 0:0.1:0.005", "lines");
  const cv::Mat corners = shoot("ellis --pa 0:0.08:0.005", "corners");
  const cv::Mat others = shoot("marlin-lines --pa 0:0.2:0.01", "others");
  // The file of the other print.
  ExpectRefused("lines.jpg --gcode corners.gcode", folder(), {"20 lines are seen", "this print?"});
  ExpectRefused("corners.jpg --gcode lines.gcode", folder(), {"corners are seen", "this print?"});
  cv::Mat both;
  cv::hconcat(lines, lines, both);
  Write(both);
  for (const char* options : {"", " --gcode lines.gcode", " --pattern marlin-lines"}) {
    ExpectRefused("photo.jpg" + std::string(options), folder(),
                  {"two patterns", "20 lines and one of 20 lines", "cut the picture"});
  }
  cv::vconcat(lines, corners, both);
  Write(both);
  ExpectRefused("photo.jpg", folder(), {"two patterns", "20 lines", "17 corners"});
  cv::hconcat(corners, corners, both);
  Write(both);
  ExpectRefused("photo.jpg", folder(), {"two patterns", "corners and one of", "--gcode"});
  // The numbers beside one of them are those of the file.
  cv::hconcat(others, lines, both);
  Write(both);
  ExpectRefused("photo.jpg", folder(), {"two patterns"});
  for (const char* gcode : {"lines.gcode", "others.gcode"}) {
    const json told = AnalyzeToJson("photo.jpg --gcode " + std::string(gcode), folder());
    ASSERT_EQ(told.at("verdict"), "good") << gcode << told.at("reason");
    EXPECT_LT(told.at("interval95_s")[0], 0.045) << gcode;
    EXPECT_GT(told.at("interval95_s")[1], 0.045) << gcode;
  }
}

// For a long tube, printed with an extruder at the nozzle: most lines are empty to their end.
TEST_F(AnalyzePhoto, SaysWhichValuesAreTooHighForLinesWithoutEnds) {
  Shoot(folder(), "orca-line --pa 0:1:0.05", "wide");
  ExpectRefused("wide.jpg --gcode wide.gcode", folder(),
                {"The values reach 1 s", "empty to its end", "at most 0.5 s"});
}

TEST_F(AnalyzePhoto, ReadsAHundredMegapixelsInBoundedMemory) {
  cv::Mat large;
  cv::resize(ToMat(Draw(drawn_)), large, {9900, 10300}, 0, 0, cv::INTER_LINEAR);
  Write(large);
  large.release();
  constexpr long kMemory_kb = 4L << 20;
  constexpr double kMax_s = 60;
  const auto begin = std::chrono::steady_clock::now();
  const json answer = Analyze("", {.memory_kb = kMemory_kb});
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  ExpectAnswer(answer, drawn_.right_value_s);
  EXPECT_LT(taken.count(), kMax_s);
}

TEST_F(AnalyzePhoto, RejectsFilesThatAreNoPicture) {
  const fs::path photo = folder() / "photo.jpg";
  test::WriteWhole(photo, "dear diary");
  ExpectRejected("photo.jpg " + std::string(kPa), folder(),
                 {"photo.jpg", "neither a JPEG nor a PNG"});
  test::WriteWhole(photo, "");
  ExpectRejected("photo.jpg " + std::string(kPa), folder(), {"photo.jpg", "empty"});
  ExpectRejected("missing.jpg", folder(), {"missing.jpg", "no such file"});
  Write(ToMat(Draw(drawn_)));
  const std::string whole = test::ReadWhole(photo);
  test::WriteWhole(photo, whole.substr(0, whole.size() / 2));
  ExpectRejected("photo.jpg " + std::string(kPa), folder(),
                 {"photo.jpg", "ends before the picture does"});
  test::WriteWhole(photo, whole.substr(0, 20));
  ExpectRejected("photo.jpg " + std::string(kPa), folder(), {"photo.jpg"});
  // A few bytes that ask for 30 GB.
  Write(cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(9)), "photo.png");
  std::string bomb = test::ReadWhole(folder() / "photo.png");
  bomb.replace(16, 8, std::string("\0\1\x86\xa0\0\1\x86\xa0", 8));
  test::WriteWhole(folder() / "photo.png", bomb);
  ExpectRejected("photo.png " + std::string(kPa), folder(),
                 {"photo.png", "100000 x 100000", "shrink"});
}

TEST_F(AnalyzePhoto, RejectsOptionsThatCannotBe) {
  Write(cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(90)));
  const struct {
    const char* options;
    std::vector<std::string> words;
  } cases[] = {
      {"--pa 0:nan:0.005", {"--pa", "nan", "number"}},
      {"--pa 0,0.01,0.01,0.02", {"--pa", "0.01", "twice"}},
      {"--segments 0.1:10,0.6:100,0.3:10", {"--segments", "--pa"}},
      {"--from middle", {"--from", "middle", "bottom, top, left or right"}},
      {"--start 3", {"--start", "3", "bottom, top, left or right"}},
      {"--report nowhere/page.html", {"--report", "nowhere"}},
      {"--report .", {"--report", "is a folder"}},
      {"--report photo.jpg", {"--report", "photo.jpg: is there already", "--force"}},
      {"--report /dev/null --force", {"--report", "/dev/null: is a device"}},
      {"--figures photo.jpg", {"--figures", "photo.jpg is a file"}},
      {"--figures photo.jpg/a/b", {"--figures", "photo.jpg is a file"}},
  };
  for (const auto& bad : cases) {
    ExpectRejected("photo.jpg " + std::string(bad.options), folder(), bad.words);
  }
}

// The photo is virtual; all else is what the page shows.
TEST_F(AnalyzePhoto, TheTutorialsCommandsAnswerAsItShows) {
  std::istringstream page(test::ReadWhole(TRAMMEL_SOURCE_FOLDER "docs/tutorial/photo.md"));
  std::vector<std::string> shown;
  std::string printed;
  bool block = false;
  for (std::string line; std::getline(page, line);) {
    constexpr std::string_view kPrompt = "    trammel ";
    if (line.starts_with("```")) {
      block = !block;
    } else if (block) {
      shown.push_back(line);
    } else if (line.starts_with(kPrompt)) {
      if (line.find("pa photo photo.jpg") != std::string::npos) {
        ASSERT_THAT(test::RunTrammel("sim photo pattern.gcode --seed 77 -o photo.jpg", folder()),
                    Ends(0));
      }
      if (line.find("pa photo test.jpg") != std::string::npos) {
        for (const char* command :
             {"sim pattern marlin-lines --pa 0:0.1:0.005 -o plate_1.gcode",
              "sim photo plate_1.gcode --phone --scene black-on-gold --pressure-advance 0.05 "
              "--seed 5011 --size 4032x3024 -o test.jpg"}) {
          ASSERT_THAT(test::RunTrammel(command, folder()), Ends(0)) << command;
        }
      }
      const test::CommandResult run = test::RunTrammel(line.substr(kPrompt.size()), folder());
      EXPECT_EQ(run.exit_code, 0) << line << run.output;
      printed += run.standard_output;
    }
  }
  EXPECT_EQ(shown.size(), 5U);
  for (const std::string& line : shown) EXPECT_THAT(printed, HasSubstr(line + "\n"));
}

}  // namespace
}  // namespace trammel
