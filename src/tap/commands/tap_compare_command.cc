// trammel tap compare: the published decomposition and the contact, by how well they repeat.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "app/slow_work.h"
#include "base/json_text.h"
#include "tap/commands/tap_commands.h"
#include "tap/commands/tap_run.h"
#include "tap/ensemble/method_comparison.h"
#include "tap/report/comparison_json.h"
#include "tap/report/comparison_report.h"
#include "tap/report/comparison_text.h"

namespace trammel::app {
namespace {

struct CompareArguments {
  TapArguments tap;
  bool json = false;
  ReportFiles files;
};

/// Both methods on every tap. The files have been read.
std::vector<tap::TwiceRead> ReadTwice(const TapRun& run, tap::TapOptions options) {
  options.method = tap::Method::kTwoLine;
  tap::TapAnalyser analyser(options);
  std::vector<report::AnalysedTap> by_lines = run.taps;
  for (report::AnalysedTap& tap : by_lines) {
    tap.analysis = AnalyseRecorded(tap.recording, options, analyser);
  }
  const std::vector<tap::TapResult> contact = ResultsOf(run.taps);
  const std::vector<tap::TapResult> two_line = ResultsOf(by_lines);
  std::vector<tap::TwiceRead> twice;
  for (std::size_t i = 0; i < contact.size(); ++i) twice.push_back({two_line[i], contact[i]});
  return twice;
}

int RunCompare(const CompareArguments& arguments) {
  if (auto may = CheckOutputs(arguments.files); !may) return PrintError(may.error());
  const auto options = TapOptionsOf(arguments.tap);
  if (!options) return PrintError(options.error());
  const SlowWork work("analysing the taps by both methods");
  const TapRun run = AnalyseFiles(arguments.tap, *options);
  if (!run.failed.empty()) {
    int exit_code = kExitGood;
    for (const Error& error : run.failed) exit_code = PrintError(error);
    return exit_code;
  }
  const tap::MethodComparison comparison = tap::CompareMethods(ReadTwice(run, *options));
  if (!arguments.files.report.empty()) {
    const std::string page = report::ComparisonReport(comparison, arguments.tap.files);
    if (auto written = WriteOutputs({{arguments.files.report, page}}, arguments.files.force);
        !written) {
      return PrintError(written.error());
    }
  }
  const std::string text =
      arguments.json ? JsonText(report::JsonOf(comparison)) : report::ComparisonText(comparison);
  std::fputs(text.c_str(), stdout);
  return comparison.ratio.good() ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddTapCompareCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "compare", "how well the contact and the published decomposition repeat on the same taps");
  command->footer(
      "Give ten and more taps of one place, or a mesh that was run twice:\n"
      "  trammel tap compare recordings/tap-*.jsonl --report compare.html");
  const auto arguments = std::make_shared<CompareArguments>();
  AddTapFiles(*command, arguments->tap);
  AddTapMeasuring(*command, arguments->tap);
  command->add_flag("--json", arguments->json, "print JSON (docs/formats.md)");
  command->add_option("--report", arguments->files.report,
                      "write a page (HTML) with a figure here");
  command->add_flag("--force", arguments->files.force, "overwrite that file");
  command->callback([arguments, &exit_code] { exit_code = RunCompare(*arguments); });
}

}  // namespace trammel::app
