#include "tap/commands/tap_run.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "app/commands.h"
#include "tap/files/tap_file.h"
#include "tap/samples/finding.h"

namespace trammel::app {
namespace {

constexpr double kMsPerS = 1000;

Result<void> CheckRange(const char* option, double value, double lo, double hi, const char* unit) {
  if (value >= lo && value <= hi) return {};
  return Fail(fmt::format("{} {}: must be {} … {} {}", option, value, lo, hi, unit));
}

}  // namespace

void AddTapOptions(CLI::App& command, TapArguments& arguments) {
  command.add_option("--method", arguments.method, "contact, or two-line (as published)")
      ->capture_default_str();
  AddTapMeasuring(command, arguments);
}

void AddTapMeasuring(CLI::App& command, TapArguments& arguments) {
  command.add_option(
      "--latency-ms", arguments.latency_ms,
      "by which samples are dated after their force acted, in ms; else from the approach");
  command
      .add_option("--latency-uncertainty-ms", arguments.latency_uncertainty_ms,
                  "standard uncertainty of the stated latency, in ms")
      ->capture_default_str();
  command.add_option("--nozzle-temperature", arguments.nozzle_temperature_c,
                     "of the nozzle when it tapped, in degrees C: hot plastic oozes");
}

void AddTapFiles(CLI::App& command, TapArguments& arguments) {
  command
      .add_option("files", arguments.files,
                  "taps: what load_cell_probe/dump_taps sends, as JSON, JSON lines or CSV "
                  "(docs/reference/formats.md)")
      ->required();
}

Result<tap::TapOptions> TapOptionsOf(const TapArguments& arguments) {
  tap::TapOptions options;
  if (arguments.method == tap::ToString(tap::Method::kTwoLine)) {
    options.method = tap::Method::kTwoLine;
  } else if (arguments.method != tap::ToString(tap::Method::kContact)) {
    return Fail(fmt::format("--method {}: must be contact or two-line", arguments.method));
  }
  // The slowest converters have 10 samples per second.
  constexpr double kMaxLatency_ms = 200;
  for (const auto& [option, value, least] :
       {std::tuple{"--latency-ms", arguments.latency_ms.value_or(0), -kMaxLatency_ms},
        std::tuple{"--latency-uncertainty-ms", arguments.latency_uncertainty_ms, 0.0}}) {
    TRY(CheckRange(option, value, least, kMaxLatency_ms, "ms"));
  }
  if (arguments.latency_ms) {
    options.latency_s = *arguments.latency_ms / kMsPerS;
  }
  options.latency_uncertainty_s = arguments.latency_uncertainty_ms / kMsPerS;
  if (arguments.nozzle_temperature_c) {
    TRY(CheckRange("--nozzle-temperature", *arguments.nozzle_temperature_c, -50, 600, "degrees C"));
    options.nozzle_temperature_c = *arguments.nozzle_temperature_c;
  }
  return options;
}

tap::TapAnalysis AnalyseRecorded(const tap::Recording& recording, const tap::TapOptions& options,
                                 tap::TapAnalyser& analyser) {
  if (!std::isfinite(recording.nozzle_temperature_c)) return analyser.Analyse(recording.View());
  tap::TapOptions own = options;
  own.nozzle_temperature_c = recording.nozzle_temperature_c;
  return tap::TapAnalyser(own).Analyse(recording.View());
}

TapRun AnalyseFiles(const TapArguments& arguments, const tap::TapOptions& options) {
  TapRun run;
  tap::TapAnalyser analyser(options);
  for (const std::string& file : arguments.files) {
    auto taps = files::ReadTaps(file);
    if (!taps) {
      report::AnalysedTap& unread = run.taps.emplace_back();
      unread.recording.name = file;
      unread.unread = taps.error().message;
      unread.analysis.method = options.method;
      unread.analysis.quality = unread.analysis.noise_g = tap::Recording::kUnknown;
      run.failed.push_back(taps.error());
      run.taps_of_file.push_back(1);
      continue;
    }
    run.taps_of_file.push_back(taps->size());
    for (tap::Recording& recording : *taps) {
      const tap::TapAnalysis analysis = AnalyseRecorded(recording, options, analyser);
      run.taps.push_back({std::move(recording), analysis, {}});
    }
  }
  return run;
}

std::vector<tap::TapResult> ResultsOf(std::span<const report::AnalysedTap> taps) {
  std::vector<tap::TapResult> results;
  for (const auto& [recording, analysis, unread] : taps) {
    results.push_back({tap::ContactOf(analysis), analysis.contact_time_s,
                       recording.nozzle_temperature_c, recording.x_mm, recording.y_mm});
  }
  return results;
}

TapAdviceRun AdviseOn(std::span<const report::AnalysedTap> taps, double wanted_mm) {
  std::vector<tap::AdvisedTap> advised;
  std::vector<tap::TapView> views;
  for (const report::AnalysedTap& tap : taps) {
    views.push_back(tap.recording.View());
    advised.push_back({views.back(), &tap.analysis});
  }
  return {tap::Advise(advised, tap::Summarise(ResultsOf(taps)), wanted_mm), tap::FindNoise(views)};
}

int ExitCodeOf(std::span<const report::AnalysedTap> taps) {
  const bool good = std::all_of(taps.begin(), taps.end(), [](const report::AnalysedTap& tap) {
    return tap.analysis.verdict == Verdict::kGood;
  });
  return good ? kExitGood : kExitNotTrusted;
}

}  // namespace trammel::app
