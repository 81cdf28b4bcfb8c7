// trammel align fit: measured points and the ideal part's surfaces in, the targets' coordinates
// out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "part_alignment/commands/align_cad.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/files/mesh_file.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/part_fit/part_fit.h"
#include "part_alignment/report/part_metrology_figures.h"
#include "part_alignment/report/part_metrology_page.h"
#include "part_alignment/report/part_metrology_text.h"

namespace trammel::app {
namespace {

struct FitArguments {
  std::string points;
  std::string part;
  std::string out;
  std::string report;
  std::string unit;
  std::optional<double> stock_allowance_mm;
  double least_stock_allowance_mm = 0;
  double target_thickness_mm = 0;
  double target_thickness_sigma_mm = 0;
  bool json = false;
  bool force = false;
};

/// A mesh alone is all of the ideal part: whatever points call their surface lies on it.
Result<files::PartFile> PartOfCad(const FitArguments& arguments,
                                  std::vector<part_alignment::MeasuredPoint>& points) {
  if (!arguments.stock_allowance_mm) {
    return Fail(fmt::format(
        "{} says nothing of stock: --overstock MM is what each point is to have", arguments.part));
  }
  auto mesh = TRY(ReadCadFile(
      arguments.part, arguments.unit.empty() ? std::nullopt : files::LengthUnitOf(arguments.unit),
      false));
  files::PartFile part;
  part.notices = std::move(mesh.notices);
  part.options.least_stock_allowance_mm = arguments.least_stock_allowance_mm;
  part_alignment::IdealSurface surface;
  surface.id = std::filesystem::path(arguments.part).filename().string();
  surface.kind = part_alignment::SurfaceKind::kMesh;
  surface.stock_allowance_mm = *arguments.stock_allowance_mm;
  surface.mesh = std::move(mesh.mesh);
  for (part_alignment::MeasuredPoint& point : points) {
    if (!point.surface.empty()) point.surface = surface.id;
  }
  part.surfaces.push_back(std::move(surface));
  return part;
}

Result<files::PartFile> ReadPart(const FitArguments& arguments,
                                 std::vector<part_alignment::MeasuredPoint>& points) {
  if (NamesCad(arguments.part)) return PartOfCad(arguments, points);
  if (!arguments.unit.empty() || arguments.stock_allowance_mm) {
    return Fail(
        fmt::format("{}: --unit, --overstock and --least-overstock go with an STL or "
                    "a STEP file; this file says so itself",
                    arguments.part));
  }
  return files::ReadPartFile(arguments.part, ReadCadFile);
}

int RunFit(const FitArguments& arguments) {
  if (auto free = CheckFree(arguments.out, arguments.report, arguments.force); !free) {
    return PrintError(free.error());
  }
  auto points = files::ReadPointTable(arguments.points);
  if (!points) return PrintError(points.error());
  const SlowWork work("fitting the part");
  auto part = ReadPart(arguments, *points);
  if (!part) return PrintError(part.error());
  const part_alignment::PartFitInput input{std::move(*points), std::move(part->surfaces),
                                           std::move(part->bars), part->start};
  part->options.target_thickness_mm = arguments.target_thickness_mm;
  part->options.target_thickness_sigma_mm = arguments.target_thickness_sigma_mm;
  auto fit = part_alignment::FitPart(input, part->options);
  if (!fit) {
    return PrintError({fit.error().kind, fmt::format("{} with {}: {}", arguments.points,
                                                     arguments.part, fit.error().message)});
  }
  fit->notices.insert(fit->notices.begin(), part->notices.begin(), part->notices.end());
  const std::string json = report::ToJson(input, *fit);
  PrintAnswer(arguments.json, json, report::PartFitText(input, *fit));
  if (!arguments.report.empty()) {
    std::vector<report::Figure> figures;
    if (!fit->stock_allowances.empty())
      figures.push_back(report::StockAllowanceFigure(input, *fit));
    const auto written = WriteMetrologyReport(
        arguments.report, report::PartFitPage(input, *fit, figures), figures, arguments.force);
    if (!written) return PrintError(written.error());
  }
  if (fit->verdict != Verdict::kGood) return kExitNotTrusted;
  if (!arguments.out.empty()) {
    const auto written =
        files::WriteWholeFile(arguments.out, json, files::ReplaceIf(arguments.force));
    if (!written) return PrintError(written.error());
  }
  return kExitGood;
}

}  // namespace

void AddAlignFitCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "fit", "the ideal part in a raw one: stock allowance everywhere, as even as can be");
  const auto arguments = std::make_shared<FitArguments>();
  command->add_option("points", arguments->points, "measured points, CSV or JSON")->required();
  command
      ->add_option("--part", arguments->part,
                   "PART.json: the ideal part's surfaces, scale bars; or its STEP or STL")
      ->required();
  command
      ->add_option("--unit", arguments->unit,
                   "of an STL, which states none (default: mm); a STEP file has its own")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(files::kLengthUnitNames),
                                                     std::end(files::kLengthUnitNames))));
  command->add_option("--overstock", arguments->stock_allowance_mm,
                      "stock allowance that is wanted on a STEP or an STL, mm");
  command->add_option("--least-overstock", arguments->least_stock_allowance_mm,
                      "the same that every point must have, mm (default: 0)");
  command->add_option("--target-thickness", arguments->target_thickness_mm,
                      "of adhesive targets on the surfaces, mm: subtracted along the normal");
  command->add_option("--target-thickness-sigma", arguments->target_thickness_sigma_mm,
                      "standard uncertainty of it, mm, the same for all targets");
  command->add_option("-o,--out", arguments->out, "file for the targets, if the verdict is good");
  command->add_option("--report", arguments->report,
                      "folder for report.html and the map of stock allowances");
  command->add_flag("--json", arguments->json, "one JSON object instead of text");
  command->add_flag("--force", arguments->force, "overwrite files");
  command->callback([arguments, &exit_code] { exit_code = RunFit(*arguments); });
}

}  // namespace trammel::app
