// Shared part of the tap commands: selects, reads and analyses files.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "tap/analyse/analyse.h"
#include "tap/ensemble/advice.h"
#include "tap/ensemble/ensemble.h"
#include "tap/report/tap_json.h"
#include "tap/samples/noise_spectrum.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct TapArguments {
  std::vector<std::string> files;
  std::string method = "contact";
  std::optional<double> latency_ms;  ///< Not given: estimated from the approach.
  double latency_uncertainty_ms = 0;
  std::optional<double> nozzle_temperature_c;
};

/// --method, and those of AddTapMeasuring.
void AddTapOptions(CLI::App& command, TapArguments& arguments);
/// --latency-ms, --latency-uncertainty-ms and --nozzle-temperature.
void AddTapMeasuring(CLI::App& command, TapArguments& arguments);
/// Adds FILE…, at least one.
void AddTapFiles(CLI::App& command, TapArguments& arguments);

/// Reads the options. Errors name the option, its value and the bound.
[[nodiscard]] Result<tap::TapOptions> TapOptionsOf(const TapArguments& arguments);

/// Analyses a tap with its recorded temperature, if there is one.
[[nodiscard]] tap::TapAnalysis AnalyseRecorded(const tap::Recording& recording,
                                               const tap::TapOptions& options,
                                               tap::TapAnalyser& analyser);

/// All taps of the files, in their order.
struct TapRun {
  std::vector<report::AnalysedTap> taps;  ///< one entry even for each unreadable file
  std::vector<Error> failed;              ///< unreadable files
  std::vector<std::size_t> taps_of_file;  ///< number of `taps` per file
};
[[nodiscard]] TapRun AnalyseFiles(const TapArguments& arguments, const tap::TapOptions& options);

[[nodiscard]] std::vector<tap::TapResult> ResultsOf(std::span<const report::AnalysedTap> taps);

struct TapAdviceRun {
  tap::TapAdvice advice;
  tap::NoiseSpectrum noise;
};
[[nodiscard]] TapAdviceRun AdviseOn(std::span<const report::AnalysedTap> taps, double wanted_mm);

/// Returns the exit code of the results: good if every tap is.
[[nodiscard]] int ExitCodeOf(std::span<const report::AnalysedTap> taps);

}  // namespace trammel::app
