#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "settings/scan_settings.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

struct Refusal {
  const char* claim;
  std::function<void(PatternConfig&)> spoil;
  const char* key;
  const char* says;
};

TEST(ScanValidate, ANozzleThatIsToCoolBelowAnyRoomIsRefusedAndZeroIsOff) {
  settings::ScanSettings settings;
  for (const double reachable_c : {0.0, 50.0, 150.0}) {
    settings.scan_nozzle_temperature_c = reachable_c;
    EXPECT_FALSE(FindProblem(settings)) << reachable_c;
  }
  for (const double out_of_reach_c : {0.5, 20.0, 49.0}) {
    settings.scan_nozzle_temperature_c = out_of_reach_c;
    const auto problem = FindProblem(settings);
    ASSERT_TRUE(problem) << out_of_reach_c;
    EXPECT_EQ(problem->key, "nozzle_temperature");
    EXPECT_THAT(problem->message, HasSubstr("below 50 °C"));
  }
}

TEST(PatternValidate, NamesTheSettingTheValueAndTheBound) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Refusal> refusals{
      {"off the bed", [](auto& c) { c.position_x_mm = 230; }, "position_x",
       "230.000 ... 262.068 mm, but the bed less bed_margin = 5 mm is 5 ... 245 mm"},
      {"too deep", [](auto& c) { c.line_spacing_mm = 30; }, "line_count", "is 5 ... 245 mm"},
      {"off a round bed",
       [](auto& c) {
         c.bed_shape = settings::BedShape::kEllipse;
         c.position_x_mm = 10;
         c.position_y_mm = 10;
       },
       "position_x", "round"},
      {"no frame to mark",
       [](auto& c) {
         c.corner_mark = true;
         c.frame_loops = 0;
       },
       "corner_mark", "frame_loops"},
      {"no room for a mark",
       [](auto& c) {
         c.corner_mark = true;
         c.frame_margin_mm = 1.5;
       },
       "corner_mark", "set frame_margin (now 1.5 mm) to 3.0 or more"},
      {"reversed range", [](auto& c) { c.pressure_advance_start_s = 0.1; }, "pressure_advance_end",
       "0.06 s is not above pressure_advance_start = 0.1 s"},
      {"empty range", [](auto& c) { c.pressure_advance_end_s = 0; }, "pressure_advance_end",
       "0 s is not above"},
      {"range finer than G-code", [](auto& c) { c.pressure_advance_end_s = 2e-5; },
       "pressure_advance_end", "stands twice"},
      {"duplicates",
       [](auto& c) {
         c.pressure_advances_s = {0, 0.02, 0.04, 0.02};
       },
       "pressure_advances", "0.02 s stands twice"},
      {"one value", [](auto& c) { c.pressure_advances_s = {0.02}; }, "pressure_advances",
       "1 value(s); a pattern has 2 ... 200"},
      {"negative value",
       [](auto& c) {
         c.pressure_advances_s = {-0.01, 0.02};
       },
       "pressure_advances", "-0.01 s is outside 0 ... 10 s"},
      {"beads that touch", [](auto& c) { c.line_spacing_mm = 0.4; }, "line_spacing",
       "0.4 mm is not above line_width = 0.495 mm"},
      {"cold nozzle", [](auto& c) { c.nozzle_temperature_c = 25; }, "nozzle_temperature",
       "25 °C is outside 170 ... 500 °C"},
      {"zero length", [](auto& c) { c.line_length_mm = 0; }, "line_length",
       "0 mm is outside 1 ... 2000 mm"},
      {"NaN", [&](auto& c) { c.layer_height_mm = nan; }, "layer_height", "nan mm is outside"},
      {"infinite", [](auto& c) { c.retract_length_mm = 1 / 0.0; }, "retract_length", "inf"},
      {"absurd", [](auto& c) { c.acceleration_mm_s2 = 1e300; }, "acceleration", "1e+300"},
      {"NaN where optional", [&](auto& c) { c.park_x_mm = nan; }, "park_x", "nan"},
      {"one line", [](auto& c) { c.line_count = 1; }, "line_count", "1 is outside 2 ... 200"},
      {"fractions", [](auto& c) { c.segments[0].fraction = 0.3; }, "segments", "add up to 1.05"},
      {"no change of speed", [](auto& c) { c.segments[1].speed_mm_s = 5; }, "segments",
       "all run at 5 mm/s"},
      {"NaN in a segment", [&](auto& c) { c.segments[1].speed_mm_s = nan; }, "segments",
       "speed nan mm/s of segment 2"},
      {"speed never reached", [](auto& c) { c.acceleration_mm_s2 = 1000; }, "segments",
       "segment 2 is 15.000 mm long, but reaching 150 mm/s at 1000 mm/s^2"},
      {"layer above nozzle", [](auto& c) { c.layer_height_mm = 0.41; }, "layer_height",
       "0.41 mm is above nozzle_diameter = 0.4 mm"},
      {"bead narrower than its layer", [](auto& c) { c.line_width_mm = 0.2; }, "line_width",
       "0.2 mm is outside 0.25"},
      {"gouging", [](auto& c) { c.z_offset_mm = -0.2; }, "z_offset", "-0.2 mm is below -0.125 mm"},
      {"frame on a line", [](auto& c) { c.frame_margin_mm = 0.3; }, "frame_margin", "0.3 mm"},
      {"overlap beyond the bead", [](auto& c) { c.frame_overlap_mm = 0.6; }, "frame_overlap",
       "0.6 mm is above line_width = 0.495 mm"},
      {"parking off the bed", [](auto& c) { c.park_y_mm = 260; }, "park_y",
       "260 mm is off the bed, 0 ... 250 mm"},
      {"parking off a round bed",
       [](auto& c) {
         c.bed_shape = settings::BedShape::kEllipse;
         c.park_x_mm = 5;
       },
       "park_x", "(5, 5) mm is at 1.3"},
      {"too many lines",
       [](auto& c) {
         c.columns = c.rows = 100;
         c.line_count = 200;
       },
       "columns", "2000000 lines; at most 10000"},
      {"unknown placeholder", [](auto& c) { c.end_gcode = "M104 S{hot}"; }, "end_gcode",
       "unknown placeholder {hot}"},
      {"control character", [](auto& c) { c.start_gcode = std::string("G28\0M112", 8); },
       "start_gcode", "control character 0x00"},
  };
  for (const Refusal& refusal : refusals) {
    PatternConfig config;
    refusal.spoil(config);
    const auto problem = FindProblem(config);
    ASSERT_TRUE(problem) << refusal.claim;
    EXPECT_EQ(problem->key, refusal.key) << refusal.claim << ": " << problem->message;
    EXPECT_THAT(problem->message, HasSubstr(refusal.says)) << refusal.claim;
    EXPECT_FALSE(Validate(config)) << refusal.claim;
  }
}

TEST(PatternValidate, AMarkMakesItsOwnRoomUnlessTheMarginIsSet) {
  PatternConfig config;
  config.corner_mark = true;
  config.line_spacing_mm = 1.5;
  for (const double width_mm : {0.3, 0.495, 0.8, 1.2}) {
    config.line_width_mm = width_mm;
    config.layer_height_mm = width_mm / 2;
    config.nozzle_diameter_mm = 0.8 * width_mm;
    const auto valid = Validate(config);
    EXPECT_TRUE(valid) << width_mm << ": " << valid.error().message;
  }
  config.frame_margin_mm = 1.5;
  EXPECT_FALSE(Validate(config));
}

PatternConfig OfPreset(PatternPreset preset) {
  PatternConfig config;
  ApplyPreset(preset, config);
  return config;
}

TEST(PatternValidate, EachRemedyOfAMissingSteadyStretchSuffices) {
  int refused = 0;
  for (const double acceleration_mm_s2 : {200.0, 700.0, 1500.0, 1900.0}) {
    for (const double fast_mm_s : {40.0, 63.0, 98.0, 150.0, 177.0}) {
      for (const double length_mm : {15.0, 25.0, 33.0, 60.0}) {
        for (const double slow_after_mm_s : {2.0, 10.0, 30.0}) {
          PatternConfig config = OfPreset(kDefaultPreset);
          config.acceleration_mm_s2 = acceleration_mm_s2;
          config.line_length_mm = length_mm;
          config.segments[1].speed_mm_s = fast_mm_s;
          config.segments[2].speed_mm_s = slow_after_mm_s;
          const auto problem = FindProblem(config);
          if (!problem || problem->key != "acceleration") continue;
          ++refused;
          double speed_mm_s = 0, faster_mm_s2 = 0, longer_mm = 0;
          const std::size_t at = problem->message.find("take at most");
          ASSERT_NE(at, std::string::npos) << problem->message;
          ASSERT_EQ(std::sscanf(problem->message.c_str() + at,
                                "take at most %lf mm/s, at least %lf mm/s^2, or lines of at least "
                                "%lf mm",
                                &speed_mm_s, &faster_mm_s2, &longer_mm),
                    3)
              << problem->message;
          PatternConfig slower = config, faster = config, longer = config;
          slower.segments[1].speed_mm_s = speed_mm_s;
          faster.acceleration_mm_s2 = faster_mm_s2;
          longer.line_length_mm = longer_mm;
          for (const PatternConfig& remedied : {slower, faster, longer}) {
            const auto valid = Validate(remedied);
            EXPECT_TRUE(valid) << problem->message << " -> " << valid.error().message;
          }
        }
      }
    }
  }
  EXPECT_GT(refused, 20);
}

TEST(PatternValidate, TakesWhatPresetsAndPagesName) {
  for (const PatternPreset preset : {PatternPreset::kQuick, PatternPreset::kPaper}) {
    PatternConfig config = OfPreset(preset);
    EXPECT_TRUE(Validate(config)) << ToString(preset);
    for (const double fast_mm_s : {60.0, 100.0, 150.0}) {
      config.segments[1].speed_mm_s = fast_mm_s;
      EXPECT_TRUE(Validate(config)) << ToString(preset) << fast_mm_s;
    }
    config.acceleration_mm_s2 = 1500;
    for (const double fast_mm_s :
         {60.0, 90.0, 100.0, 120.0}) {  // docs/howto/calibrate.md: --speeds
      config.segments[1].speed_mm_s = fast_mm_s;
      EXPECT_TRUE(Validate(config)) << ToString(preset) << fast_mm_s;
    }
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
