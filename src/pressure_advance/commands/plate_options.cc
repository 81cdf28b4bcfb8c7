#include "pressure_advance/commands/plate_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <utility>

#include "pressure_advance/files/print_footprint.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/plate_layout.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "session/checks.h"

namespace trammel::app {

void AddPlateOptions(CLI::App& command, AskedPlate& asked,
                     const std::vector<CLI::Option*>& of_one_answer) {
  CLI::Option* repeat = command.add_option(
      "--repeat", asked.repeat,
      "print so many patterns beside one another in one go, and say what they differ by; left out: "
      "one");
  repeat->check(CLI::Range(procedure::kFewestPatterns, procedure::kMostPatterns));
  CLI::Option* speeds = command.add_option(
      "--speeds", asked.conditions.speeds_mm_s,
      "fast speeds in mm/s, with commas: a pattern for each, beside one another, and pa table of "
      "them");
  CLI::Option* accelerations =
      command.add_option("--accelerations", asked.conditions.accelerations_mm_s2,
                         "accelerations in mm/s^2 likewise, each with each of the speeds");
  for (CLI::Option* option : {speeds, accelerations}) {
    option->delimiter(',')->excludes(repeat);
    for (CLI::Option* other : of_one_answer) option->excludes(other);
  }
  command
      .add_option("--max-flow", asked.conditions.max_flow_mm3_s,
                  "mm^3/s that the hot end melts: speeds that ask for more are refused")
      ->needs(speeds);
}

CLI::Option* AddClearOfOption(CLI::App& command, std::optional<std::string>& clear_of) {
  return command.add_option(
      "--clear-of", clear_of,
      "G-code file of a print: the pattern is put where it may stay on the plate for it");
}

Result<void> LayClearOf(const std::string& clear_of, const settings::ScanSettings* scanned,
                        const procedure::Reach& reach, pressure_advance::PatternConfig& pattern) {
  // As from a script whose variable is not set.
  if (clear_of.empty()) return Fail("--clear-of: must name a print's G-code file");
  constexpr double kBeside_mm = 10;  // what a print lays beside the bed counts, too
  const double right_mm = pattern.bed_origin_x_mm + pattern.bed_size_x_mm;
  const double back_mm = pattern.bed_origin_y_mm + pattern.bed_size_y_mm;
  auto print = files::ReadFootprint(
      clear_of,
      {pattern.bed_origin_x_mm - kBeside_mm, pattern.bed_origin_y_mm - kBeside_mm,
       right_mm + kBeside_mm, back_mm + kBeside_mm},
      pattern.layer_height_mm + procedure::kPassAbove_mm);
  if (!print) return tl::unexpected(print.error());
  // Where most printers home Z that do it by a probe.
  const double middle_x_mm = (pattern.bed_origin_x_mm + right_mm) / 2;
  const double middle_y_mm = (pattern.bed_origin_y_mm + back_mm) / 2;
  print->Mark(middle_x_mm, middle_y_mm, middle_x_mm, middle_y_mm);
  auto clear = procedure::PatternsClearOf(*print, std::move(pattern), scanned, reach);
  if (!clear) return tl::unexpected(clear.error());
  pattern = std::move(*clear);
  const auto at = OuterBounds(pattern);
  fmt::print(stderr,
             "  the pattern lies at X {:.0f} to {:.0f}, Y {:.0f} to {:.0f} mm, clear of {}\n",
             at.min_x_mm, at.max_x_mm, at.min_y_mm, at.max_y_mm, clear_of);
  return {};
}

Result<void> LayOnPlate(const AskedPlate& asked, const procedure::Reach& reach,
                        files::Config& config) {
  Result<pressure_advance::PatternConfig> laid = config.pattern;
  if (asked.repeat) {
    laid = procedure::PatternsBeside(config.pattern, *asked.repeat, config.scan, reach);
  } else if (asked.conditions.any()) {
    const auto conditions = CombineConditions(asked.conditions, config.pattern);
    if (!conditions) return tl::unexpected(conditions.error());
    laid = LayConditions(*conditions, config, reach);
  }
  if (!laid) return tl::unexpected(laid.error());
  const auto named_x_mm = config.pattern.position_x_mm;
  const auto named_y_mm = config.pattern.position_y_mm;
  config.pattern = std::move(*laid);
  if (!asked.clear_of) return {};
  // Where patterns were laid beside one another is no place that the settings name.
  config.pattern.position_x_mm = named_x_mm;
  config.pattern.position_y_mm = named_y_mm;
  return LayClearOf(*asked.clear_of, asked.photo ? nullptr : &config.scan, reach, config.pattern);
}

Result<void> LayOnPlateOf(const AskedPlate& asked, const procedure::Session& session,
                          files::Config& config) {
  if (!asked.repeat && !asked.conditions.any() && !asked.clear_of) return {};
  auto ready = procedure::FirstFailure(CheckReady(session), ErrorKind::kMachine);
  if (!ready) return ready;
  const auto reach = procedure::ReachOf(session);
  if (!reach) return tl::unexpected(reach.error());
  return LayOnPlate(asked, *reach, config);
}

}  // namespace trammel::app
