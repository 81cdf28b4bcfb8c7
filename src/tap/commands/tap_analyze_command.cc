// trammel tap analyze: computes the height at which the nozzle separates from the bed from recorded
// taps.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "app/slow_work.h"
#include "base/json_text.h"
#include "tap/commands/tap_commands.h"
#include "tap/commands/tap_run.h"
#include "tap/ensemble/comparison.h"
#include "tap/report/advice_report.h"
#include "tap/report/comparison_report.h"
#include "tap/report/tap_json.h"
#include "tap/report/tap_text.h"
#include "tap/samples/finding.h"

namespace trammel::app {
namespace {

struct AnalyzeTapArguments {
  TapArguments tap;
  bool json = false;
  bool summary = false;
  bool advice = false;
  double wanted_um = 1;
  std::string compare;  ///< "methods", "files", or empty.
  ReportFiles files;
};

/// Optional output besides the taps.
struct Besides {
  std::optional<TapAdviceRun> advice;
  std::vector<tap::SeriesScatter> comparison;
};

nlohmann::ordered_json JsonOf(const TapRun& run, const Besides& besides,
                              const AnalyzeTapArguments& arguments) {
  if (arguments.summary || besides.advice || !besides.comparison.empty()) {
    auto json = report::JsonOf(run.taps, tap::Summarise(ResultsOf(run.taps)));
    if (besides.advice) {
      json["advice"] = report::JsonOf(besides.advice->advice, besides.advice->noise);
    }
    if (!besides.comparison.empty()) json["comparison"] = report::JsonOf(besides.comparison);
    return json;
  }
  const bool one = run.taps.size() == 1 && arguments.tap.files.size() == 1;
  return one ? report::JsonOf(run.taps.front()) : report::JsonOf(run.taps);
}

std::string TextOf(const TapRun& run, const Besides& besides) {
  std::string text;
  if (run.taps.size() == 1) {
    text = report::TapText(run.taps.front());
  } else {
    for (const report::AnalysedTap& tap : run.taps) text += report::TapLine(tap);
    text += "\n" + report::EnsembleText(tap::Summarise(ResultsOf(run.taps)), run.taps);
  }
  if (besides.advice) {
    text += "\n" + report::AdviceText(besides.advice->advice, besides.advice->noise);
  }
  if (!besides.comparison.empty()) text += "\n" + report::ComparisonText(besides.comparison);
  return text;
}

/// Returns both methods on every tap, or the taps of each file.
std::vector<tap::TapSeries> SeriesOf(const TapRun& run, const AnalyzeTapArguments& arguments,
                                     tap::TapOptions options) {
  std::vector<tap::TapSeries> series;
  if (arguments.compare == "methods") {
    for (const tap::Method method : {tap::Method::kTwoLine, tap::Method::kContact}) {
      options.method = method;
      tap::TapAnalyser analyser(options);
      std::vector<report::AnalysedTap> taps = run.taps;
      for (report::AnalysedTap& tap : taps) {
        if (tap.unread.empty()) tap.analysis = AnalyseRecorded(tap.recording, options, analyser);
      }
      series.push_back({std::string(tap::ToString(method)), ResultsOf(taps)});
    }
    return series;
  }
  std::span<const report::AnalysedTap> rest(run.taps);
  for (std::size_t i = 0; i < arguments.tap.files.size(); ++i) {
    series.push_back({arguments.tap.files[i], ResultsOf(rest.first(run.taps_of_file[i]))});
    rest = rest.subspan(run.taps_of_file[i]);
  }
  return series;
}

/// Checks the options' combination; the error names the option.
Result<void> CheckArguments(const AnalyzeTapArguments& arguments, tap::Method method) {
  if (!(arguments.wanted_um > 0 && arguments.wanted_um <= 1000)) {
    return Fail(
        fmt::format("--uncertainty-um {}: must be above 0, at most 1000", arguments.wanted_um));
  }
  if (arguments.advice && method != tap::Method::kContact) {
    return Fail("--advice needs --method contact: the published method fits no press");
  }
  if (!arguments.compare.empty() && arguments.compare != "methods" &&
      arguments.compare != "files") {
    return Fail(fmt::format("--compare {}: must be methods or files", arguments.compare));
  }
  return {};
}

Measured ContactOf(const report::AnalysedTap& tap) {
  return tap.unread.empty() ? tap::ContactOf(tap.analysis) : Measured::Refused(tap.unread);
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

Result<void> WriteResult(const TapRun& run, const nlohmann::ordered_json& json,
                         const AnalyzeTapArguments& arguments) {
  if (arguments.files.result.empty()) return {};
  const ResultFile result{OutcomeOf(run.taps), json};
  TRY(WriteOutputs({OutputOf(arguments.files.result, result)}, arguments.files.force));
  fmt::print(stderr, "written to {}\n", arguments.files.result);
  return {};
}

int RunAnalyze(const AnalyzeTapArguments& arguments) {
  if (auto may = CheckOutputs(arguments.files); !may) return PrintError(may.error());
  const auto options = TapOptionsOf(arguments.tap);
  if (!options) return PrintError(options.error());
  if (auto may = CheckArguments(arguments, options->method); !may) return PrintError(may.error());
  const SlowWork work("analysing the taps");
  const TapRun run = AnalyseFiles(arguments.tap, *options);
  // If no file could be read, the result is an error and no measurement.
  int exit_code = ExitCodeOf(run.taps);
  if (run.taps.size() > run.failed.size()) {
    Besides besides;
    constexpr double kMmPerUm = 1e-3;
    if (arguments.advice) besides.advice = AdviseOn(run.taps, kMmPerUm * arguments.wanted_um);
    if (!arguments.compare.empty()) {
      besides.comparison =
          tap::Compare(SeriesOf(run, arguments, *options), arguments.compare == "methods");
    }
    const nlohmann::ordered_json json = JsonOf(run, besides, arguments);
    std::fputs((arguments.json ? JsonText(json) : TextOf(run, besides)).c_str(), stdout);
    if (auto done = WriteResult(run, json, arguments); !done) return PrintError(done.error());
    const bool told = (!besides.advice || besides.advice->advice.none.empty()) &&
                      std::all_of(besides.comparison.begin(), besides.comparison.end(),
                                  [](const auto& one) { return one.deviation_mm.good(); });
    if (!told) exit_code = kExitNotTrusted;
  }
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
  command->add_flag("--advice", arguments->advice,
                    "noise, hum and better settings, from ten or twenty taps of one setting");
  command
      ->add_option("--uncertainty-um", arguments->wanted_um,
                   "standard uncertainty that a tap shall have, for the advice")
      ->capture_default_str();
  command->add_option("--compare", arguments->compare,
                      "how well they repeat side by side: methods (both on each tap) or files");
  command->add_option("--result", arguments->files.result, "keep the answer as JSON here");
  command->add_flag("--force", arguments->files.force, "overwrite that file");
  command->callback([arguments, &exit_code] { exit_code = RunAnalyze(*arguments); });
}

}  // namespace trammel::app
