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

/// JSON with a fixed order of keys; numbers in the shortest form that reads back as the same value.
[[nodiscard]] std::string FormatPlan(const pressure_advance::PatternPlan& plan);

/// Trusts nothing: types, bounds, that lines are as long as they say and lie on the bed.
/// Errors begin with `file` and name the key, the value and the bound.
[[nodiscard]] Result<pressure_advance::PatternPlan> ParsePlan(std::string_view text,
                                                              const std::string& file);

/// In the state folder.
inline constexpr std::string_view kPatternPrintsFile = "patterns.jsonl";

struct PatternPrint {
  std::string utc;            ///< this computer's clock: ISO 8601 to the second, ending in Z
  std::string printer;        ///< as measurement::Subject has it
  std::string folder;         ///< absolute; holds pattern.plan.json
  std::string filament = {};  ///< empty: nobody named it
  bool ended = false;         ///< else it was about to begin: the program may have died since
  /// The same moment by the clock that dates the files of the printer's server, in s since 1970;
  /// absent: not told.
  std::optional<double> server_s = {};
  bool for_photo = true;  ///< else for a scan
};

/// Which prints count.
enum class PrintsFor { kPhoto, kEither };

/// Adds a line. Errors: those of AppendLine.
[[nodiscard]] Result<void> NotePatternPrint(const std::filesystem::path& path,
                                            const PatternPrint& print);

/// Each printer's last one, by the order of lines; empty where the file is not there. Lines that
/// are none are passed over. Errors: those of ForEachLine. Memory: a line of at most 1 MiB.
[[nodiscard]] Result<std::map<std::string, PatternPrint>> LastPatternPrints(
    const std::filesystem::path& path, PrintsFor which);

/// One printer's; absent where none is noted.
[[nodiscard]] Result<std::optional<PatternPrint>> LastPatternPrint(
    const std::filesystem::path& path, std::string_view printer, PrintsFor which);

}  // namespace trammel::files
