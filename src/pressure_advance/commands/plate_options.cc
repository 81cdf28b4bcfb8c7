#include "pressure_advance/commands/plate_options.h"

#include <CLI/CLI.hpp>
#include <utility>

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

Result<void> LayOnPlate(const AskedPlate& asked, const procedure::Reach& reach,
                        files::Config& config) {
  Result<pressure_advance::PatternConfig> laid = config.pattern;
  if (asked.repeat) {
    laid = procedure::PatternsBeside(config.pattern, *asked.repeat, config.scan, reach);
  } else if (asked.conditions.any()) {
    const auto conditions = TRY(CombineConditions(asked.conditions, config.pattern));
    laid = LayConditions(conditions, config, reach);
  }
  if (!laid) return tl::unexpected(laid.error());
  config.pattern = std::move(*laid);
  return {};
}

Result<void> LayOnPlateOf(const AskedPlate& asked, const procedure::Session& session,
                          files::Config& config) {
  if (!asked.repeat && !asked.conditions.any()) return {};
  TRY(procedure::FirstFailure(CheckReady(session), ErrorKind::kMachine));
  const auto reach = TRY(procedure::ReachOf(session));
  return LayOnPlate(asked, reach, config);
}

}  // namespace trammel::app
