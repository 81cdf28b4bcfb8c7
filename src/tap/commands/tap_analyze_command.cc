// trammel tap analyze: recorded taps in, the height at which the nozzle lets go of the bed out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "app/result_file.h"
#include "app/slow_work.h"
#include "base/json_text.h"
#include "tap/commands/tap_commands.h"
#include "tap/commands/tap_run.h"
#include "tap/report/tap_json.h"
#include "tap/report/tap_text.h"
#include "tap/samples/finding.h"

namespace trammel::app {
namespace {

struct AnalyzeTapArguments {
  TapArguments tap;
  bool json = false;
  bool summary = false;
  ReportFiles files;
};

nlohmann::ordered_json JsonOf(const TapRun& run, const AnalyzeTapArguments& arguments) {
  if (arguments.summary) return report::JsonOf(run.taps, tap::Summarise(ResultsOf(run.taps)));
  const bool one = run.taps.size() == 1 && arguments.tap.files.size() == 1;
  return one ? report::JsonOf(run.taps.front()) : report::JsonOf(run.taps);
}

std::string TextOf(const TapRun& run) {
  if (run.taps.size() == 1) return report::TapText(run.taps.front());
  std::string text;
  for (const report::AnalysedTap& tap : run.taps) text += report::TapLine(tap);
  return text + "\n" + report::EnsembleText(tap::Summarise(ResultsOf(run.taps)), run.taps);
}

Measured ContactOf(const report::AnalysedTap& tap) {
  const tap::TapAnalysis& analysis = tap.analysis;
  if (!tap.unread.empty()) return Measured::Refused(tap.unread);
  if (analysis.verdict == Verdict::kCannotTell) {
    return Measured::CannotTell(tap::Explain(analysis.reason));
  }
  if (analysis.verdict == Verdict::kRefused)
    return Measured::Refused(tap::Explain(analysis.reason));
  return Measured::Good(
      {analysis.contact_z_mm, analysis.standard_uncertainty_mm, analysis.interval95_mm});
}

measurement::Outcome OutcomeOf(const std::vector<report::AnalysedTap>& taps) {
  measurement::Outcome outcome;
  std::vector<std::string> sources;
  for (const report::AnalysedTap& tap : taps) {
    sources.push_back(tap.recording.name);
    const std::string name =
        taps.size() == 1 ? "contact_height" : fmt::format("tap_{}_contact_height", sources.size());
    outcome.answers.push_back({name, "mm", ContactOf(tap)});
    for (const tap::Finding& notice : tap.analysis.Notices()) {
      outcome.notices.push_back(fmt::format("{}: {}", sources.back(), tap::Explain(notice)));
    }
  }
  outcome.provenance = ProvenanceOf(measurement::Instrument::kTap, std::move(sources));
  return outcome;
}

Result<void> WriteResult(const TapRun& run, const AnalyzeTapArguments& arguments) {
  if (arguments.files.result.empty()) return {};
  const ResultFile result{OutcomeOf(run.taps), JsonOf(run, arguments)};
  return WriteOutputs({OutputOf(arguments.files.result, result)}, arguments.files.force);
}

int RunAnalyze(const AnalyzeTapArguments& arguments) {
  if (auto may = CheckOutputs(arguments.files); !may) return PrintError(may.error());
  const auto options = TapOptionsOf(arguments.tap);
  if (!options) return PrintError(options.error());
  const SlowWork work("analysing the taps");
  const TapRun run = AnalyseFiles(arguments.tap, *options);
  // A file alone that cannot be read is an error and no measurement.
  if (run.taps.size() > run.failed.size()) {
    std::fputs((arguments.json ? JsonText(JsonOf(run, arguments)) : TextOf(run)).c_str(), stdout);
    if (auto done = WriteResult(run, arguments); !done) return PrintError(done.error());
  }
  int exit_code = ExitCodeOf(run.taps);
  for (const Error& error : run.failed) exit_code = PrintError(error);
  return exit_code;
}

}  // namespace

void AddTapAnalyzeCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command =
      parent.add_subcommand("analyze", "the nozzle's contact height from recorded taps");
  const auto arguments = std::make_shared<AnalyzeTapArguments>();
  AddTapFiles(*command, arguments->tap);
  AddTapOptions(*command, arguments->tap);
  CLI::Option* json = command->add_flag("--json", arguments->json,
                                        "one JSON object, or a list for several taps or files");
  command
      ->add_flag("--summary", arguments->summary,
                 "JSON: one object with the taps and what they say together")
      ->needs(json);
  command->add_option("--result", arguments->files.result, "keep the answer as JSON here");
  command->add_flag("--force", arguments->files.force, "overwrite that file");
  command->callback([arguments, &exit_code] { exit_code = RunAnalyze(*arguments); });
}

}  // namespace trammel::app
