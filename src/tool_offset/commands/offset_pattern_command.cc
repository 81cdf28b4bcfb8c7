// trammel offset pattern: writes the G-code of the sheet of combs, its preview, and what it costs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/next_step.h"
#include "app/output_files.h"
#include "files/new_file.h"
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/commands/offset_recording.h"
#include "tool_offset/commands/sheet_options.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using tool_offset::SheetGcode;
using tool_offset::SheetPlan;

struct OffsetPatternArguments {
  SheetOptions sheet;
  std::string out = "offset.gcode";
  bool force = false;
};

Result<void> RunOffsetPattern(const OffsetPatternArguments& arguments) {
  const SheetConfig config = TRY(ConfigureSheet(arguments.sheet));
  TRY(CheckSheet(config));
  fmt::print("settings   {}\n", config.text.file);
  const fs::path gcode_path = arguments.out;
  if (!gcode_path.has_filename()) {
    return Fail(fmt::format("--out {}: must end in a file name", arguments.out));
  }
  const std::vector<fs::path> paths = SheetFiles(gcode_path);
  if (paths[1] == gcode_path || paths[2] == gcode_path) {
    return Fail(
        fmt::format("--out {}: must end as G-code does, .gcode for example", arguments.out));
  }
  TRY(RefuseToOverwrite(paths, arguments.force));
  const SheetPlan plan = PlanSheet(config.sheet);
  const SheetGcode gcode = WriteSheetGcode(plan);
  TRY(WriteSheet(gcode_path, plan, gcode, files::ReplaceIf(arguments.force)));
  fmt::print("G-code     {}\npreview    {} {}\n", paths[0].string(), paths[1].string(),
             paths[2].string());
  PrintSheetPlan(config.sheet, plan, gcode);
  SayNext("next",
          fmt::format("print it, scan the paper, then trammel offset analyze SCAN --pattern {} "
                      "--result offsets.json",
                      ShellQuoted(gcode_path.string())),
          11);
  return {};
}

}  // namespace

void AddOffsetPatternCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "pattern",
      "write the G-code of a sheet of combs, printed on paper by all tools, and pictures of it");
  auto arguments = std::make_shared<OffsetPatternArguments>();
  command->add_option("-o,--out", arguments->out, "G-code file; the scan is read with it")
      ->capture_default_str();
  AddSheetOptions(*command, arguments->sheet);
  command->add_option("--tool", arguments->sheet.tool,
                      "check this tool alone again, against the reference tool");
  command->add_flag("--self-test", arguments->sheet.self_test,
                    "the reference tool draws structures with known offsets");
  command->add_option("--dialect", arguments->sheet.dialect, "klipper, marlin or reprapfirmware");
  command->add_flag("--force", arguments->force, "overwrite files");
  command->callback([arguments, &exit_code] {
    const Result<void> done = RunOffsetPattern(*arguments);
    if (!done) exit_code = PrintError(done.error());
  });
}

}  // namespace trammel::app
