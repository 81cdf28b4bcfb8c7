// Results in a folder of recordings: what changed, what to measure again, and their table.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "measurement/change.h"
#include "measurement/history.h"

namespace trammel::service {

/// Reads a history with each printer under one name (procedure::PrinterName), whatever address its
/// results were measured over. Errors: those of files::ReadHistory.
[[nodiscard]] Result<files::History> ReadHistoryByPrinter(const std::filesystem::path& recordings,
                                                          files::HistoryQuery query);

/// True if a result was set on the machine that it was measured on.
[[nodiscard]] bool WasApplied(const files::HistoryEntry& entry);

/// Returns the last nozzle change of a printer before a result; null: none is recorded.
[[nodiscard]] const files::NozzleChange* NozzleChangeBefore(const files::History& history,
                                                            const std::string& printer,
                                                            std::int64_t order);

/// Compares a result with the mean of the last 100 earlier ones of the same instrument, printer,
/// nozzle and filament, since the last nozzle change. Empty if there are too few, or the measured
/// object is not recorded.
/// @param now  of the history, or not in it yet
[[nodiscard]] std::vector<measurement::Change> CompareWithEarlier(const files::History& history,
                                                                  const files::HistoryEntry& now);

/// "+0.0017 s (95 %: -0.0004 to +0.0038 s)" and whether that is a change: of Compare.
[[nodiscard]] std::string ChangeText(const measurement::Change& change);

/// Describes the change against the mean of earlier results and their number: of Drift.
[[nodiscard]] std::string DriftText(const measurement::Change& change);

/// Returns a sentence for each condition that two results do not share: "another nozzle: 0.40, then
/// 0.60".
[[nodiscard]] std::vector<std::string> OtherConditions(const measurement::Subject& before,
                                                       const measurement::Subject& after);

/// Measurand with repeated results.
struct Measurand {
  measurement::Instrument instrument = measurement::Instrument::kPressureAdvance;
  measurement::Subject subject = {};      ///< without its spool and temperatures
  std::vector<std::string> reasons = {};  ///< to measure it again; empty: none
  std::string last_good_utc = {};
};

/// {"instrument", "subject", "reasons", "last_good"}, as requests and --json have it.
[[nodiscard]] nlohmann::ordered_json JsonOf(const Measurand& measurand);

/// Days from which an answer is too old, unless others are asked for.
inline constexpr double kOldAge_days = 90;

/// Returns all measurands of a history's results, due ones first.
/// @param now_utc  ISO 8601 to the second, ending in Z
[[nodiscard]] std::vector<Measurand> FindMeasurands(const files::History& history,
                                                    const std::string& now_utc, double age_days);

/// Returns the results as CSV, a row for each answer; numbers are empty unless the verdict is good.
/// A text that a spreadsheet would read as a formula gets an apostrophe before it.
[[nodiscard]] std::string ToCsv(const files::History& history);

}  // namespace trammel::service
