// trammel tap tune: how to tap better.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <vector>

#include "app/commands.h"
#include "app/slow_work.h"
#include "tap/commands/tap_commands.h"
#include "tap/commands/tap_run.h"
#include "tap/report/tuning_json.h"
#include "tap/report/tuning_text.h"

namespace trammel::app {
namespace {

struct TuneArguments {
  TapArguments tap;
  double wanted_um = 1;
  bool json = false;
};

int RunTune(const TuneArguments& arguments) {
  const auto options = TapOptionsOf(arguments.tap);
  if (!options) return PrintError(options.error());
  if (!(arguments.wanted_um > 0 && arguments.wanted_um <= 1000)) {
    return PrintError(
        Fail(fmt::format("--uncertainty-um {}: must be above 0, at most 1000", arguments.wanted_um))
            .value());
  }
  const SlowWork work("trying other taps");
  const TapRun run = AnalyseFiles(arguments.tap, *options);
  for (const Error& error : run.failed) return PrintError(error);
  std::vector<tap::TapView> views;
  for (const report::AnalysedTap& tap : run.taps) views.push_back(tap.recording.View());
  constexpr double kMmPerUm = 1e-3;
  const tap::Tuning tuning =
      tap::Tune(TuningTapsOf(run.taps),
                {.wanted_uncertainty_mm = arguments.wanted_um * kMmPerUm, .analysis = *options});
  const tap::NoiseSpectrum noise = tap::FindNoise(views);
  const std::string text = arguments.json ? report::ToJson(tuning, noise)
                                          : report::TuningText(tuning) + report::NoiseText(noise);
  std::fputs(text.c_str(), stdout);
  return tuning.end == tap::TuningEnd::kNone ? kExitNotTrusted : kExitGood;
}

}  // namespace

void AddTapTuneCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "tune", "advice on pull-back, force and drift filter, tried before it is given; what hums");
  const auto arguments = std::make_shared<TuneArguments>();
  AddTapFiles(*command, arguments->tap);
  AddTapMeasuring(*command, arguments->tap);
  command
      ->add_option("--uncertainty-um", arguments->wanted_um,
                   "standard uncertainty that a tap shall have")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "print JSON (docs/formats.md)");
  command->callback([arguments, &exit_code] { exit_code = RunTune(*arguments); });
}

}  // namespace trammel::app
