// trammel pa table
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "base/json_text.h"
#include "files/whole_file.h"
#include "pressure_advance/commands/conditions_run.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/files/orca_profile.h"
#include "pressure_advance/flow/flow_table.h"

namespace trammel::app {
namespace {

using pressure_advance::FlowTable;

constexpr std::size_t kMaxRecordings = 1000;

struct TableArguments {
  std::vector<std::string> recordings;
  bool json = false;
  std::string orca;
  std::string out;
  std::optional<double> layer_height_mm;
  double filament_diameter_mm = 1.75;
  bool force = false;
};

// Writes the profile, and returns its notice.
Result<std::string> WriteProfile(const TableArguments& arguments, const FlowTable& table) {
  constexpr std::size_t kMaxBytes = 4'000'000;
  const auto heights_mm = pressure_advance::LayerHeights_mm(table.rows);
  if (heights_mm.size() > 1) {
    return Fail(
        fmt::format("the calibrations are of layers of {:.3g} mm, and OrcaSlicer's model has flow "
                    "and acceleration alone: choose one by --layer-height, and make a profile of "
                    "each",
                    fmt::join(heights_mm, " and ")));
  }
  const auto rows = pressure_advance::AdaptiveRows(table);
  if (rows.empty()) {
    return Fail(
        "OrcaSlicer wants two flows at least for an acceleration, and no acceleration has "
        "them: calibrate with another fast speed, too");
  }
  const auto profile = TRY(files::ReadNamedFile(arguments.orca, kMaxBytes));
  const auto made =
      TRY(files::WithPressureAdvance(profile, arguments.orca, table.single_s.value, rows));
  TRY(WriteOutputs({{arguments.out, made.text}}, arguments.force));
  return fmt::format(
      "{} rows{} and one value, {:.4f} s, in {}: import it in OrcaSlicer, for layers of {:.3g} mm",
      rows.size(),
      rows.size() < table.rows.size()
          ? fmt::format(" of {} (an acceleration with one flow is left out)", table.rows.size())
          : "",
      table.single_s.value, arguments.out, fmt::join(heights_mm, ""));
}

Result<int> RunTable(const TableArguments& arguments) {
  if (arguments.orca.empty() != arguments.out.empty()) {
    return Fail("--orca PROFILE and -o PROFILE go together");
  }
  if (!arguments.out.empty()) {
    TRY(RefuseToOverwrite({arguments.out}, arguments.force));
  }
  const auto table = TRY(TableOf(arguments.recordings, arguments.layer_height_mm));
  std::string profile;
  if (!arguments.orca.empty()) {
    profile = TRY(WriteProfile(arguments, table));
  }
  if (arguments.json) {
    fmt::print("{}", JsonText(TableJson(table)));
  } else {
    PrintTable(table, arguments.filament_diameter_mm);
    if (!profile.empty()) fmt::print("OrcaSlicer        {}\n", profile);
  }
  return kExitGood;
}

}  // namespace

void AddTableCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "table", "pressure advance over flow and acceleration, from several calibrations");
  const auto arguments = std::make_shared<TableArguments>();
  command
      ->add_option("recordings", arguments->recordings,
                   "their folders: one filament, other fast speeds or accelerations")
      ->required()
      ->expected(1, static_cast<int>(kMaxRecordings));
  command->add_flag("--json", arguments->json, "print everything as one JSON object");
  command->add_option("--orca", arguments->orca,
                      "a filament profile exported from OrcaSlicer, for its adaptive pressure "
                      "advance");
  command->add_option("-o,--out", arguments->out, "the profile to import there");
  command
      ->add_option("--layer-height", arguments->layer_height_mm,
                   "mm; calibrations in layers of this height alone; left out: all")
      ->check(CLI::Range(0.001, 10.0));
  command
      ->add_option("--filament-diameter", arguments->filament_diameter_mm,
                   "mm; for the law as firmware has it")
      ->check(CLI::Range(1.0, 4.0))
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "overwrite it");
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunTable(*arguments)); });
}

}  // namespace trammel::app
