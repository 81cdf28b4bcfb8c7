// trammel offset analyze: computes every tool's offset from scans of the printed sheet.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "base/json_text.h"
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/commands/offset_reading.h"
#include "tool_offset/report/offset_report.h"

namespace trammel::app {
namespace {

struct AnalyzeArguments {
  std::vector<std::string> scans;
  std::string pattern;
  ReadingOptions reading;
  bool json = false;
  OffsetOutput output;
};

int Run(const AnalyzeArguments& arguments) {
  if (auto may = CheckOutputs({.report = arguments.output.report,
                               .figures = arguments.output.figures,
                               .result = arguments.output.result,
                               .force = arguments.output.force});
      !may) {
    return PrintError(may.error());
  }
  const auto plan = ReadPlan(arguments.pattern);
  if (!plan) return PrintError(plan.error());
  ReadSheets read =
      ReadScans(arguments.scans, *plan, arguments.reading, arguments.output.has_pictures());
  std::optional<int> failed;
  for (const Error& error : read.errors) failed = PrintError(error);
  const report::OffsetAnalysis& analysis = read.analysis;
  if (analysis.scans.empty()) {
    // Only a sheet that was found is a measurement to refuse.
    const bool seen = std::all_of(read.errors.begin(), read.errors.end(), [](const Error& error) {
      return error.kind == ErrorKind::kMeasurement;
    });
    if (arguments.json && failed && seen) {
      std::fputs(JsonText(report::RefusalJson(analysis)).c_str(), stdout);
    }
    return failed ? *failed : PrintError({ErrorKind::kInput, "SCAN: there is none between the +"});
  }
  // The result is printed even if the files cannot be written.
  const auto written =
      WriteOffsetOutput(arguments.output, {&analysis, std::move(read.pictures), {}});
  const std::string report = written ? arguments.output.report : "";
  if (arguments.json) {
    std::fputs(JsonText(report::JsonOf(analysis, report)).c_str(), stdout);
  } else {
    std::fputs(report::OffsetText(analysis, report).c_str(), stdout);
    const std::string& result = arguments.output.result;
    PrintWrapped("next",
                 result.empty() ? "with --result FILE: trammel offset apply FILE"
                                : fmt::format("trammel offset apply {}", ShellQuoted(result)),
                 13);
  }
  if (!written) return PrintError(written.error());
  if (failed) return *failed;
  return report::VerdictOf(analysis) == Verdict::kGood ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddOffsetAnalyzeCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command =
      parent.add_subcommand("analyze", "offsets of the tools, and backlash, from scanned sheets");
  const auto arguments = std::make_shared<AnalyzeArguments>();
  command
      ->add_option("SCAN", arguments->scans,
                   "TIFF, PNG, JPEG or PDF: scans or photos of one sheet, however it lay; "
                   "behind a + those of the next sheet, printed anew")
      ->required();
  command
      ->add_option("--pattern", arguments->pattern,
                   "the G-code that was printed, ours or the method's original generator's")
      ->required();
  AddReadingOptions(*command, arguments->reading);
  command
      ->add_option_function<double>(
          "--line-heights-um",
          [arguments](const double& um) { arguments->reading.spread.height_mm = um / 1000; },
          "of a photo: how unlike the tools' lines are in height above the paper, 1 sigma (30)")
      ->check(NumberIn(0.0, 1000.0));
  command
      ->add_option("--line-colour-px", arguments->reading.spread.colour_px,
                   "of a photo: how much further out another tool's colour is seen in the corner, "
                   "1 sigma")
      ->check(NumberIn(0.0, 10.0))
      ->capture_default_str();
  command->add_option("--most-megapixels", arguments->reading.max_megapixels, "of a page")
      ->check(NumberIn(1.0, 100000.0))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "one JSON object");
  command->add_option("--report", arguments->output.report,
                      "write a one-page report with every step drawn on the scan (HTML)");
  command->add_option("--figures", arguments->output.figures,
                      "write each figure as SVG into this folder");
  command->add_flag("--force", arguments->output.force, "overwrite the report and the figures");
  command->add_option("--result", arguments->output.result,
                      "keep the answer as JSON here, for offset apply");
  command->callback([arguments, &exit_code] { exit_code = Run(*arguments); });
}

}  // namespace trammel::app
