// Surveys of a part whose pictures browsers upload one by one, measured by `trammel align survey`.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <string_view>

#include "base/result.h"
#include "panel/measuring.h"

namespace trammel::panel {

struct SurveyRunsOptions {
  std::string program;               ///< path of trammel
  std::filesystem::path recordings;  ///< each survey gets a folder of its own in here
  std::function<std::string()> utc_now;
  std::function<void(const std::string&)> log;
};

/// Thread-safe; one survey is measured at a time.
class SurveyRuns {
 public:
  explicit SurveyRuns(SurveyRunsOptions options) : options_(std::move(options)) {}

  /// Stores a picture, as it is. @param run  the survey's; empty: a new one begins
  /// @returns the survey's run. Errors: kInput: no such survey, an unknown type, enough pictures,
  /// not written; kMeasurement: enough runs for a day.
  [[nodiscard]] Result<std::string> Add(const std::string& run, std::string_view content_type,
                                        std::string_view bytes);

  /// Removes a picture, stores the scale bars, if any are given, finds the targets in the pictures
  /// that came since, and solves the survey. A new picture that cannot be read is removed.
  /// @param bars     list of {from, to, length_mm, sigma_mm}; null: those stored before
  /// @param without  name of a picture; empty: none
  /// @returns docs/howto/panel.md. Errors: no such survey or picture; bars that are none; it was
  /// not measured.
  [[nodiscard]] Result<nlohmann::json> Measure(const std::string& run, const nlohmann::json& bars,
                                               const std::string& without,
                                               const std::stop_token& stop);

 private:
  const SurveyRunsOptions options_;
  std::mutex naming_;
  MeasuringQueue queue_;
};

}  // namespace trammel::panel
