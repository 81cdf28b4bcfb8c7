// trammel offset pattern: writes the G-code of the sheet of combs, its preview, and what it costs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/config/config_file.h"
#include "app/config_text.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "files/new_file.h"
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/report/sheet_preview.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_fields.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using tool_offset::SheetGcode;
using tool_offset::SheetPlan;
using tool_offset::SheetSettings;

struct OffsetPatternArguments {
  std::string config;
  std::vector<std::string> set;
  std::string out = "offset.gcode";
  std::vector<std::string> previews;
  std::string dialect;
  std::string material;
  std::string tool_change;
  std::optional<int> tool;
  bool self_test = false;
  bool for_photo = false;
  bool force = false;
};

/// The ways in which machines commonly change tools, by name.
Result<std::string> ToolChange(const std::string& name) {
  const std::string activate = "ACTIVATE_EXTRUDER EXTRUDER={extruder}";
  if (name == "t") return std::string("T{tool}");
  if (name == "activate-extruder") return activate;
  if (name == "idex") return "SET_DUAL_CARRIAGE CARRIAGE={tool}\n" + activate;
  return Fail(
      fmt::format("--tool-change {}: must be t, activate-extruder or idex; any other G-code "
                  "is tool_change_gcode in [{}]",
                  name, tool_offset::kSheetSection));
}

/// The shortcuts of the command line, over what the file says.
Result<void> Override(const OffsetPatternArguments& arguments, files::Config& config) {
  std::vector<std::string> assignments = arguments.set;
  if (!arguments.dialect.empty()) assignments.push_back("dialect=" + arguments.dialect);
  for (const std::string& assignment : assignments) {
    if (auto done = files::OverrideConfig(assignment, config, tool_offset::kSheetSection); !done) {
      return done;
    }
  }
  TakeMaterial(arguments.material, config);
  SheetSettings& sheet = config.sheet;
  if (!arguments.tool_change.empty()) {
    auto gcode = ToolChange(arguments.tool_change);
    if (!gcode) return tl::unexpected(gcode.error());
    sheet.tool_change_gcode = std::move(*gcode);
  }
  if (arguments.tool && arguments.self_test) {
    return Fail(
        "--tool and --self-test: a self-test draws with the reference tool alone; leave "
        "one of them out");
  }
  if (arguments.for_photo) sheet.for_photo = true;
  if (arguments.tool) sheet.tools = {sheet.reference_tool, *arguments.tool};
  if (arguments.self_test) {
    sheet.self_test = true;
    sheet.tools = {sheet.reference_tool};
  }
  return {};
}

Result<SheetSettings> Configure(const OffsetPatternArguments& arguments) {
  const Result<ConfigText> text = FindConfig(arguments.config);
  if (!text) return tl::unexpected(text.error());
  Result<files::Config> config = files::ParseConfig(text->text, text->file);
  if (!config) return tl::unexpected(config.error());
  if (auto done = Override(arguments, *config); !done) return tl::unexpected(done.error());
  SheetSettings sheet = files::SheetOf(*config);
  auto problem = FindProblem(sheet);
  if (!problem) problem = FindTemperatureProblem(sheet);
  if (problem) {
    return tl::unexpected(files::LocateProblem(*problem, *config, text->text, text->file));
  }
  fmt::print("settings   {}\n", text->file);
  return sheet;
}

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

void Print(const SheetSettings& asked, const SheetPlan& plan, const SheetGcode& gcode) {
  const auto minutes = static_cast<int>(gcode.time_s / 60);
  fmt::print("sheet      {}: {:.1f} x {:.1f} mm, turned by {:.4g} degrees\n", plan.sheet_id,
             plan.width_mm, plan.height_mm, plan.settings.tilt_deg);
  if (plan.settings.teeth < asked.teeth) {
    fmt::print("teeth      {} instead of {}, so that it fits {} paper\n", plan.settings.teeth,
               asked.teeth, plan.settings.paper);
  }
  fmt::print("heated to  {}, once the paper is taped down on the cold bed\n",
             DescribeTemperatures(plan.settings));
  fmt::print("structures {}, tool changes {}\n", plan.structures.size(), gcode.tool_changes);
  fmt::print("filament   {:.1f} mm\n", gcode.filament_mm);
  fmt::print("time       {} min {:.0f} s without heating and tool changes\n", minutes,
             gcode.time_s - 60 * minutes);
  const tool_offset::BedBounds bounds =
      tool_offset::SheetBounds(plan.settings, plan.width_mm, plan.height_mm);
  fmt::print(
      "bounds     X {:.2f} ... {:.2f} mm, Y {:.2f} ... {:.2f} mm: paper of at least {:.0f} x "
      "{:.0f} mm\n",
      bounds.min_x_mm, bounds.max_x_mm, bounds.min_y_mm, bounds.max_y_mm,
      std::ceil(bounds.max_x_mm - bounds.min_x_mm), std::ceil(bounds.max_y_mm - bounds.min_y_mm));
  if (const auto paper = tool_offset::PaperAround(plan)) {
    fmt::print("paper      {}, its middle at X {:.0f}, Y {:.0f} mm, its edges along the bed's\n",
               paper->name, (paper->bounds.min_x_mm + paper->bounds.max_x_mm) / 2,
               (paper->bounds.min_y_mm + paper->bounds.max_y_mm) / 2);
  }
  for (const std::string& warning : FindWarnings(plan.settings)) {
    fmt::print(stderr, "warning: {}\n", warning);
  }
}

Result<void> RunOffsetPattern(const OffsetPatternArguments& arguments) {
  const Result<SheetSettings> settings = Configure(arguments);
  if (!settings) return tl::unexpected(settings.error());
  const fs::path gcode_path = arguments.out;
  if (!gcode_path.has_filename()) {
    return Fail(fmt::format("--out {}: must end in a file name", arguments.out));
  }
  const Result<std::vector<fs::path>> previews = PreviewPaths(arguments);
  if (!previews) return tl::unexpected(previews.error());
  std::vector<fs::path> paths = *previews;
  paths.push_back(gcode_path);
  if (auto may = RefuseToOverwrite(paths, arguments.force); !may) return may;

  const SheetPlan plan = PlanSheet(*settings);
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
  Print(*settings, plan, gcode);
  return {};
}

}  // namespace

void AddOffsetPatternCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "pattern", "write the G-code of a sheet of combs, printed on paper by all tools");
  auto arguments = std::make_shared<OffsetPatternArguments>();
  command->add_option("--config", arguments->config,
                      "settings; left out: trammel.toml of this folder, if there is one");
  command->add_option("--set", arguments->set, "one setting: key=value; may be repeated");
  command->add_option("-o,--out", arguments->out, "G-code file; the scan is read with it")
      ->capture_default_str();
  command->add_option("--preview", arguments->previews,
                      "picture of the sheet, .svg or .png; left out: both, beside the G-code");
  command->add_option("--tool", arguments->tool,
                      "check this tool alone again, against the reference tool");
  command->add_flag("--self-test", arguments->self_test,
                    "the reference tool draws structures with known offsets");
  command->add_flag("--for-photo", arguments->for_photo,
                    "arrange the sheet for a photo by a phone, where there is no scanner");
  command->add_option(
      "--tool-change", arguments->tool_change,
      "how tools are changed: t (T0, T1, ...), activate-extruder or idex (Klipper)");
  command->add_option("--dialect", arguments->dialect, "klipper, marlin or reprapfirmware");
  AddMaterialOption(*command, arguments->material);
  command->add_flag("--force", arguments->force, "overwrite files");
  command->callback([arguments, &exit_code] {
    const Result<void> done = RunOffsetPattern(*arguments);
    if (!done) exit_code = PrintError(done.error());
  });
}

}  // namespace trammel::app
