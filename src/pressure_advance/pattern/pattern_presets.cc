#include "pressure_advance/pattern/pattern_presets.h"

namespace trammel::pressure_advance {
namespace {

// No faster than the paper's pattern anywhere but where noted.
PatternConfig QuickPattern() {
  PatternConfig pattern;
  // Before the acceleration three lags of the slow flow, behind the deceleration as many and a
  // stretch to compare with; the fast stretch is the paper's, and so are its speed and flow.
  pattern.line_length_mm = 25;
  pattern.segments = {{0.16, 10}, {0.6, 150}, {0.24, 10}};
  pattern.line_spacing_mm = 3;
  pattern.alternate_directions = true;
  pattern.lift_between_lines = false;
  pattern.frame_loops = 1;
  pattern.frame_margin_mm = 2;
  pattern.frame_speed_mm_s = 50;  // a third of the fast stretches' flow
  pattern.approach_lift_mm = 5;
  return pattern;
}

settings::ScanSettings QuickScan() {
  settings::ScanSettings scan;
  scan.scan_speed_mm_s = 20;  // 0.67 mm a frame; travels run at 150 mm/s
  scan.skip_mm = 0.8;
  scan.run_up_mm = 0.5;
  scan.settle_s = 0.5;
  scan.lines_at_once = 5;
  return scan;
}

PatternConfig PatternOf(PatternPreset preset) {
  return preset == PatternPreset::kQuick ? QuickPattern() : PatternConfig{};
}

settings::ScanSettings ScanOf(PatternPreset preset) {
  return preset == PatternPreset::kQuick ? QuickScan() : settings::ScanSettings{};
}

PatternPreset BeforeOf(const PatternConfig& pattern) {
  return ParsePatternPreset(pattern.preset).value_or(PatternPreset::kPaper);
}

}  // namespace

std::string_view ToString(PatternPreset preset) {
  return preset == PatternPreset::kPaper ? "paper" : "quick";
}

std::optional<PatternPreset> ParsePatternPreset(std::string_view name) {
  for (const PatternPreset preset : {PatternPreset::kQuick, PatternPreset::kPaper}) {
    if (ToString(preset) == name) return preset;
  }
  return std::nullopt;
}

void ApplyPreset(PatternPreset preset, PatternConfig& pattern) {
  const PatternConfig was = PatternOf(BeforeOf(pattern));
  const PatternConfig becomes = PatternOf(preset);
  const auto follow = [&](auto PatternConfig::*field) {
    if (pattern.*field == was.*field) pattern.*field = becomes.*field;
  };
  follow(&PatternConfig::line_length_mm);
  follow(&PatternConfig::segments);
  follow(&PatternConfig::line_spacing_mm);
  follow(&PatternConfig::alternate_directions);
  follow(&PatternConfig::lift_between_lines);
  follow(&PatternConfig::frame_loops);
  follow(&PatternConfig::frame_margin_mm);
  follow(&PatternConfig::frame_speed_mm_s);
  follow(&PatternConfig::approach_lift_mm);
  pattern.preset = ToString(preset);
}

void ApplyPreset(PatternPreset preset, PatternConfig& pattern, settings::ScanSettings& scan) {
  using settings::ScanSettings;
  const ScanSettings was = ScanOf(BeforeOf(pattern));
  const ScanSettings becomes = ScanOf(preset);
  const auto follow = [&](auto ScanSettings::*field) {
    if (scan.*field == was.*field) scan.*field = becomes.*field;
  };
  follow(&ScanSettings::scan_speed_mm_s);
  follow(&ScanSettings::skip_mm);
  follow(&ScanSettings::run_up_mm);
  follow(&ScanSettings::settle_s);
  follow(&ScanSettings::lines_at_once);
  ApplyPreset(preset, pattern);
}

}  // namespace trammel::pressure_advance
