#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::files {

/// File in the state folder: a line for each result that was set on a machine.
inline constexpr std::string_view kAppliedFile = "applied.jsonl";

/// Record that a value was set on a machine, was about to be, or was restored.
struct Application {
  enum class Step {
    kApplied,
    kBegun,       ///< noted before it is set: the program may have died before it was
    kUndone,      ///< previous value restored
    kUndoing,     ///< noted before that
    kNotInForce,  ///< the program died, or the machine refused, and later something else was there
  };
  std::string utc;      ///< ISO 8601, ending in Z
  std::string machine;  ///< machine's address
  Step step = Step::kApplied;
  std::optional<double> before = {};  ///< previous value, in the unit of the first answer
  std::optional<double> value = {};   ///< what was set, in the same unit
  /// Values as `before`, by the name of each part of the machine that was set; empty if there is
  /// only one.
  std::map<std::string, double> before_each = {};
};

/// True if an application was begun or being undone, and its outcome is not noted.
[[nodiscard]] bool IsUnfinished(const Application& application);

/// {"utc", "machine", "step": "begun", "applied", "undoing", "undone" or "not_in_force", "before"
/// and "value" where they are known, "before_each" where the value was set on several parts}, as
/// applied.jsonl and --json have it.
[[nodiscard]] nlohmann::ordered_json JsonOf(const Application& application);

/// Appends a line about a result to applied.jsonl. Errors: those of AppendLine.
[[nodiscard]] Result<void> NoteApplication(const std::filesystem::path& path,
                                           const measurement::Outcome& outcome,
                                           const Application& application);

/// Does the same for a value without a result. @param fingerprint  empty: none.
[[nodiscard]] Result<void> NoteApplication(const std::filesystem::path& path,
                                           measurement::Instrument instrument,
                                           const std::string& fingerprint,
                                           const Application& application);

/// Line of applied.jsonl.
struct NotedApplication {
  Application application;
  std::string fingerprint;  ///< of the result; empty: no result
};

/// Reads from applied.jsonl an instrument's values on a machine, the last 100, oldest first; a
/// begun and then completed or undone application counts once. Empty if there are none, or no file.
/// Errors: those of ForEachLine.
/// @param of_machine  true if a recorded address is the machine's
[[nodiscard]] Result<std::vector<NotedApplication>> Applications(
    const std::filesystem::path& path, measurement::Instrument instrument,
    const std::function<bool(const std::string& address)>& of_machine);

/// Reads the applications of results from applied.jsonl, by fingerprint: of each the last 100,
/// oldest first. A begun and then completed application counts once. Skips other lines. Errors:
/// those of ForEachLine; a missing file counts as empty.
[[nodiscard]] Result<std::map<std::string, std::vector<Application>>> AllApplications(
    const std::filesystem::path& path);

/// Maximum length of a line.
inline constexpr std::size_t kMaxLineBytes = std::size_t{1} << 20;

/// Visits each line that is neither empty nor longer than kMaxLineBytes. A last line without a
/// line feed counts. Errors (kInput): missing, not an ordinary file, not readable.
[[nodiscard]] Result<void> ForEachLine(const std::filesystem::path& path,
                                       const std::function<void(std::string_view line)>& visit);

}  // namespace trammel::files
