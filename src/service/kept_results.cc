#include "service/kept_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include "document/interval_text.h"
#include "measurement/outcome_file.h"
#include "session/crash_recovery.h"

namespace trammel::service {
namespace {

using files::History;
using files::HistoryEntry;
using measurement::Answer;
using measurement::Change;
using measurement::Instrument;
using measurement::Outcome;
using measurement::Subject;

// Quotes a text for a table.
std::string Cell(std::string_view text) {
  const bool formula =
      !text.empty() && std::string_view("=+-@\t\r").find(text[0]) != std::string_view::npos;
  std::string cell = formula ? "\"'" : "\"";
  for (const char c : text) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + "\"";
}

std::string RowsOf(const HistoryEntry& entry) {
  const auto& [provenance, answers, notices, subject] = entry.outcome;
  const auto applied = std::find_if(
      entry.applied.rbegin(), entry.applied.rend(),
      [](const auto& each) { return each.step == files::Application::Step::kApplied; });
  const files::Application last = applied == entry.applied.rend() ? files::Application{} : *applied;
  std::string rows;
  for (const Answer& answer : answers) {
    std::string numbers = ",,,";
    if (answer.value.good()) {
      const Quantity& quantity = answer.value.quantity();
      numbers = fmt::format("{},{},{},{}", quantity.value, quantity.standard_uncertainty,
                            quantity.interval95.lo, quantity.interval95.hi);
    }
    rows += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                        Cell(provenance.utc), ToString(provenance.instrument),
                        Cell(subject.printer), Cell(subject.nozzle), Cell(subject.filament),
                        Cell(answer.name), Cell(answer.unit), ToString(answer.value.verdict()),
                        numbers, Cell(answer.value.reason()), Cell(last.utc), Cell(last.machine),
                        Cell(provenance.program), Cell(entry.folder), Cell(subject.toolhead),
                        Cell(subject.spool), Cell(subject.nozzle_c), Cell(subject.bed_c));
  }
  return rows;
}

/// @param entries  of one measurand, the newest first
Measurand Judge(const History& history, const std::vector<const HistoryEntry*>& entries,
                const std::string& now_utc, double age_days) {
  measurement::Series series;
  const Outcome& newest = entries.front()->outcome;
  if (newest.verdict() != Verdict::kGood) series.last_reason = newest.reason();
  const auto good = std::ranges::find(
      entries, Verdict::kGood, [](const HistoryEntry* entry) { return entry->outcome.verdict(); });
  if (good != entries.end()) {
    const HistoryEntry& last = **good;
    series.last_good_utc = last.outcome.provenance.utc;
    series.applied = WasApplied(last);
    series.changed = std::ranges::any_of(CompareWithEarlier(history, last), &Change::differs);
    const auto* nozzle = NozzleChangeBefore(history, last.outcome.subject.printer,
                                            std::numeric_limits<std::int64_t>::max());
    if (nozzle != nullptr && nozzle->after >= last.order) series.nozzle_utc = nozzle->utc;
  }
  Measurand measurand{newest.provenance.instrument, newest.subject,
                      ReasonsToMeasure(series, now_utc, age_days), series.last_good_utc};
  measurand.subject.spool = {};
  measurand.subject.nozzle_c = {};
  measurand.subject.bed_c = {};
  return measurand;
}

}  // namespace

Result<files::History> ReadHistoryByPrinter(const std::filesystem::path& recordings,
                                            files::HistoryQuery query) {
  const auto name = [](const std::string& printer) {
    return printer.empty() ? printer : procedure::PrinterName(printer);
  };
  const std::string printer = name(std::exchange(query.subject.printer, {}));
  const std::size_t last = query.last;
  if (!printer.empty()) query.last = std::numeric_limits<std::size_t>::max();
  auto history = TRY(files::ReadHistory(recordings, query));
  for (auto& entry : history.entries) {
    entry.outcome.subject.printer = name(entry.outcome.subject.printer);
  }
  for (auto& change : history.nozzle_changes) change.printer = name(change.printer);
  if (!printer.empty()) {
    std::erase_if(history.entries,
                  [&](const auto& entry) { return entry.outcome.subject.printer != printer; });
    if (history.entries.size() > last) {
      history.entries.erase(history.entries.begin() + static_cast<std::ptrdiff_t>(last),
                            history.entries.end());
    }
  }
  return history;
}

bool WasApplied(const HistoryEntry& entry) {
  const std::string& printer = entry.outcome.subject.printer;
  return std::ranges::any_of(entry.applied, [&printer](const files::Application& application) {
    return application.step == files::Application::Step::kApplied &&
           (printer.empty() || procedure::PrinterName(application.machine) == printer);
  });
}

const files::NozzleChange* NozzleChangeBefore(const History& history, const std::string& printer,
                                              std::int64_t order) {
  const files::NozzleChange* last = nullptr;
  for (const files::NozzleChange& change : history.nozzle_changes) {
    if (change.printer == printer && change.after < order) last = &change;
  }
  return last;
}

std::vector<Change> CompareWithEarlier(const History& history, const HistoryEntry& now) {
  constexpr std::size_t kMaxForDrift = 100;
  const auto* nozzle = NozzleChangeBefore(history, now.outcome.subject.printer, now.order);
  const std::int64_t newer_than = nozzle != nullptr ? nozzle->after : 0;
  std::vector<const HistoryEntry*> earlier;
  for (const HistoryEntry& entry : history.entries) {
    if (entry.order < now.order && entry.order > newer_than &&
        measurement::SameSubject(entry.outcome, now.outcome)) {
      earlier.push_back(&entry);
    }
  }
  std::ranges::sort(earlier, std::greater{},
                    [](const HistoryEntry* entry) { return entry->order; });
  earlier.resize(std::min(earlier.size(), kMaxForDrift));
  std::vector<Outcome> outcomes;
  for (const HistoryEntry* const entry : earlier) outcomes.push_back(entry->outcome);
  return measurement::Drift(outcomes, now.outcome);
}

std::string ChangeText(const Change& change) {
  if (!change.difference.good()) return change.difference.reason();
  report::IntervalStyle style = report::StyleOfUnit(change.unit);
  style.signs = true;
  return report::WithInterval(change.difference.quantity(), style) +
         (change.differs() ? ": it has changed" : ": no change that can be told");
}

std::string DriftText(const Change& change) {
  const Quantity& mean = change.before.quantity();
  return fmt::format(
      "{} against {}, the mean of {} earlier results of this printer, nozzle and "
      "filament",
      ChangeText(change),
      report::ValueText(mean.value, mean.interval95, report::StyleOfUnit(change.unit)),
      change.results);
}

std::vector<std::string> OtherConditions(const Subject& before, const Subject& after) {
  std::vector<std::string> others;
  for (const auto& [key, words, member] : measurement::SubjectTexts()) {
    const std::string& a = before.*member;
    const std::string& b = after.*member;
    if (a == b) continue;
    others.push_back(fmt::format("another {}: {}, then {}", words, a.empty() ? "not noted" : a,
                                 b.empty() ? "not noted" : b));
  }
  return others;
}

std::vector<Measurand> FindMeasurands(const History& history, const std::string& now_utc,
                                      double age_days) {
  using Key = std::tuple<Instrument, std::string, std::string, std::string, std::string>;
  std::map<Key, std::vector<const HistoryEntry*>> things;
  for (const HistoryEntry& entry : history.entries) {
    const Subject& subject = entry.outcome.subject;
    things[{entry.outcome.provenance.instrument, subject.printer, subject.nozzle, subject.filament,
            subject.toolhead}]
        .push_back(&entry);
  }
  std::vector<Measurand> measurands;
  for (const auto& [key, entries] : things) {
    measurands.push_back(Judge(history, entries, now_utc, age_days));
  }
  std::ranges::stable_partition(
      measurands, [](const Measurand& measurand) { return !measurand.reasons.empty(); });
  return measurands;
}

nlohmann::ordered_json JsonOf(const Measurand& measurand) {
  nlohmann::ordered_json subject = nlohmann::ordered_json::object();
  files::AddSubject(subject, measurand.subject);
  return {{"instrument", measurement::ToString(measurand.instrument)},
          {"subject", std::move(subject)},
          {"reasons", measurand.reasons},
          {"last_good", measurand.last_good_utc}};
}

std::string ToCsv(const History& history) {
  std::string table =
      "utc,instrument,printer,nozzle,filament,name,unit,verdict,value,standard_uncertainty,"
      "interval95_lo,interval95_hi,reason,applied_utc,applied_to,program,folder,toolhead,spool,"
      "nozzle_c,bed_c\n";
  for (const HistoryEntry& entry : history.entries) table += RowsOf(entry);
  return table;
}

}  // namespace trammel::service
