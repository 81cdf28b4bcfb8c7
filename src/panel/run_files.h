// Files of runs that browsers may read: pictures, reports, results, a scan's newest frame.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace trammel::panel {

inline constexpr const char* kReport = "report.html";
inline constexpr const char* kSurveyTargets = "surveyed.json";
inline constexpr const char* kSurveyPoints = "surveyed.csv";
/// Name of the newest frame that a run has recorded.
inline constexpr std::string_view kNewestFrame = "now.jpg";

/// File for a browser.
struct RunFile {
  const char* content_type = "";
  std::string bytes;
};

/// Reads a file of a run by its name (docs/howto/panel.md); absent: no such run or file.
[[nodiscard]] std::optional<RunFile> ReadRunFile(const std::filesystem::path& recordings,
                                                 const std::string& run, std::string_view name);

/// Adds `pictures`, the names of those that a folder has, and `report`, its name or null.
void AddFiles(const std::filesystem::path& folder, nlohmann::json& answer);

}  // namespace trammel::panel
