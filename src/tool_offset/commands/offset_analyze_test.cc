// The whole way of a sheet: drawn as G-code, printed and scanned by the virtual machine, read.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "image/png_test_support.h"
#include "machine/page/page_file.h"
#include "support/matchers.h"
#include "support/run_trammel.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kSeed = 31;
// T1 as drawn by hand, so that both signs and both axes are told apart.
constexpr double kDx_mm = 0.31;
constexpr double kDy_mm = -0.17;

// Printed and scanned once for all.
class OffsetAnalyze : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    WritePattern("p.gcode", OfPla());
    ASSERT_EQ(Scan("a.png", "--truth truth.json").exit_code, 0);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static tool_offset::SheetSettings OfPla() {
    tool_offset::SheetSettings settings;
    settings.filament.material = "pla";
    return settings;
  }
  static void WritePattern(const std::string& name, const tool_offset::SheetSettings& settings) {
    WriteWhole(Path(name), tool_offset::WriteSheetGcode(tool_offset::PlanSheet(settings)).text);
  }
  static CommandResult Trammel(const std::string& arguments) {
    return RunTrammel(arguments, folder_->path());
  }
  static CommandResult Scan(const std::string& out, const std::string& more) {
    return Trammel(fmt::format("sim sheet p.gcode --seed {} --offset 1:{},{} --out {} {}", kSeed,
                               kDx_mm, kDy_mm, out, more));
  }
  static CommandResult Analyze(const std::string& arguments) {
    return Trammel("offset analyze --pattern p.gcode " + arguments);
  }
  static std::filesystem::path Path(const std::string& name) { return folder_->path() / name; }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> OffsetAnalyze::folder_;

// 95 % intervals of one sheet each, with room for the one in twenty that lies outside.
void ExpectNear(const json& value, const json& interval, double truth) {
  const double half = (interval[1].get<double>() - interval[0].get<double>()) / 2;
  EXPECT_LT(std::abs(value.get<double>() - truth), 2 * half);
  constexpr double kWorst_mm = 0.02;  // the seed's claim is 0.03
  EXPECT_LT(std::abs(value.get<double>() - truth), kWorst_mm);
  EXPECT_GT(half, 0);
}

TEST_F(OffsetAnalyze, RecoversOffsetsAndPlayOfAVirtualMachine) {
  const auto result = Must(Analyze("a.png --json"));
  const json found = json::parse(result.standard_output);
  const json truth = json::parse(ReadWhole(Path("truth.json")));
  EXPECT_EQ(found["format"], 1);
  EXPECT_EQ(found["reference_tool"], 0);
  ASSERT_EQ(found["tools"].size(), 1U);
  const json& tool = found["tools"][0];
  EXPECT_EQ(tool["tool"], 1);
  EXPECT_EQ(tool["verdict"], "good");
  EXPECT_EQ(tool["reason"], "");
  ExpectNear(tool["dx_mm"], tool["interval95_mm"]["dx"], kDx_mm);
  ExpectNear(tool["dy_mm"], tool["interval95_mm"]["dy"], kDy_mm);
  EXPECT_GT(tool["standard_uncertainty_mm"]["dx"], 0.0);
  for (const char* axis : {"x", "y"}) {
    ExpectNear(found["backlash_mm"][axis], found["backlash_interval95_mm"][axis],
               truth["backlash_mm"][axis]);
    EXPECT_TRUE(found["control_bias_mm"][axis].is_number());
    constexpr double kPixelsPerMm = 600 / 25.4;
    EXPECT_NEAR(found["scale"][axis].get<double>(), kPixelsPerMm, 0.01 * kPixelsPerMm);
  }
  const json& scan = found["scans"][0];
  EXPECT_EQ(scan["source"], "a.png");
  EXPECT_EQ(scan["structures"].size(), 12U);
  EXPECT_EQ(scan["structures"][0]["residuals"].size(), 34U);
}

TEST_F(OffsetAnalyze, RefusesFilesThatAskForMoreThanTheyHold) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  const std::filesystem::path bombs =
      std::filesystem::path(data != nullptr ? data : "") / "hostile" / "bombs";
  if (data == nullptr || !std::filesystem::is_directory(bombs)) {
    GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with hostile/bombs/";
  }
  for (const auto& entry : std::filesystem::directory_iterator(bombs)) {
    if (entry.path().extension() == ".gcode") continue;
    EXPECT_THAT(
        RunTrammel(fmt::format("offset analyze --pattern p.gcode '{}'", entry.path().string()),
                   folder_->path(), {.memory_kb = 1'000'000}),
        Fails(1, entry.path().filename().string(), Not(HasSubstr("fit into"))));
  }
}

TEST_F(OffsetAnalyze, SheetsBehindAPlusMakeTheValueMoreCertain) {
  ASSERT_EQ(Scan("b.png", "--sheet 1").exit_code, 0);
  const json one = json::parse(Analyze("a.png --json").standard_output);
  const json two = json::parse(Analyze("a.png + b.png --json").standard_output);
  EXPECT_EQ(two["tools"][0]["sheets"], 2);
  EXPECT_EQ(two["scans"][1]["sheet"], 2);
  EXPECT_LT(two["tools"][0]["standard_uncertainty_mm"]["dx"],
            one["tools"][0]["standard_uncertainty_mm"]["dx"]);
  // Twice the same scan is no second sheet.
  const json again = json::parse(Analyze("a.png a.png --json").standard_output);
  EXPECT_EQ(again["tools"][0]["sheets"], 1);
  EXPECT_NEAR(again["tools"][0]["standard_uncertainty_mm"]["dx"],
              one["tools"][0]["standard_uncertainty_mm"]["dx"].get<double>(), 1e-9);
}

TEST_F(OffsetAnalyze, AToolThatDidNotPrintIsRefusedByNameAndHasNoNumbers) {
  ASSERT_EQ(Scan("silent.png", "--dpi 300 --missing 1").exit_code, 0);
  const CommandResult result = Analyze("silent.png --json");
  EXPECT_EQ(result.exit_code, 2);
  const json tool = json::parse(result.standard_output)["tools"][0];
  EXPECT_EQ(tool["verdict"], "refused");
  EXPECT_THAT(tool["reason"].get<std::string>(), HasSubstr("T1"));
  for (const char* key : {"dx_mm", "dy_mm", "standard_uncertainty_mm", "interval95_mm"}) {
    EXPECT_TRUE(tool[key].is_null()) << key;
  }
}

TEST_F(OffsetAnalyze, ARefusedSheetIsJsonWithAVerdict) {
  const CommandResult good = Analyze("a.png --json");
  EXPECT_EQ(json::parse(good.standard_output)["verdict"], "good");
  EXPECT_EQ(json::parse(good.standard_output)["reason"], "");
  ASSERT_EQ(Scan("cut.png", "--dpi 300 --set crop-left-mm=60").exit_code, 0);
  const CommandResult refused = Analyze("cut.png --json");
  EXPECT_EQ(refused.exit_code, 2);
  const json whole = json::parse(refused.standard_output);
  EXPECT_EQ(whole["verdict"], "refused");
  EXPECT_THAT(whole["reason"].get<std::string>(), HasSubstr("cut.png"));
  EXPECT_EQ(whole["refused_scans"][0]["source"], "cut.png");
  EXPECT_TRUE(whole["tools"][0]["dx_mm"].is_null());
  EXPECT_EQ(whole["tools"][0]["verdict"], "refused");
  EXPECT_TRUE(whole["backlash_mm"]["x"].is_null());
  // Beside a good scan the refused one is named.
  const json both = json::parse(Analyze("a.png cut.png --json").standard_output);
  EXPECT_EQ(both["verdict"], "good");
  EXPECT_EQ(both["refused_scans"].size(), 1U);
}

TEST_F(OffsetAnalyze, WritesAReportAndFigures) {
  const auto result = Must(Analyze("a.png --json --report r.html --figures figures/sheet"));
  EXPECT_EQ(json::parse(result.standard_output)["report"], "r.html");
  EXPECT_THAT(ReadWhole(Path("r.html")), Containing("<h1>Tool offsets", "T1 X+"));
  for (const char* name : {"tools.svg", "scan1-page.svg"}) {
    EXPECT_TRUE(std::filesystem::exists(Path("figures/sheet") / name)) << name;
  }
}

TEST_F(OffsetAnalyze, AReportThatCannotBeWrittenIsNamedBeforeAnythingIsRead) {
  const CommandResult folder = Analyze("a.png --report missing/r.html");
  EXPECT_EQ(folder.exit_code, 1);
  EXPECT_EQ(folder.standard_output, "");
  EXPECT_THAT(folder.standard_error, HasSubstr("--report missing/r.html"));
  EXPECT_THAT(Analyze("a.png --report .").standard_error, HasSubstr("is a folder"));
  EXPECT_THAT(Analyze("a.png --figures p.gcode/x").standard_error, HasSubstr("--figures"));
}

TEST_F(OffsetAnalyze, ReadsAPoorJpegOfADiscolouredPage) {
  ASSERT_EQ(Scan("poor.jpg", "--jpeg-quality 20 --colour --set cast-red=0.6 --set cast-blue=1.2")
                .exit_code,
            0);
  const auto result = Must(Analyze("poor.jpg --json"));
  const json tool = json::parse(result.standard_output)["tools"][0];
  ExpectNear(tool["dx_mm"], tool["interval95_mm"]["dx"], kDx_mm);
  ExpectNear(tool["dy_mm"], tool["interval95_mm"]["dy"], kDy_mm);
}

TEST_F(OffsetAnalyze, AnIdexHasItsOwnChangesOfToolAndItsOwnLines) {
  ASSERT_EQ(Trammel("offset pattern --material pla --tool-change idex -o idex.gcode").exit_code, 0);
  ASSERT_EQ(
      Trammel(fmt::format(
                  "sim sheet idex.gcode --dpi 300 --seed {} --offset 1:{},{} --out carriage.png",
                  kSeed, kDx_mm, kDy_mm))
          .exit_code,
      0);
  const auto read =
      Must(Trammel("offset analyze carriage.png --pattern idex.gcode --json --result idex.json"));
  const json tool = json::parse(read.standard_output)["tools"][0];
  ExpectNear(tool["dx_mm"], tool["interval95_mm"]["dx"], kDx_mm);
  const auto lines =
      Must(Trammel("offset apply idex.json --for klipper-gcode-offset --now 1:0.5,0"));
  // 0.5 - 0.31 and 0 + 0.17, to the hundredths that the sheet is good for.
  EXPECT_THAT(lines.standard_output,
              testing::ContainsRegex("SET_GCODE_OFFSET X=0\\.(18|19)[0-9] Y=0\\.1(6|7)[0-9]"));
  EXPECT_THAT(lines.standard_output, HasSubstr("[gcode_macro T1]"));
}

TEST_F(OffsetAnalyze, ReadsASheetOfTheOriginalGeneratorWithItsGcode) {
  ASSERT_EQ(Trammel(fmt::format("sim sheet --original 1,2 --reference 2 --seed 12 --dpi 300 "
                                "--offset 1:{},{} --offset 2:0,0 --out original.png --truth o.json "
                                "--pattern-out o.gcode",
                                kDx_mm, kDy_mm))
                .exit_code,
            0);
  const auto result = Must(Trammel("offset analyze original.png --pattern o.gcode --json"));
  const json found = json::parse(result.standard_output);
  EXPECT_TRUE(found["sheet_id"].is_null());
  ASSERT_EQ(found["tools"].size(), 1U);
  const json& tool = found["tools"][0];
  ExpectNear(tool["dx_mm"], tool["interval95_mm"]["dx"], kDx_mm);
  ExpectNear(tool["dy_mm"], tool["interval95_mm"]["dy"], kDy_mm);
  const json truth = json::parse(ReadWhole(Path("o.json")));
  for (const char* axis : {"x", "y"}) {
    ExpectNear(found["backlash_mm"][axis], found["backlash_interval95_mm"][axis],
               truth["backlash_mm"][axis]);
  }
  EXPECT_THAT(found["notices"].dump(), HasSubstr("identity not checked"));
  EXPECT_THAT(Trammel("offset analyze original.png --pattern o.gcode --photo").standard_error,
              HasSubstr("put it on a scanner"));
  const std::string gcode = ReadWhole(Path("o.gcode"));
  WriteWhole(Path("cut.gcode"), gcode.substr(0, gcode.size() / 2));
  const CommandResult cut = Trammel("offset analyze original.png --pattern cut.gcode");
  EXPECT_EQ(cut.exit_code, 1);
  EXPECT_THAT(cut.standard_error, Containing("--pattern cut.gcode", "cut off"));
}

TEST_F(OffsetAnalyze, FilesThatCannotBeReadAreNamed) {
  const std::string whole = ReadWhole(Path("a.png"));
  WriteWhole(Path("cut.png"), whole.substr(0, whole.size() / 2));
  const CommandResult cut = Analyze("cut.png --json");
  EXPECT_EQ(cut.exit_code, 1);
  EXPECT_THAT(cut.standard_error, HasSubstr("cut.png"));
  EXPECT_EQ(Analyze("nowhere.png").exit_code, 1);
  EXPECT_EQ(Analyze("+ +").exit_code, 1);
  EXPECT_THAT(Analyze("a.png --most-megapixels 1"), Fails(1, "1 megapixels"));
  const CommandResult pattern = Trammel("offset analyze --pattern a.png a.png");
  EXPECT_EQ(pattern.exit_code, 1);
  EXPECT_THAT(pattern.standard_error, HasSubstr("--pattern a.png"));
  // Readable pages are still reported.
  EXPECT_THAT(Analyze("a.png cut.png"), Prints(1, "T1 "));
}

TEST_F(OffsetAnalyze, ReadsAPhonesPhotoOfASheetLaidOutForIt) {
  tool_offset::SheetSettings settings = OfPla();
  settings.for_photo = true;
  WritePattern("photo.gcode", settings);
  const auto take = [](const std::string& out, const std::string& more) {
    return Trammel(
        fmt::format("sim sheet photo.gcode --photo --photo-set tilt-deg=5 --seed {} "
                    "--offset 1:{},{} --out {} {}",
                    kSeed, kDx_mm, kDy_mm, out, more));
  };
  ASSERT_EQ(take("photo.jpg", "").exit_code, 0);
  const auto result = Must(Trammel("offset analyze photo.jpg --pattern photo.gcode --json"));
  const json found = json::parse(result.standard_output);
  const json& tool = found["tools"][0];
  ExpectNear(tool["dx_mm"], tool["interval95_mm"]["dx"], kDx_mm);
  ExpectNear(tool["dy_mm"], tool["interval95_mm"]["dy"], kDy_mm);
  // Told from the file alone, and what is taken for granted is said.
  EXPECT_EQ(found["scans"][0]["photo"]["focal_stated"], true);
  EXPECT_THAT(found["notices"][0].get<std::string>(), HasSubstr("30 um higher"));
  const auto surer = Must(Trammel(
      "offset analyze photo.jpg --pattern photo.gcode --line-heights-um 0 --line-colour-px 0 "
      "--json"));
  const json less = json::parse(surer.standard_output);
  EXPECT_LT(less["tools"][0]["standard_uncertainty_mm"]["dx"].get<double>(),
            tool["standard_uncertainty_mm"]["dx"].get<double>());

  ASSERT_EQ(take("blurred.jpg", "--photo-set blur-px=6").exit_code, 0);
  const CommandResult blurred = Trammel("offset analyze blurred.jpg --pattern photo.gcode");
  EXPECT_EQ(blurred.exit_code, 2);
  EXPECT_THAT(blurred.standard_error, Containing("blurred.jpg", "6.0 px"));
}

// A JPEG without its APP1 segments: without EXIF, as browsers and messengers hand it on.
std::string WithoutExif(const std::string& jpeg) {
  const auto byte = [&](std::size_t at) { return static_cast<std::uint8_t>(jpeg[at]); };
  std::string kept = jpeg.substr(0, 2);
  std::size_t at = 2;
  while (byte(at) == 0xFF && byte(at + 1) != 0xDA) {
    const std::size_t length = 2 + 256U * byte(at + 2) + byte(at + 3);
    if (byte(at + 1) != 0xE1) kept += jpeg.substr(at, length);
    at += length;
  }
  return kept + jpeg.substr(at);
}

Page OnlyPage(const std::filesystem::path& path) {
  auto pages = machine::ReadPages(path);
  EXPECT_TRUE(pages && pages->size() == 1);
  return pages ? std::move(pages->front()) : Page{};
}

// Browsers, messengers and scan apps take away what the camera wrote: it is a photo all the same.
TEST_F(OffsetAnalyze, KnowsAPhotoWithoutWhatTheCameraWrote) {
  tool_offset::SheetSettings settings = OfPla();
  settings.for_photo = true;
  WritePattern("bare.gcode", settings);
  ASSERT_EQ(Trammel(fmt::format("sim sheet bare.gcode --photo --seed 16 --offset 1:{},{} --out "
                                "phone.jpg",
                                kDx_mm, kDy_mm))
                .exit_code,
            0);
  const std::string phone = ReadWhole(Path("phone.jpg"));
  WriteWhole(Path("bare.jpg"), WithoutExif(phone));
  Page picture = OnlyPage(Path("phone.jpg"));
  picture.film_focal_mm = {};
  WriteWhole(Path("heic.png"), image::PngOf(picture));
  const auto as_photo = [&](const std::string& file, const std::string& more) {
    const CommandResult result =
        Trammel(fmt::format("offset analyze {} --pattern bare.gcode --json {}", file, more));
    EXPECT_EQ(result.exit_code, 0) << file << ": " << result.output;
    return result.exit_code == 0 ? json::parse(result.standard_output) : json();
  };
  const json told = as_photo("bare.jpg", "--photo");
  ASSERT_FALSE(told.is_null());
  for (const char* file : {"bare.jpg", "heic.png"}) {
    const json found = as_photo(file, "");
    ASSERT_FALSE(found.is_null()) << file;
    ASSERT_FALSE(found["scans"][0]["photo"].is_null()) << file;
    EXPECT_EQ(found["scans"][0]["photo"]["focal_stated"], false) << file;
    EXPECT_EQ(found["tools"][0]["dx_mm"], told["tools"][0]["dx_mm"]) << file;
    ExpectNear(found["tools"][0]["dy_mm"], found["tools"][0]["interval95_mm"]["dy"], kDy_mm);
  }
}

}  // namespace
}  // namespace trammel::test
