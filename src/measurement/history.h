// What was measured over time, and what was applied of it: files of JSON lines that only grow.
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

/// A result as history.jsonl has it.
struct HistoryEntry {
  measurement::Outcome outcome;
  std::string folder;                     ///< of its recording, as it was given
  std::vector<Application> applied = {};  ///< oldest first
  std::optional<std::size_t> line =
      {};  ///< of history.jsonl, from 1; absent: a folder alone has it
};

/// Which results are read.
struct HistoryQuery {
  std::size_t last = 20;                                   ///< at most so many, the newest
  std::optional<measurement::Instrument> instrument = {};  ///< absent: of all
  measurement::Subject subject = {};  ///< its texts that are not empty; others are any
};

/// Whether a result is one that is asked for.
[[nodiscard]] bool Matches(const HistoryQuery& query, const measurement::Outcome& outcome);

struct History {
  std::vector<HistoryEntry> entries;  ///< the newest first, by the time that they state
  std::vector<std::string> skipped;   ///< what is wrong with lines that are no result, at most 10
  std::size_t skipped_lines = 0;
  bool cut = false;  ///< older ones were asked for, too, and left out: kMostHistoryBytes
};

/// The lines of results that a History holds at most.
inline constexpr std::size_t kMostHistoryBytes = std::size_t{64} << 20;

/// Reads history.jsonl. Lines that are no result are passed over, and named.
/// Memory: a line of at most 1 MiB and kMostHistoryBytes of results, however large the file; the
/// oldest of more go. Errors (kInput): not there, not an ordinary file, not readable.
[[nodiscard]] Result<History> ReadHistory(const std::filesystem::path& path,
                                          const HistoryQuery& query);

/// Tells results apart: 64-bit FNV-1a of all that result.json says but the details, in hexadecimal.
[[nodiscard]] std::string Fingerprint(const measurement::Outcome& outcome);

/// Whether an application was about to be changed, and nothing says whether it was.
[[nodiscard]] bool IsUnfinished(const Application& application);

/// Whether history.jsonl has a line of this result. Errors: those of ReadHistory; a file that is
/// not there has none.
[[nodiscard]] Result<bool> HistoryHolds(const std::filesystem::path& path,
                                        const measurement::Outcome& outcome);

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
/// or is not there. Errors: those of ReadHistory.
/// @param of_machine  whether a noted address is the machine's
[[nodiscard]] Result<std::vector<NotedApplication>> Applications(
    const std::filesystem::path& path, measurement::Instrument instrument,
    const std::function<bool(const std::string& address)>& of_machine);

/// Reads what applied.jsonl says of results, by their fingerprints: of each the last 100, oldest
/// first. What was begun and then done is one application. Other lines are passed over. Errors:
/// those of ReadHistory; a file that is not there says nothing.
/// @param wanted  whether a result of this fingerprint is asked for; absent: all are
[[nodiscard]] Result<std::map<std::string, std::vector<Application>>> AllApplications(
    const std::filesystem::path& path,
    const std::function<bool(const std::string& fingerprint)>& wanted = {});

/// The same for the entries of a history.
[[nodiscard]] Result<void> AddApplications(const std::filesystem::path& path, History& history);

}  // namespace trammel::files
