#include "app/config/config_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/config/config_value.h"
#include "base/random.h"
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

TEST(ConfigKeys, EachHasAValueOfItsOwn) {
  // Two settings that share a value would set each other.
  Config config;
  const auto settings = SettingsOf(config);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_FALSE(settings[i].value == settings[j].value)
          << settings[i].key << ' ' << settings[j].key;
    }
  }
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

TEST(ConfigFile, SetsTheMachineThatScans) {
  const auto config = ParseConfig(
      "[moonraker]\n"
      "address = \"voron.local\"\n"
      "api_key = \"0123\"\n"
      "accept_any_certificate = true\n"
      "[camera]\n"
      "url = \"/dev/video0\"\n"
      "fps = 29.97\n"
      "width = 640\n"
      "crop = [837, 341, 45, 60]\n"
      "px_per_mm = 44\n"
      "height_direction = \"+y\"\n"
      "[scan]\n"
      "speed = 5\n"
      "nozzle_temperature = 140\n"
      "lights_off_gcode = \"SET_LED LED=chamber RED=0\"\n",
      "a.toml");
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_TRUE(ValidateConfig(*config, "", "a.toml"));
  const ScanSettings& scan = config->scan;
  EXPECT_EQ(scan.address, "voron.local");
  EXPECT_EQ(scan.api_key, "0123");
  EXPECT_TRUE(scan.accept_any_certificate);
  EXPECT_EQ(scan.camera, "/dev/video0");
  EXPECT_EQ(scan.frames_per_s, 29.97);
  EXPECT_EQ(scan.frame_width_px, 640);
  EXPECT_EQ(scan.frame_height_px, 720);
  EXPECT_EQ(scan.crop_px, (std::vector<double>{837, 341, 45, 60}));
  EXPECT_EQ(scan.px_per_mm, 44);
  EXPECT_EQ(scan.height_direction, AxisDirection::kPlusY);
  EXPECT_EQ(scan.scan_speed_mm_s, 5);
  EXPECT_EQ(scan.scan_nozzle_temperature_c, 140);
  EXPECT_EQ(scan.lights_off_gcode, "SET_LED LED=chamber RED=0");
  EXPECT_EQ(scan.laser_on_gcode, "_LASER_ON");
  EXPECT_EQ(config->pattern.nozzle_temperature_c, PatternConfig{}.nozzle_temperature_c);
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
      {"[printer]\nqwertzuiop = 5\n", "has no key qwertzuiop; trammel config keys lists"},
      {"[printers]\n", "a.toml:1: there is no section [printers]; did you mean printer?"},
      {"dialect = \"marlin\"\n", "a.toml:1: dialect belongs in [printer]"},
      {"printer = 3\n", "a.toml:1: printer is a section; write [printer]"},
      {"[printer]\ndialect = \"Marlin\"\n",
       "must be \"klipper\", \"marlin\" or \"reprapfirmware\", is 'Marlin'"},
      {"[printer]\nbed_size_x = \"250\"\n", "must be a number, is '250' (string)"},
      {"[printer]\nbed_size_x = [250]\n", "must be a number"},
      {"[printer]\nbed_size_x = 9007199254740993\n", "mm is outside"},
      {"[printer]\nbed_size_x = nan\n", "nan mm is outside"},
      {"[printer]\nbed_size_x = inf\n", "inf mm is outside"},
      {"[printer]\nstart_gcode = 3\n", "must be a text in quotes, is 3 (integer)"},
      {"[printer]\nstart_gcode = \"a\\u0000b\"\n", "control character 0x00"},
      {"[pressure_advance_pattern]\nline_count = 10.0\n", "must be a whole number"},
      {"[pressure_advance_pattern]\nline_count = 9223372036854775807\n", "far too large"},
      {"[pressure_advance_pattern]\nline_count = -1\n", "-1 is outside 2 ... 200"},
      {"[pressure_advance_pattern]\nalternate_directions = 1\n", "must be true or false, is 1"},
      {"[pressure_advance_pattern]\npressure_advances = 0.1\n", "must be a list of numbers"},
      {"[pressure_advance_pattern]\npressure_advances = [0, true]\n", "must be a number, is true"},
      {"[pressure_advance_pattern]\npressure_advances = [0, 11]\n", "11 s is outside 0 ... 10 s"},
      {"[pressure_advance_pattern]\nsegments = [[0.5, 5]]\n", "must be a list of {fraction"},
      {"[pressure_advance_pattern]\nsegments = [{fraction = 1}]\n", "needs both"},
      {"[pressure_advance_pattern]\nsegments = [{fraction = 1, speeed = 2}]\n", "not \"speeed\""},
      {"[printer]\nbed_size_x = 1\nbed_size_x = 2\n", "a.toml:3: is not TOML"},
      {"[printer\n", "a.toml:1: is not TOML"},
      {"[camera]\nheight_direction = \"up\"\n", "must be \"+x\", \"-x\", \"+y\" or \"-y\""},
      {"[camera]\nhight = 480\n", "[camera] has no key hight; did you mean height?"},
      {"[camera]\nspeed = 5\n", "[camera] has no key speed; it belongs in [scan]"},
      {"[camera]\nlaser_angle = 90\n", "a.toml:2: [camera] laser_angle: 90 ° is outside 5 ... 85"},
      {"[camera]\ncrop = [0, 0, -8, 8]\n", "[camera] crop: -8 px is outside"},
      {"[camera]\nwidth = 640.5\n", "must be a whole number"},
      {"[scan]\nspeed = 0\n", "[scan] speed: 0 mm/s is outside 0.1 ..."},
      {"[scan]\nskip = 0\n", "[scan] skip: 0 mm is outside 0.1 ..."},
      {"[moonraker]\naddress = 7125\n", "must be a text in quotes, is 7125"},
      {"[moonraker]\nmoonraker_api_key = \"\"\n", "has no key moonraker_api_key"},
      {"[scans]\n", "there is no section [scans]; did you mean scan?"},
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

TEST(ConfigFile, SaysWhatCannotBeInAScan) {
  const std::vector<Fault> faults{
      {"[camera]\ncrop = [0, 0, 45]\n", "a.toml:2: [camera] crop: has 3 number(s)"},
      {"[camera]\ncrop = [0, 0, 45.5, 60]\n", "crop: 45.5 px is not a whole number"},
      {"[camera]\ncrop = [0, 0, 45, 7]\n", "crop: 45 x 7 px is too small"},
      {"[moonraker]\napi_key = \"a\\r\\nHost: b\"\n", "api_key: holds a line break"},
      {"[camera]\nurl = \"http://a\\nb\"\n", "a.toml:2: [camera] url: holds a line break"},
  };
  for (const Fault& fault : faults) {
    const auto config = ParseConfig(fault.text, "a.toml");
    ASSERT_TRUE(config) << config.error().message;
    const auto valid = ValidateConfig(*config, fault.text, "a.toml");
    ASSERT_FALSE(valid) << fault.text;
    EXPECT_THAT(valid.error().message, HasSubstr(fault.says));
  }
  const char* const fine = "[scan]\nlaser_on_gcode = \"\"\nlaser_off_gcode = \"G4 P1\\nM5\"\n";
  const auto config = ParseConfig(fine, "a.toml");
  ASSERT_TRUE(config);
  EXPECT_TRUE(ValidateConfig(*config, fine, "a.toml"));
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

TEST(ConfigFile, SurvivesHostileText) {
  for (const std::string& text :
       {std::string(100000, '['), "[printer]\nbed_size_x = " + std::string(50000, '['),
        "a" + std::string(5000, '.') + "b = 1", std::string("\xff\xfe\x00\x01", 4),
        "[" + std::string(100000, 'x') + "]", std::string("[printer]\n\"\" = 1\n"),
        std::string("[printer.bed_size_x]\ny = 1\n"), std::string("[[printer]]\n")}) {
    EXPECT_FALSE(ParseConfig(text, "a.toml")) << text.substr(0, 40);
  }
  EXPECT_TRUE(ParseConfig("", "a.toml"));
  EXPECT_TRUE(ParseConfig("\xef\xbb\xbf[printer]\r\nbed_size_x = 200\r\n", "a.toml"));
}

TEST(ConfigFile, SurvivesRandomDamage) {
  const std::string good = DescribeConfigKeys();
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::string text = good;
    for (int i = 0; i < 3; ++i) {
      text[random.Below(text.size())] = static_cast<char>(random.Below(256));
    }
    // Whatever comes back, it comes back; and what is accepted can be judged.
    if (const auto config = ParseConfig(text, "a.toml")) {
      (void)ValidateConfig(*config, text, "a.toml");
    }
  }
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

TEST(ConfigOverride, AKeyOfTwoSectionsIsTheFirstUnlessItsSectionIsNamed) {
  Config config;
  EXPECT_TRUE(OverrideConfig("nozzle_temperature=240", config));
  EXPECT_EQ(config.pattern.nozzle_temperature_c, 240);
  EXPECT_EQ(config.scan.scan_nozzle_temperature_c, ScanSettings{}.scan_nozzle_temperature_c);
  EXPECT_TRUE(OverrideConfig("scan.nozzle_temperature=120", config));
  EXPECT_EQ(config.pattern.nozzle_temperature_c, 240);
  EXPECT_EQ(config.scan.scan_nozzle_temperature_c, 120);
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
