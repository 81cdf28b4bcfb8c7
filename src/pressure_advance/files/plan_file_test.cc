#include "pressure_advance/files/plan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pressure_advance/pattern/pattern.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using nlohmann::json;
using pressure_advance::PatternConfig;
using pressure_advance::PatternPlan;
using ::testing::HasSubstr;
using ::testing::StartsWith;

PatternPlan PlanOf(const PatternConfig& config) {
  return MakePlan(LayOut(config), config, "pattern.gcode");
}

TEST(PlanFile, ReadsBackWhatItWrote) {
  PatternConfig config;
  config.bed_origin_x_mm = -125;
  config.columns = 2;
  config.alternate_directions = true;
  const PatternPlan plan = PlanOf(config);
  const std::string text = FormatPlan(plan);
  const auto read = ParsePlan(text, "a.plan.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(FormatPlan(*read), text);
  ASSERT_EQ(read->lines.size(), 20u);
  EXPECT_EQ(read->lines[19].pattern, 1);
  EXPECT_EQ(read->lines[19].pressure_advance_s, 0.06);
  constexpr double kHalfMicrometre = 0.0005001;  // positions are rounded to 1 um
  EXPECT_NEAR(read->lines[3].start_x_mm, plan.lines[3].start_x_mm, kHalfMicrometre);
  EXPECT_EQ(read->bed_origin_x_mm, -125);
  EXPECT_EQ(read->segments.size(), 3u);
  EXPECT_EQ(read->acceleration_mm_s2, 3000);
}

struct Fault {
  std::function<void(json&)> spoil;
  const char* says;
};

TEST(PlanFile, NamesWhatIsWrong) {
  const std::vector<Fault> faults{
      {[](json& p) { p.erase("format"); }, "format is missing"},
      {[](json& p) { p["format"] = 2; }, "format is 2; this trammel reads format 1"},
      {[](json& p) { p["format"] = 1.5; }, "format is 1.5; it must be a whole number"},
      {[](json& p) { p["kind"] = "recipe"; },
       "kind is \"recipe\"; it must be \"pressure_advance_plan\""},
      {[](json& p) { p["gcode"] = "../../etc/passwd"; }, "must be a file name without a folder"},
      {[](json& p) { p["gcode"] = 7; }, "gcode is 7; it must be text"},
      {[](json& p) { p["bed_mm"] = {250}; }, "bed_mm has 1 entries; it must have 2"},
      {[](json& p) {
         p["bed_mm"] = {250, "x"};
       },
       "bed_mm[1] is \"x\"; it must be a number"},
      {[](json& p) { p["layer_height_mm"] = -1; }, "layer_height_mm is -1; it must be 0.001 … 10"},
      {[](json& p) { p["line_width_mm"] = nullptr; }, "line_width_mm is null; it must be a number"},
      {[](json& p) { p["line_length_mm"] = 1e300; }, "line_length_mm is 1e+300; it must be"},
      {[](json& p) { p["line_length_mm"] = 31; }, "lies 30.000 mm from start_mm"},
      {[](json& p) { p["segments"][0]["fraction"] = 0.5; }, "sum to 1.25"},
      {[](json& p) { p["segments"][1].erase("speed_mm_s"); }, "segments[1].speed_mm_s is missing"},
      {[](json& p) { p["segments"] = 3; }, "segments is 3; it must be a list"},
      {[](json& p) { p["lines"] = json::array(); }, "lines has 0 entries"},
      {[](json& p) { p["lines"][4] = 1; }, "lines[4] is 1; it must be an object"},
      {[](json& p) { p["lines"][4]["pressure_advance_s"] = -0.1; },
       "lines[4].pressure_advance_s is -0.1; it must be 0 … 10"},
      {[](json& p) {
         p["lines"][4]["start_mm"] = {-5, 100};
       },
       "lines[4].start_mm is (-5, 100), off the bed"},
      {[](json& p) { p["speed"] = 3; }, "\"speed\" is not a known key"},
      {[](json& p) { p["lines"][4]["colour"] = 3; }, "lines[4].\"colour\" is not a known key"},
  };
  for (const Fault& fault : faults) {
    json plan = json::parse(FormatPlan(PlanOf(PatternConfig{})));
    fault.spoil(plan);
    const auto read = ParsePlan(plan.dump(), "a.plan.json");
    ASSERT_FALSE(read) << fault.says;
    EXPECT_THAT(read.error().message, StartsWith("a.plan.json")) << fault.says;
    EXPECT_THAT(read.error().message, HasSubstr(fault.says));
  }
}

TEST(PlanFile, KnowsTheFirmwareByWhoseCommandTheValueIsSet) {
  PatternConfig config;
  EXPECT_EQ(FormatPlan(PlanOf(config)).find("firmware"), std::string::npos);
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    config.dialect = words.dialect;
    const auto read = ParsePlan(FormatPlan(PlanOf(config)), "a.plan.json");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->printed_by, (gcode::PrintedBy{words.dialect, 0}));
  }
  config.dialect = gcode::Dialect::kRepRapFirmware;
  config.start_gcode = "T2\n" + config.start_gcode;
  const auto duet = ParsePlan(FormatPlan(PlanOf(config)), "a.plan.json");
  ASSERT_TRUE(duet) << duet.error().message;
  EXPECT_EQ(duet->printed_by, (gcode::PrintedBy{gcode::Dialect::kRepRapFirmware, 2}));
}

TEST(PlanFile, SurvivesEveryTruncationOfItsText) {
  const std::string text = FormatPlan(PlanOf(PatternConfig{}));
  const std::size_t end = text.find_last_of('}');
  for (std::size_t length = 0; length <= end; ++length) {
    EXPECT_FALSE(ParsePlan(std::string_view(text).substr(0, length), "a.plan.json")) << length;
  }
}

TEST(PlanFile, SurvivesWhatIsNotAPlan) {
  for (const std::string& text :
       {std::string("null"), std::string("[]"), std::string("{}"), std::string("1e999"),
        std::string("\xff\xfe\0", 3), std::string(100000, '['), std::string("{\"format\": NaN}"),
        std::string("{\"format\": 1, \"format\": 1}")}) {
    EXPECT_FALSE(ParsePlan(text, "a.plan.json"));
  }
}

class PatternPrintsTest : public ::testing::Test {
 protected:
  std::optional<PatternPrint> Last(const std::string& printer,
                                   PrintsFor which = PrintsFor::kPhoto) {
    const auto last = LastPatternPrint(path_, printer, which);
    EXPECT_TRUE(last) << last.error().message;
    return last.value_or(std::nullopt);
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / kPatternPrintsFile;
};

TEST_F(PatternPrintsTest, APrintersLastOneIsTheLastThatWasNotedWhateverItsClockSaid) {
  EXPECT_FALSE(Last("voron"));
  for (const PatternPrint& print :
       {PatternPrint{"2026-01-03T00:00:00Z", "voron", "/a", "", true, 5.5},
        {"2026-01-04T00:00:00Z", "ender", "/b", "", true, 7.0},
        {"2026-01-02T00:00:00Z", "voron", "/c", "PLA \"+\"", false, 6.25}}) {
    ASSERT_TRUE(NotePatternPrint(path_, print));
  }
  const auto voron = Last("voron");
  ASSERT_TRUE(voron);
  EXPECT_EQ(voron->utc, "2026-01-02T00:00:00Z");
  EXPECT_EQ(voron->folder, "/c");
  EXPECT_EQ(voron->filament, "PLA \"+\"");
  EXPECT_FALSE(voron->ended);
  EXPECT_EQ(voron->server_s, 6.25);
  EXPECT_TRUE(Last("ender")->ended);
  EXPECT_FALSE(Last("other"));
}

TEST_F(PatternPrintsTest, APhotoIsOfNoPrintForAScan) {
  ASSERT_TRUE(NotePatternPrint(path_, {"2026-01-02T00:00:00Z", "voron", "/photo", "", true, 5.5}));
  PatternPrint scanned{"2026-01-03T00:00:00Z", "voron", "/scan"};
  scanned.for_photo = false;
  ASSERT_TRUE(NotePatternPrint(path_, scanned));
  EXPECT_EQ(Last("voron")->folder, "/photo");
  EXPECT_EQ(Last("voron", PrintsFor::kEither)->folder, "/scan");
  // A line of before that there were others says nothing of it.
  test::WriteWhole(path_,
                   "{\"utc\": \"x\", \"printer\": \"voron\", \"folder\": \"/old\", "
                   "\"step\": \"ended\"}\n");
  EXPECT_EQ(Last("voron")->folder, "/old");
}

TEST_F(PatternPrintsTest, LinesThatAreNonePassAndATimeThatIsNoneIsNotTold) {
  ASSERT_TRUE(NotePatternPrint(path_, {"2026-01-02T00:00:00Z", "voron", "/a", "", true, {}}));
  test::WriteWhole(path_,
                   test::ReadWhole(path_) +
                       "{\n[]\n{\"utc\": \"x\", \"printer\": \"voron\", \"step\": \"soon\"}\n"
                       "{\"utc\": 5, \"printer\": \"voron\", \"step\": \"ended\"}\n" +
                       std::string(2 << 20, 'x') + "\n");
  const auto last = Last("voron");
  ASSERT_TRUE(last);
  EXPECT_EQ(last->utc, "2026-01-02T00:00:00Z");
  EXPECT_FALSE(last->server_s);
}

}  // namespace
}  // namespace trammel::files
