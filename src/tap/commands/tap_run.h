// What the tap commands share: which files and how, read and analysed.
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
/// FILE…, at least one.
void AddTapFiles(CLI::App& command, TapArguments& arguments);

/// Errors name the option, its value and the bound.
[[nodiscard]] Result<tap::TapOptions> TapOptionsOf(const TapArguments& arguments);

/// A tap analysed with the temperature that was recorded with it, where one was.
[[nodiscard]] tap::TapAnalysis AnalyseRecorded(const tap::Recording& recording,
                                               const tap::TapOptions& options,
                                               tap::TapAnalyser& analyser);

/// Every tap of the files, in their order.
struct TapRun {
  std::vector<report::AnalysedTap> taps;  ///< With one for each file that could not be read.
  std::vector<Error> failed;              ///< Of those files.
  std::vector<std::size_t> taps_of_file;  ///< How many of `taps` each file has.
};
[[nodiscard]] TapRun AnalyseFiles(const TapArguments& arguments, const tap::TapOptions& options);

[[nodiscard]] std::vector<tap::TapResult> ResultsOf(std::span<const report::AnalysedTap> taps);

struct TapAdviceRun {
  tap::TapAdvice advice;
  tap::NoiseSpectrum noise;
};
[[nodiscard]] TapAdviceRun AdviseOn(std::span<const report::AnalysedTap> taps, double wanted_mm);

/// Exit code of what was measured: good where every tap is.
[[nodiscard]] int ExitCodeOf(std::span<const report::AnalysedTap> taps);

}  // namespace trammel::app
