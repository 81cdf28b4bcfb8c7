// Reads and writes a pattern's plan, and finds its prints.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::files {

/// Formats JSON with a fixed order of keys; numbers in the shortest form that reads back as the
/// same value.
[[nodiscard]] std::string FormatPlan(const pressure_advance::PatternPlan& plan);

/// Validates all input: types, bounds, stated lengths of lines, and that they are on the bed.
/// Errors begin with `file` and state the key, the value and the bound.
[[nodiscard]] Result<pressure_advance::PatternPlan> ParsePlan(std::string_view text,
                                                              const std::string& file);

/// File in the state folder.
inline constexpr std::string_view kPatternPrintsFile = "patterns.jsonl";

struct PatternPrint {
  std::string utc;            ///< this computer's clock: ISO 8601 to the second, ending in Z
  std::string printer;        ///< as in measurement::Subject
  std::string folder;         ///< absolute; holds pattern.plan.json
  std::string filament = {};  ///< empty: nobody named it
  bool ended = false;         ///< else it was about to begin: the program may have died since
  /// Same moment by the clock of the printer server's file dates, in s since 1970; absent: unknown.
  std::optional<double> server_s = {};
  bool for_photo = true;  ///< else for a scan
};

/// Prints to include.
enum class PrintsFor { kPhoto, kEither };

/// Appends a record of the print. Errors: those of AppendLine.
[[nodiscard]] Result<void> NotePatternPrint(const std::filesystem::path& path,
                                            const PatternPrint& print);

/// Returns each printer's last print, by the order of lines; empty if the file is missing. Skips
/// invalid lines. Errors: those of ForEachLine. Memory: a line of at most 1 MiB.
[[nodiscard]] Result<std::map<std::string, PatternPrint>> LastPatternPrints(
    const std::filesystem::path& path, PrintsFor which);

/// Returns one printer's last print; absent if none is recorded.
[[nodiscard]] Result<std::optional<PatternPrint>> LastPatternPrint(
    const std::filesystem::path& path, std::string_view printer, PrintsFor which);

}  // namespace trammel::files
