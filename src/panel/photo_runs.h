// Photos of patterns that browsers upload: a run's folder for each, measured by `trammel pa photo`.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>

#include "base/result.h"
#include "panel/measuring.h"

namespace trammel::panel {

struct PhotoRunsOptions {
  std::string program;               ///< path of trammel
  std::filesystem::path recordings;  ///< each photo gets a folder of its own in here
  std::function<std::string()> utc_now;
  std::function<void(const std::string&)> log;
};

/// Thread-safe; one photo is measured at a time, and another one waits.
class PhotoRuns {
 public:
  explicit PhotoRuns(PhotoRunsOptions options) : options_(std::move(options)) {}

  /// Stores a photo, as it is. @param content_type  "image/jpeg" … @returns the run's name.
  /// Errors: kInput: an unknown type, or not written; kMeasurement: enough runs for a day.
  [[nodiscard]] Result<std::string> Add(std::string_view content_type, std::string_view bytes);

  /// Stores the slicer's file of what a photo shows: G-code, or a 3MF that holds it.
  [[nodiscard]] Result<void> AddGcode(const std::string& run, std::string_view bytes);

  /// Measures a photo; an earlier result of it is replaced once there is a new one.
  /// @param pattern   as of `trammel pa photo --pattern`; empty or "trammel": by
  /// the plan of the last print
  /// @param filament  under which the history lists it; empty: unknown
  /// @returns the verdict, the answer in words and numbers, the lines that set it, and the names of
  /// pictures (docs/howto/serve.md). Errors: no such run; the photo is no picture.
  [[nodiscard]] Result<nlohmann::json> Measure(const std::string& run, const std::string& pattern,
                                               const std::string& filament,
                                               const std::stop_token& stop);

  /// Lets a photo's result be replaced no more, as its value is being set. @returns false: so it
  /// was already.
  [[nodiscard]] bool Freeze(const std::string& run);
  /// Lets it be replaced again.
  void Release(const std::string& run);

  /// True if a run's name is that of an upload.
  [[nodiscard]] static bool IsUpload(const std::string& run);

 private:
  [[nodiscard]] Result<std::filesystem::path> FolderOf(const std::string& run) const;
  const PhotoRunsOptions options_;
  std::mutex naming_;
  std::mutex freezing_;
  std::set<std::string> frozen_;
  MeasuringQueue queue_;
};

}  // namespace trammel::panel
