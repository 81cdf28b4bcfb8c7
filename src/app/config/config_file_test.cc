#include "app/config/config_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/config/config_value.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "settings/scan_settings.h"

namespace trammel::files {
namespace {

using pressure_advance::PatternConfig;
using settings::ScanSettings;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(ConfigKeys, EachHasItsOwnNameADescriptionAndItsDefaultWithinItsRange) {
  std::set<std::pair<std::string_view, std::string_view>> names;
  Config defaults;
  for (const ConfigSetting& setting : SettingsOf(defaults)) {
    EXPECT_TRUE(names.emplace(setting.section, setting.key).second)
        << setting.key << " stands twice";
    EXPECT_TRUE(setting.doc.ends_with('.')) << setting.key;
  }
  EXPECT_EQ(FindProblem(defaults.pattern), std::nullopt);
  EXPECT_EQ(FindProblem(defaults.scan), std::nullopt);
}

TEST(ConfigKeys, DescriptionIsItselfAConfigurationThatChangesNothing) {
  auto config = ParseConfig(DescribeConfigKeys(), "keys");
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_GT(config->keys.size(), 70);
  Config defaults = DefaultConfig();
  const auto expected = SettingsOf(defaults);
  const auto settings = SettingsOf(*config);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    EXPECT_EQ(FormatSetting(settings[i]), FormatSetting(expected[i])) << settings[i].key;
  }
}

TEST(ConfigKeys, ChangesAreWhatGivesThemWhereItIsReadAgain) {
  EXPECT_EQ(DescribeChanges(DefaultConfig()), "");
  Config config = DefaultConfig();
  config.scan.address = "voron.local";
  config.pattern.nozzle_diameter_mm = 0.6;
  FollowNozzle(config);
  config.pattern.acceleration_mm_s2 = 2000;
  const std::string text = DescribeChanges(config);
  EXPECT_THAT(text, HasSubstr("(mm, 0.1 … 2)\nnozzle_diameter = 0.6\n"));
  auto read = ParseConfig(text, "changes");
  ASSERT_TRUE(read) << read.error().message << text;
  EXPECT_THAT(read->keys,
              testing::ElementsAre("moonraker.address", "pressure_advance_pattern.acceleration",
                                   "printer.nozzle_diameter"));
  const auto expected = SettingsOf(config);
  const auto settings = SettingsOf(*read);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    EXPECT_EQ(FormatSetting(settings[i]), FormatSetting(expected[i])) << settings[i].key;
  }
}

TEST(ConfigFile, SetsWhatItSaysAndLeavesTheRest) {
  const auto config = ParseConfig(
      "[printer]\n"
      "dialect = \"marlin\"\n"
      "bed_size_x = 220\n"
      "start_gcode = \"\"\"\nG28\nM109 S{nozzle_temperature_c}\n\"\"\"\n"
      "park_x = 10.5\n"
      "[pressure_advance_pattern]\n"
      "segments = [{fraction = 0.3, speed = 10}, {fraction = 0.7, speed = 80}]\n"
      "pressure_advances = [0, 0.5, 1]\n"
      "alternate_directions = true\n"
      "columns = 2\n",
      "a.toml");
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->keys.size(), 8);
  const PatternConfig& pattern = config->pattern;
  EXPECT_EQ(pattern.dialect, gcode::Dialect::kMarlin);
  EXPECT_EQ(pattern.bed_size_x_mm, 220);
  EXPECT_EQ(pattern.bed_size_y_mm, 250);
  EXPECT_EQ(pattern.start_gcode, "G28\nM109 S{nozzle_temperature_c}\n");
  EXPECT_EQ(pattern.park_x_mm, 10.5);
  ASSERT_EQ(pattern.segments.size(), 2u);
  EXPECT_EQ(pattern.segments[1].speed_mm_s, 80);
  EXPECT_EQ(pattern.pressure_advances_s, (std::vector<double>{0, 0.5, 1}));
  EXPECT_TRUE(pattern.alternate_directions);
  EXPECT_EQ(pattern.columns, 2);
}

struct Fault {
  const char* text;
  const char* says;
};

TEST(ConfigFile, NamesFileLineKeyValueAndBound) {
  const std::vector<Fault> faults{
      {"[printer]\n\nbed_size_x = 5\n",
       "a.toml:3: [printer] bed_size_x: 5 mm is outside 10 ... 2000 mm"},
      {"[printer]\nbed_sise_x = 5\n",
       "a.toml:2: [printer] has no key bed_sise_x; did you mean bed_size_x?"},
      {"[printer]\nline_length = 5\n",
       "[printer] has no key line_length; it belongs in [pressure_advance_pattern]"},
      {"[printers]\n", "a.toml:1: there is no section [printers]; did you mean printer?"},
      {"dialect = \"marlin\"\n", "a.toml:1: dialect belongs in [printer]"},
      {"printer = 3\n", "a.toml:1: printer is a section; write [printer]"},
      {"[printer]\ndialect = \"Marlin\"\n",
       "must be \"klipper\", \"marlin\", \"reprapfirmware\", \"prusa\" or \"bambu\", is 'Marlin'"},
      {"[printer]\nbed_size_x = \"250\"\n", "must be a number, is '250' (string)"},
      {"[printer]\nbed_size_x = nan\n", "nan mm is outside"},
      {"[printer]\nstart_gcode = \"a\\u0000b\"\n", "control character 0x00"},
      {"[pressure_advance_pattern]\nline_count = 9223372036854775807\n", "far too large"},
      {"[pressure_advance_pattern]\nalternate_directions = 1\n", "must be true or false, is 1"},
      {"[pressure_advance_pattern]\nsegments = [{fraction = 1}]\n", "needs both"},
      {"[printer]\nbed_size_x = 1\nbed_size_x = 2\n", "a.toml:3: is not TOML"},
      {"[camera]\nheight_direction = \"up\"\n", "must be \"+x\", \"-x\", \"+y\" or \"-y\""},
      {"[camera]\nlaser_angle = 90\n", "a.toml:2: [camera] laser_angle: 90 ° is outside 5 ... 85"},
  };
  for (const Fault& fault : faults) {
    const auto config = ParseConfig(fault.text, "a.toml");
    ASSERT_FALSE(config) << fault.text;
    EXPECT_THAT(config.error().message, HasSubstr(fault.says)) << fault.text;
    EXPECT_THAT(config.error().message, testing::StartsWith("a.toml:")) << fault.text;
  }
}

TEST(ConfigFile, SaysWhereASettingStandsThatDoesNotFitTheOthers) {
  const std::string text = "[pressure_advance_pattern]\n\nline_spacing = 0.3\n";
  const auto config = ParseConfig(text, "a.toml");
  ASSERT_TRUE(config);
  const auto valid = ValidateConfig(*config, text, "a.toml");
  ASSERT_FALSE(valid);
  EXPECT_EQ(valid.error().message,
            "a.toml:3: [pressure_advance_pattern] line_spacing: 0.3 mm is not above line_width = "
            "0.495 mm: the lines would touch");
}

TEST(ConfigFile, BlamesTheCommandLineForWhatItSet) {
  const std::string text = "[filament]\nmaterial = \"pla\"\n[printer]\nnozzle_diameter = 0.4\n";
  const auto problem = [&text](const std::vector<std::string>& assignments) {
    auto config = ParseConfig(text, "a.toml");
    EXPECT_TRUE(config);
    for (const std::string& assignment : assignments) {
      EXPECT_TRUE(OverrideConfig(assignment, *config)) << assignment;
    }
    const auto valid = ValidateConfig(*config, text, "a.toml");
    return valid ? std::string() : valid.error().message;
  };
  EXPECT_EQ(problem({}), "");
  EXPECT_THAT(problem({"material=plastic"}),
              AllOf(StartsWith("--set material: [filament] material: \"plastic\""),
                    Not(HasSubstr("a.toml"))));
  // The file's own value is at fault only beside what the command line says.
  EXPECT_THAT(problem({"pressure_advance_start=5"}),
              AllOf(HasSubstr("[pressure_advance_pattern] pressure_advance_end: "),
                    HasSubstr("; it goes with --set pressure_advance_start")));
}

TEST(ConfigOverride, SetsOneKeyWithOrWithoutItsSection) {
  Config config;
  EXPECT_TRUE(OverrideConfig("line_length=40", config));
  EXPECT_EQ(config.pattern.line_length_mm, 40);
  EXPECT_TRUE(OverrideConfig("printer.dialect=marlin", config));
  EXPECT_EQ(config.pattern.dialect, gcode::Dialect::kMarlin);
  EXPECT_TRUE(OverrideConfig("end_gcode=\"M104 S0\\nM140 S0\"", config));
  EXPECT_EQ(config.pattern.end_gcode, "M104 S0\nM140 S0");
  EXPECT_TRUE(OverrideConfig("segments=[{fraction=0.5,speed=5},{fraction=0.5,speed=90}]", config));
  EXPECT_EQ(config.pattern.segments.size(), 2u);
  EXPECT_TRUE(OverrideConfig("moonraker.address=printer:7126", config));
  EXPECT_EQ(config.scan.address, "printer:7126");
  EXPECT_TRUE(OverrideConfig("height_direction=+x", config));
  EXPECT_EQ(config.scan.height_direction, AxisDirection::kPlusX);
}

TEST(ConfigPreset, StandsBelowWhatTheFileSetsWhereverItStands) {
  for (const char* text : {"[pressure_advance_pattern]\npreset = \"paper\"\nline_spacing = 5\n",
                           "[pressure_advance_pattern]\nline_spacing = 5\npreset = \"paper\"\n"}) {
    const auto config = ParseConfig(text, "file");
    ASSERT_TRUE(config) << config.error().message;
    EXPECT_EQ(config->pattern.line_length_mm, PatternConfig{}.line_length_mm);
    EXPECT_EQ(config->pattern.line_spacing_mm, 5);
    EXPECT_EQ(config->scan.scan_speed_mm_s, ScanSettings{}.scan_speed_mm_s);
  }
  const auto quick = ParseConfig("[scan]\nskip = 2\n", "file");
  ASSERT_TRUE(quick);
  EXPECT_EQ(quick->pattern.preset, "quick");
  EXPECT_LT(quick->pattern.line_length_mm, PatternConfig{}.line_length_mm);
  EXPECT_EQ(quick->scan.skip_mm, 2);
}

TEST(ConfigPreset, OfTheCommandLineLeavesWhatTheFileSet) {
  auto config = ParseConfig("[pressure_advance_pattern]\nline_spacing = 5\n", "file");
  ASSERT_TRUE(config);
  ASSERT_TRUE(OverrideConfig("preset=paper", *config));
  EXPECT_EQ(config->pattern.segments, PatternConfig{}.segments);
  EXPECT_EQ(config->pattern.line_spacing_mm, 5);
  EXPECT_EQ(config->scan.lines_at_once, 1);
  const auto unknown = OverrideConfig("preset=fast", *config);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("\"fast\" is none of quick, paper and photo"));
  const auto file = ParseConfig("[pressure_advance_pattern]\npreset = \"slow\"\n", "file");
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("file:2: [pressure_advance_pattern] preset"));
}

TEST(ConfigOverride, AKeyOfTwoSectionsIsTheCommandsOwn) {
  Config config;
  EXPECT_TRUE(OverrideConfig("line_width=0.5", config, "tool_offset_pattern"));
  EXPECT_EQ(config.sheet.line_width_mm, 0.5);
  EXPECT_EQ(config.pattern.line_width_mm, PatternConfig{}.line_width_mm);
  EXPECT_TRUE(OverrideConfig("dialect=marlin", config, "tool_offset_pattern"));
  EXPECT_TRUE(OverrideConfig("tools=[0, 3]", config));
  EXPECT_TRUE(OverrideConfig("nozzle_temperature=205", config, "tool_offset_pattern"));
  const tool_offset::SheetSettings sheet = SheetOf(config);
  EXPECT_EQ(sheet.line_width_mm, 0.5);
  EXPECT_EQ(sheet.tools, (std::vector<int>{0, 3}));
  EXPECT_EQ(sheet.printer.dialect, gcode::Dialect::kMarlin);
  EXPECT_EQ(sheet.filament.nozzle_temperature_c, 205);
}

TEST(ConfigOverride, RefusesSecretsAmongTheWordsOfACommandWithoutShowingThem) {
  Config config;
  for (const std::string text :
       {"api_key=hunter2", "moonraker.api_key=hunter2", "camera.url=http://me:hunter2@camera/",
        "url=http://camera/?token=hunter2", "apikey=hunter2"}) {
    const auto done = OverrideConfig(text, config);
    ASSERT_FALSE(done) << text;
    EXPECT_THAT(done.error().message, testing::Not(HasSubstr("hunter2"))) << text;
  }
  EXPECT_THAT(OverrideConfig("api_key=x", config).error().message, HasSubstr("api_key_file"));
  EXPECT_TRUE(OverrideConfig("api_key_file=key", config));
  EXPECT_EQ(config.scan.api_key_file, "key");
}

TEST(ConfigFile, ShowsNoKeyThatIsWrong) {
  const auto config = ParseConfig("[moonraker]\napi_key = 42424242\n", "a.toml");
  ASSERT_FALSE(config);
  EXPECT_THAT(config.error().message,
              testing::AllOf(HasSubstr("api_key"), testing::Not(HasSubstr("4242"))));
}

TEST(ConfigOverride, NamesWhatIsWrong) {
  const std::vector<Fault> faults{
      {"line_length", "must be key=value"},
      {"line_lenght=3", "there is no such key; did you mean line_length?"},
      {"filament.line_length=3", "there is no such key"},
      {"line_length=0", "[pressure_advance_pattern] line_length: 0 mm is outside"},
      {"line_length=", "is not TOML"},
      {"line_length=3\nx=4", "more than one value"},
      {"dialect=grbl", "must be \"klipper\""},
      {"tools=[0, 1.5]", "must be a whole number"},
      {"tools=3", "must be a list of whole numbers"},
      {"tools=[0, 99]", "99 is outside 0 ... 31"},
  };
  for (const Fault& fault : faults) {
    Config config;
    const auto done = OverrideConfig(fault.text, config);
    ASSERT_FALSE(done) << fault.text;
    EXPECT_THAT(done.error().message, HasSubstr(fault.says)) << fault.text;
  }
}

}  // namespace
}  // namespace trammel::files
