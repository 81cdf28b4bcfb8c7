// trammel align fit: measured points and the ideal part's surfaces in, the targets' coordinates
// out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
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
  bool json = false;
  bool force = false;
};

int RunFit(const FitArguments& arguments) {
  if (auto free = CheckFree(arguments.out, arguments.report, arguments.force); !free) {
    return PrintError(free.error());
  }
  auto points = files::ReadPointTable(arguments.points);
  if (!points) return PrintError(points.error());
  auto part = files::ReadPartFile(arguments.part);
  if (!part) return PrintError(part.error());
  const part_alignment::PartFitInput input{std::move(*points), std::move(part->surfaces),
                                           std::move(part->bars), part->start};
  const SlowWork work("fitting the part");
  const auto fit = part_alignment::FitPart(input, part->options);
  if (!fit) {
    return PrintError({fit.error().kind, fmt::format("{} with {}: {}", arguments.points,
                                                     arguments.part, fit.error().message)});
  }
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
  command->add_option("--part", arguments->part, "PART.json: the ideal part's surfaces, scale bars")
      ->required();
  command->add_option("--out", arguments->out, "file for the targets, if the verdict is good");
  command->add_option("--report", arguments->report,
                      "folder for report.html and the map of stock allowances");
  command->add_flag("--json", arguments->json, "one JSON object instead of text");
  command->add_flag("--force", arguments->force, "overwrite files");
  command->callback([arguments, &exit_code] { exit_code = RunFit(*arguments); });
}

}  // namespace trammel::app
