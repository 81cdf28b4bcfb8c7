// trammel align targets: pages of ring-coded targets to print.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/report/target_pages.h"
#include "part_alignment/targets/target.h"
#include "part_alignment/targets/target_sheet.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::PlacedTarget;
using part_alignment::PlanTargetSheet;
using part_alignment::SheetRequest;
using part_alignment::TargetSheet;

struct AlignTargetsArguments {
  SheetRequest request;
  std::string page = "a4";
  std::string out = "targets.pdf";
  std::string layout;
  bool force = false;
};

Result<void> SetPage(const std::string& name, SheetRequest& request) {
  if (name == "a4") return {};
  const auto set = [&](double width_mm, double height_mm) -> Result<void> {
    request.page_width_mm = width_mm;
    request.page_height_mm = height_mm;
    return {};
  };
  if (name == "a3") return set(297, 420);
  if (name == "letter") return set(215.9, 279.4);
  double width_mm = 0;
  double height_mm = 0;
  int read = 0;
  if (std::sscanf(name.c_str(), "%lfx%lf%n", &width_mm, &height_mm, &read) == 2 &&
      static_cast<std::size_t>(read) == name.size()) {
    return set(width_mm, height_mm);
  }
  return Fail(fmt::format("--page {}: must be a4, a3, letter or WIDTHxHEIGHT in mm", name));
}

/// Returns the printed layout as JSON, for programs.
std::string LayoutJson(const TargetSheet& sheet) {
  const SheetRequest& request = sheet.request;
  nlohmann::ordered_json json;
  json["format"] = 1;
  json["bits"] = request.bits;
  json["radius_mm"] = request.radius_mm;
  json["ring_inner_mm"] = part_alignment::kRingInner * request.radius_mm;
  json["ring_outer_mm"] = part_alignment::kRingOuter * request.radius_mm;
  json["bright"] = request.bright;
  json["page_mm"] = {request.page_width_mm, request.page_height_mm};
  json["scale_bar_mm"] = sheet.scale_bar.length_mm;
  json["targets"] = nlohmann::ordered_json::array();
  for (const PlacedTarget& target : sheet.targets) {
    nlohmann::ordered_json entry;
    const bool coded = target.number > 0;
    entry["number"] = coded ? nlohmann::ordered_json(target.number) : nullptr;
    entry["word"] = coded ? nlohmann::ordered_json(target.word) : nullptr;
    entry["page"] = target.page + 1;
    entry["x_mm"] = target.x_mm;
    entry["y_mm"] = target.y_mm;
    json["targets"].push_back(std::move(entry));
  }
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Result<std::vector<OutputFile>> DrawFiles(const AlignTargetsArguments& arguments,
                                          const TargetSheet& sheet) {
  const fs::path out = arguments.out;
  std::vector<OutputFile> files;
  if (out.extension() == ".pdf" && out.has_stem()) {
    files.push_back({out, report::TargetPagesPdf(sheet)});
  } else if (out.extension() == ".svg" && out.has_stem()) {
    for (int page = 0; page < sheet.pages; ++page) {
      const std::string name = sheet.pages == 1
                                   ? out.filename().string()
                                   : fmt::format("{}-{}.svg", out.stem().string(), page + 1);
      files.push_back({out.parent_path() / name, report::TargetPageSvg(sheet, page)});
    }
  } else {
    return Fail(fmt::format("--out {}: must end in .pdf or .svg", arguments.out));
  }
  if (!arguments.layout.empty()) files.push_back({arguments.layout, LayoutJson(sheet)});
  return files;
}

void PrintSheetSummary(const TargetSheet& sheet) {
  const SheetRequest& request = sheet.request;
  const std::string pages = fmt::format("on {} page{}", sheet.pages, sheet.pages == 1 ? "" : "s");
  fmt::print("targets    {} coded with {} bits, {} plain, {}\n", request.count, request.bits,
             request.plain, pages);
  fmt::print("check      the scale bar must measure {:.0f} mm: print at 100 %\n",
             sheet.scale_bar.length_mm);
}

Result<int> RunAlignTargets(AlignTargetsArguments arguments) {
  TRY(SetPage(arguments.page, arguments.request));
  const TargetSheet sheet = TRY(PlanTargetSheet(arguments.request));
  const auto files = TRY(DrawFiles(arguments, sheet));
  TRY(WriteOutputs(files, arguments.force));
  for (const OutputFile& file : files) fmt::print("wrote      {}\n", file.path.string());
  PrintSheetSummary(sheet);
  return kExitGood;
}

}  // namespace

void AddAlignTargetsCommand(CLI::App& parent, int& exit_code) {
  auto arguments = std::make_shared<AlignTargetsArguments>();
  SheetRequest& request = arguments->request;
  CLI::App* command = parent.add_subcommand("targets", "pages of targets to print");
  command->add_option("--bits", request.bits, "of the code: 12 (16 targets), 14 (44) or 20 (1022)")
      ->capture_default_str();
  command->add_option("--radius", request.radius_mm, "of the disc, mm")->capture_default_str();
  command->add_option("--count", request.count, "coded targets")->capture_default_str();
  command->add_option("--first", request.first, "number of the first one")->capture_default_str();
  command->add_option("--plain", request.plain, "plain discs")->capture_default_str();
  command->add_flag("--bright", request.bright, "white on black, for retroreflective sheet");
  command->add_option("--page", arguments->page, "a4, a3, letter or WIDTHxHEIGHT in mm")
      ->capture_default_str();
  command->add_option("-o,--out", arguments->out, ".pdf, or .svg (one file a page)")
      ->capture_default_str();
  command->add_option("--layout", arguments->layout, "JSON file: which target stands where");
  command->add_flag("--force", arguments->force, "overwrite files");
  OnRun(*command, exit_code, [arguments] { return RunAlignTargets(*arguments); });
}

}  // namespace trammel::app
