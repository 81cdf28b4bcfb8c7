#include "tool_offset/commands/offset_commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "files/new_file.h"
#include "machine/scanner/scanner.h"
#include "tool_offset/commands/offset_recording.h"
#include "tool_offset/commands/sheet_options.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel::app {
void AddOffsetCommands(CLI::App& offset, int& exit_code) {
  offset.require_subcommand(1);
  AddOffsetStartCommand(offset, exit_code);
  AddOffsetPatternCommand(offset, exit_code);
  AddOffsetApplyCommand(offset, exit_code);
  AddOffsetScanCommand(offset, exit_code);
  AddOffsetAnalyzeCommand(offset, exit_code);
  AddOffsetMeasureCommand(offset, exit_code);
}

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
  PrintWrapped(
      "next",
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

namespace {

struct ScanArguments {
  bool list = false;
  std::string out;
  machine::ScanRequest request;
  std::vector<double> area_mm;
  std::vector<std::string> options;
  double max_megapixels = 4000;
};

int List() {
  const auto scanners = machine::ListScanners();
  if (!scanners) return PrintError(scanners.error());
  for (const machine::ScannerInfo& scanner : *scanners) {
    fmt::print("{}\n    {} {}, {}\n", scanner.name, scanner.vendor, scanner.model, scanner.kind);
  }
  if (!scanners->empty()) return kExitGood;
  fmt::print(stderr,
             "no scanner was found: switch it on, look at cable or network, and whether "
             "scanimage -L finds it\n");
  return kExitMachine;
}

Result<machine::ScanRequest> RequestOf(const ScanArguments& arguments) {
  machine::ScanRequest request = arguments.request;
  if (!arguments.area_mm.empty()) {
    request.area = {arguments.area_mm[0], arguments.area_mm[1], arguments.area_mm[2],
                    arguments.area_mm[3]};
    if (!(request.area->width_mm > 0 && request.area->height_mm > 0)) {
      return Fail(fmt::format("--area: {} x {} mm is no area; give X Y WIDTH HEIGHT in mm",
                              request.area->width_mm, request.area->height_mm));
    }
  }
  for (const std::string& option : arguments.options) {
    const std::size_t equals = option.find('=');
    if (equals == std::string::npos || equals == 0) {
      return Fail(fmt::format("--option {}: write NAME=VALUE, as in source=Flatbed", option));
    }
    request.options.emplace_back(option.substr(0, equals), option.substr(equals + 1));
  }
  return request;
}

int Run(const ScanArguments& arguments) {
  if (arguments.list) return List();
  if (arguments.out.empty()) {
    return PrintError(
        {ErrorKind::kInput, "--out is missing: FILE.png or FILE.tiff, or use --list"});
  }
  // Checked before minutes of scanning.
  if (auto checked = machine::CheckPagePath(arguments.out); !checked) {
    return PrintError(checked.error());
  }
  const Interrupt interrupt;
  const auto request = RequestOf(arguments);
  if (!request) return PrintError(request.error());
  const bool terminal = isatty(STDERR_FILENO) != 0;
  int shown = -1;
  const auto progress = [&](double share) {
    constexpr int kStep = 10;
    const int percent = static_cast<int>(100 * share) / kStep * kStep;
    if (terminal && percent != shown) fmt::print(stderr, "  scanning {:3} %\n", percent);
    shown = percent;
  };
  machine::PageReadOptions limits;
  limits.most_pixels = static_cast<std::int64_t>(1e6 * arguments.max_megapixels);
  const auto page = machine::ScanPage(*request, arguments.out, limits, progress, interrupt.token());
  if (!page) return PrintError(page.error());
  fmt::print("{}: {} x {} px, {}, {:g} dpi\n", arguments.out, page->width, page->height,
             page->channels == 1 ? "grey" : "colour", *page->dpi_x);
  PrintWrapped("next",
               fmt::format("trammel offset analyze {} --pattern GCODE --result offsets.json",
                           ShellQuoted(arguments.out)));
  return kExitGood;
}

}  // namespace

void AddOffsetScanCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand("scan", "scan the printed sheet on a flatbed");
  const auto arguments = std::make_shared<ScanArguments>();
  command->add_flag("--list", arguments->list, "name the scanners that there are");
  command->add_option("-o,--out", arguments->out, "new file: .png, .tif or .tiff");
  command->add_option("--device", arguments->request.device,
                      "the scanner, as --list names it; left out: the only one");
  command->add_option("--dpi", arguments->request.dpi, "resolution; more than 600 gains nothing")
      ->check(NumberIn(50.0, 9600.0))
      ->capture_default_str();
  command->add_flag("--color", arguments->request.color,
                    "in colour: for filaments that are no darker than the paper");
  command->add_option("--area", arguments->area_mm, "X Y WIDTH HEIGHT on the glass, in mm")
      ->expected(4);
  command->add_option("--option", arguments->options,
                      "one of SANE's own options: NAME=VALUE; may be repeated");
  command->add_option("--most-megapixels", arguments->max_megapixels, "of the page")
      ->check(NumberIn(1.0, 100000.0))
      ->capture_default_str();
  command->callback([arguments, &exit_code] { exit_code = Run(*arguments); });
}

}  // namespace trammel::app
