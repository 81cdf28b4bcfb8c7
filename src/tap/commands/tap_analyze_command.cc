// trammel tap analyze: recorded taps in, the height at which the nozzle lets go of the bed out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "app/commands.h"
#include "tap/commands/tap_commands.h"
#include "tap/commands/tap_run.h"
#include "tap/report/tap_json.h"
#include "tap/report/tap_text.h"

namespace trammel::app {
namespace {

struct AnalyzeTapArguments {
  TapArguments tap;
  bool json = false;
  bool summary = false;
};

std::string JsonOf(const TapRun& run, const AnalyzeTapArguments& arguments) {
  if (arguments.summary) return report::ToJson(run.taps, tap::Summarise(ResultsOf(run.taps)));
  const bool one = run.taps.size() == 1 && arguments.tap.files.size() == 1;
  return one ? report::ToJson(run.taps.front()) : report::ToJson(run.taps);
}

std::string TextOf(const TapRun& run) {
  if (run.taps.size() == 1) return report::TapText(run.taps.front());
  std::string text;
  for (const report::AnalysedTap& tap : run.taps) text += report::TapLine(tap);
  return text + "\n" + report::EnsembleText(tap::Summarise(ResultsOf(run.taps)), run.taps);
}

int RunAnalyze(const AnalyzeTapArguments& arguments) {
  const auto options = TapOptionsOf(arguments.tap);
  if (!options) return Report(options.error());
  const TapRun run = AnalyseFiles(arguments.tap, *options);
  // A file alone that cannot be read is an error and no measurement.
  if (run.taps.size() > run.failed.size()) {
    std::fputs((arguments.json ? JsonOf(run, arguments) : TextOf(run)).c_str(), stdout);
  }
  int exit_code = ExitCodeOf(run.taps);
  for (const Error& error : run.failed) exit_code = Report(error);
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
  command->callback([arguments, &exit_code] { exit_code = RunAnalyze(*arguments); });
}

}  // namespace trammel::app
