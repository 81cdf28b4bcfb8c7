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
#include "tool_offset/commands/sheet_options.h"
#include "tool_offset/report/sheet_preview.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using tool_offset::SheetGcode;
using tool_offset::SheetPlan;

struct OffsetPatternArguments {
  SheetOptions sheet;
  std::string out = "offset.gcode";
  std::vector<std::string> previews;
  bool force = false;
};

/// Where previews go: as asked, else beside the G-code.
Result<std::vector<fs::path>> PreviewPaths(const OffsetPatternArguments& arguments) {
  std::vector<fs::path> paths;
  for (const std::string& preview : arguments.previews) {
    const fs::path path = preview;
    if (path.extension() != ".svg" && path.extension() != ".png") {
      return Fail(fmt::format("--preview {}: must end in .svg or .png", preview));
    }
    paths.push_back(path);
  }
  if (!paths.empty()) return paths;
  for (const char* extension : {".svg", ".png"}) {
    paths.push_back(fs::path(arguments.out).replace_extension(extension));
  }
  return paths;
}

Result<void> RunOffsetPattern(const OffsetPatternArguments& arguments) {
  const Result<SheetConfig> config = ConfigureSheet(arguments.sheet);
  if (!config) return tl::unexpected(config.error());
  if (auto sound = CheckSheet(*config); !sound) return sound;
  fmt::print("settings   {}\n", config->text.file);
  const fs::path gcode_path = arguments.out;
  if (!gcode_path.has_filename()) {
    return Fail(fmt::format("--out {}: must end in a file name", arguments.out));
  }
  const Result<std::vector<fs::path>> previews = PreviewPaths(arguments);
  if (!previews) return tl::unexpected(previews.error());
  std::vector<fs::path> paths = *previews;
  paths.push_back(gcode_path);
  if (auto may = RefuseToOverwrite(paths, arguments.force); !may) return may;

  const SheetPlan plan = PlanSheet(config->sheet);
  const SheetGcode gcode = WriteSheetGcode(plan);
  if (auto done = files::WriteWholeFile(gcode_path, gcode.text, files::ReplaceIf(arguments.force));
      !done)
    return done;
  const report::Canvas preview = report::SheetPreview(plan);
  std::string shown;
  for (const fs::path& path : *previews) {
    const std::string bytes = path.extension() == ".svg" ? preview.ToSvg() : preview.ToPng();
    if (auto done = files::WriteWholeFile(path, bytes, files::ReplaceIf(arguments.force)); !done)
      return done;
    shown += " " + path.string();
  }
  fmt::print("G-code     {}\npreview   {}\n", gcode_path.string(), shown);
  PrintSheetPlan(config->sheet, plan, gcode);
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
      "pattern", "write the G-code of a sheet of combs, printed on paper by all tools");
  auto arguments = std::make_shared<OffsetPatternArguments>();
  command->add_option("-o,--out", arguments->out, "G-code file; the scan is read with it")
      ->capture_default_str();
  command->add_option("--preview", arguments->previews,
                      "picture of the sheet, .svg or .png; left out: both, beside the G-code");
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
