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

/// In the state folder: a line of each result that was set on a machine.
inline constexpr std::string_view kAppliedFile = "applied.jsonl";

/// A value was set on a machine, was about to be, or was taken back.
struct Application {
  enum class Step {
    kApplied,
    kBegun,       ///< noted before it is set: the program may have died before it was
    kUndone,      ///< what was in force before came back
    kUndoing,     ///< noted before that
    kNotInForce,  ///< the program died, or the machine refused, and later something else was there
  };
  std::string utc;      ///< ISO 8601, ending in Z
  std::string machine;  ///< its address
  Step step = Step::kApplied;
  std::optional<double> before = {};  ///< what was in force, in the unit of the first answer
  std::optional<double> value = {};   ///< what was set, in the same unit
  /// The same as `before` for each part of the machine that the value was set on, by its name;
  /// empty where it is one.
  std::map<std::string, double> before_each = {};
};

/// Whether an application was about to be changed, and nothing says whether it was.
[[nodiscard]] bool IsUnfinished(const Application& application);

/// {"utc", "machine", "step": "begun", "applied", "undoing", "undone" or "not_in_force", "before"
/// and "value" where they are known, "before_each" where the value was set on several parts}, as
/// applied.jsonl and --json have it.
[[nodiscard]] nlohmann::ordered_json JsonOf(const Application& application);

/// Adds a line about a result to applied.jsonl. Errors: those of AppendLine.
[[nodiscard]] Result<void> NoteApplication(const std::filesystem::path& path,
                                           const measurement::Outcome& outcome,
                                           const Application& application);

/// The same of a value that no result holds. @param fingerprint  empty: of none.
[[nodiscard]] Result<void> NoteApplication(const std::filesystem::path& path,
                                           measurement::Instrument instrument,
                                           const std::string& fingerprint,
                                           const Application& application);

/// A line of applied.jsonl.
struct NotedApplication {
  Application application;
  std::string fingerprint;  ///< of the result; empty: of none
};

/// Reads what applied.jsonl says of an instrument's values on a machine, the last 100, oldest
/// first; what was begun and then done, or undone, is one application. Empty where it says nothing,
/// or is not there. Errors: those of ForEachLine.
/// @param of_machine  whether a noted address is the machine's
[[nodiscard]] Result<std::vector<NotedApplication>> Applications(
    const std::filesystem::path& path, measurement::Instrument instrument,
    const std::function<bool(const std::string& address)>& of_machine);

/// Reads what applied.jsonl says of results, by their fingerprints: of each the last 100, oldest
/// first. What was begun and then done is one application. Other lines are passed over. Errors:
/// those of ForEachLine; a file that is not there says nothing.
[[nodiscard]] Result<std::map<std::string, std::vector<Application>>> AllApplications(
    const std::filesystem::path& path);

/// The longest line that is read.
inline constexpr std::size_t kMostLineBytes = std::size_t{1} << 20;

/// Visits each line that is neither empty nor longer than kMostLineBytes. A last line without a
/// line feed counts. Errors (kInput): not there, not an ordinary file, not readable.
[[nodiscard]] Result<void> ForEachLine(const std::filesystem::path& path,
                                       const std::function<void(std::string_view line)>& visit);

}  // namespace trammel::files
