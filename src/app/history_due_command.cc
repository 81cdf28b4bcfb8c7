#include "app/history_due_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/history_options.h"
#include "app/kept_history.h"
#include "app/number_range.h"
#include "app/provenance.h"
#include "base/json_text.h"
#include "measurement/due.h"
#include "measurement/nozzle_change.h"
#include "measurement/snooze.h"
#include "measurement/subject_json.h"
#include "session/run_journal.h"

namespace trammel::app {
namespace {

using measurement::Due;
using measurement::Instrument;
using measurement::Need;
using measurement::Subject;
using nlohmann::ordered_json;

struct DueArguments : HistoryOptions {
  measurement::DueRules rules;
  double snooze_days = 7;
  bool json = false;
};

/// One thing that is measured again and again.
struct Measurand {
  Instrument instrument = Instrument::kPressureAdvance;
  Subject subject = {};  ///< without its spool and temperatures
  Due due = {};
  std::string last_good_utc = {};
  std::string snoozed_until = {};

  [[nodiscard]] Need need() const { return snoozed_until.empty() ? due.need : Need::kNone; }
};

Subject ThingOf(Subject subject) {
  subject.spool = {};
  subject.nozzle_c = {};
  subject.bed_c = {};
  return subject;
}

/// @param entries  of one thing, the newest first
Result<Measurand> Judge(const DueArguments& arguments,
                        const std::vector<files::HistoryEntry>& entries,
                        const std::string& now_utc) {
  measurement::Series series;
  const files::HistoryEntry& newest = entries.front();
  if (newest.outcome.verdict() != Verdict::kGood) series.last_reason = newest.outcome.reason();
  const auto good = std::ranges::find_if(entries, [](const files::HistoryEntry& entry) {
    return entry.outcome.verdict() == Verdict::kGood;
  });
  if (good != entries.end()) {
    const measurement::Outcome& last = good->outcome;
    series.last_good_utc = last.provenance.utc;
    series.applied = WasApplied(*good);
    const auto earlier = CompareAmong(arguments.path, entries, last);
    if (!earlier) return tl::unexpected(earlier.error());
    series.changed = measurement::AnyDiffers(earlier->drift);
    series.creeps = !earlier->creep.empty();
    const auto nozzle = files::LastNozzleChange(
        NozzlesFileBeside(arguments.path), last.subject.printer, {now_utc, files::kStillToCome});
    if (!nozzle) return tl::unexpected(nozzle.error());
    const files::MeasuredAt measured{last.provenance.utc, good->line};
    if (*nozzle && files::IsAfter(**nozzle, measured)) series.nozzle_utc = (*nozzle)->utc;
  }
  Measurand measurand{newest.outcome.provenance.instrument, ThingOf(newest.outcome.subject)};
  measurand.due = JudgeDue(series, now_utc, arguments.rules);
  measurand.last_good_utc = series.last_good_utc;
  return measurand;
}

Result<void> AddSnooze(Measurand& measurand, const std::string& now_utc) {
  const auto state = files::StateFolder();
  if (!state) return tl::unexpected(state.error());
  const auto until =
      files::SnoozedUntil(*state / files::kSnoozedFile, measurand.instrument, measurand.subject);
  if (!until) return tl::unexpected(until.error());
  if (measurement::DaysBetween(now_utc, *until).value_or(0) > 0) measurand.snoozed_until = *until;
  return {};
}

/// Instrument, printer, nozzle, filament and last the toolhead, which earlier programs did not
/// note.
using Thing = std::tuple<Instrument, std::string, std::string, std::string, std::string>;
/// Their results, the newest first.
using Things = std::map<Thing, std::vector<files::HistoryEntry>>;

/// Counts results without a toolhead to the first one that is known: nobody will measure them again
/// under no name.
void JoinUnknownToolheads(Things& things) {
  for (auto at = things.begin(); at != things.end();) {
    const auto next = std::next(at);
    const auto& [instrument, printer, nozzle, filament, toolhead] = at->first;
    const bool joins = toolhead.empty() && next != things.end() &&
                       std::tie(instrument, printer, nozzle, filament) ==
                           std::tie(std::get<0>(next->first), std::get<1>(next->first),
                                    std::get<2>(next->first), std::get<3>(next->first));
    if (joins) {
      std::ranges::move(at->second, std::back_inserter(next->second));
      std::ranges::stable_sort(next->second, std::greater{}, [](const files::HistoryEntry& entry) {
        return entry.outcome.provenance.utc;
      });
      things.erase(at);
    }
    at = next;
  }
}

/// What was asked for and was never measured.
Measurand NeverMeasured(const DueArguments& arguments) {
  Measurand measurand;
  measurand.instrument =
      measurement::InstrumentNamed(arguments.instrument).value_or(Instrument::kPressureAdvance);
  measurand.subject = arguments.subject;
  measurand.due = {Need::kDue, {"it was never measured"}};
  return measurand;
}

/// All that the results are of, what is due first.
Result<std::vector<Measurand>> FindMeasurands(const DueArguments& arguments,
                                              const std::string& now_utc) {
  constexpr std::size_t kMost = 10'000;
  std::error_code ignored;
  const bool nothing_yet = arguments.chooses() &&
                           std::filesystem::is_directory(arguments.path, ignored) &&
                           std::filesystem::is_empty(arguments.path, ignored);
  files::History history;
  if (!nothing_yet) {
    auto read = ReadKeptAndApplied(arguments.path, QueryOf(arguments, kMost));
    if (!read) return tl::unexpected(read.error());
    history = std::move(*read);
  }
  Things things;
  for (files::HistoryEntry& entry : history.entries) {
    const Subject& subject = entry.outcome.subject;
    auto& thing = things[{entry.outcome.provenance.instrument, subject.printer, subject.nozzle,
                          subject.filament, subject.toolhead}];
    thing.push_back(std::move(entry));
  }
  JoinUnknownToolheads(things);
  std::vector<Measurand> measurands;
  for (const auto& [thing, entries] : things) {
    auto measurand = Judge(arguments, entries, now_utc);
    if (!measurand) return tl::unexpected(measurand.error());
    measurands.push_back(std::move(*measurand));
  }
  if (measurands.empty() && arguments.chooses()) measurands.push_back(NeverMeasured(arguments));
  for (Measurand& measurand : measurands) {
    if (auto added = AddSnooze(measurand, now_utc); !added) return tl::unexpected(added.error());
  }
  std::ranges::stable_sort(measurands, std::greater{}, &Measurand::need);
  return measurands;
}

std::string DueText(const Measurand& measurand) {
  const char* word = "fine";
  if (measurand.need() == Need::kSoon) word = "soon";
  if (measurand.need() == Need::kDue) word = "due";
  if (!measurand.snoozed_until.empty()) word = "snoozed";
  std::string text = fmt::format("{:<8} {}", word, WordsOf(measurand.instrument));
  for (const auto& [key, words, member] : measurement::SubjectTexts()) {
    const std::string& name = measurand.subject.*member;
    if (!name.empty()) text += fmt::format(", {} {}", words, name);
  }
  text += '\n';
  if (!measurand.snoozed_until.empty()) {
    text += fmt::format("         until {}\n", measurand.snoozed_until);
  }
  for (const std::string& reason : measurand.due.reasons) {
    text += fmt::format("         {}\n", reason);
  }
  if (measurand.due.reasons.empty()) {
    text += fmt::format("         its last answer is of {}\n", measurand.last_good_utc);
  }
  return text;
}

ordered_json DueJson(const Measurand& measurand) {
  ordered_json subject = ordered_json::object();
  files::AddSubject(subject, measurand.subject);
  return {{"need", ToString(measurand.need())},
          {"instrument", ToString(measurand.instrument)},
          {"subject", subject},
          {"reasons", measurand.due.reasons},
          {"last_good", measurand.last_good_utc},
          {"snoozed_until", measurand.snoozed_until}};
}

int RunDue(const DueArguments& arguments) {
  const auto measurands = FindMeasurands(arguments, UtcNow());
  if (!measurands) return PrintError(measurands.error());
  ordered_json list = ordered_json::array();
  for (const Measurand& measurand : *measurands) {
    if (arguments.json) {
      list.push_back(DueJson(measurand));
    } else {
      fmt::print("{}", DueText(measurand));
    }
  }
  if (arguments.json) std::fputs(JsonText(list).c_str(), stdout);
  return kExitGood;
}

int RunSnooze(const DueArguments& arguments) {
  const auto state = files::StateFolder();
  if (!state) return PrintError(state.error());
  const std::string until = UtcAfterDays(arguments.snooze_days);
  const files::Snooze snooze{until, measurement::InstrumentNamed(arguments.instrument),
                             arguments.subject};
  if (auto noted = files::NoteSnooze(*state / files::kSnoozedFile, snooze); !noted) {
    return PrintError(noted.error());
  }
  fmt::print("snoozed           {}until {}\n", arguments.chooses() ? "" : "all of them, ", until);
  return kExitGood;
}

}  // namespace

void AddHistoryDueCommands(CLI::App& history, int& exit_code) {
  constexpr double kMostDays = 36'500;
  const auto asked = std::make_shared<DueArguments>();
  CLI::App* due = history.add_subcommand(
      "due", "what is to be measured anew: old, changed, creeping, or never measured");
  AddHistoryOptions(*due, *asked);
  due->add_option("--age", asked->rules.age_days,
                  "days from which an answer is too old; from four fifths of them on it is soon")
      ->check(NumberIn(0.01, kMostDays))
      ->capture_default_str();
  due->add_flag("--json", asked->json, "as JSON");
  due->callback([asked, &exit_code] { exit_code = RunDue(*asked); });

  const auto put_off = std::make_shared<DueArguments>();
  CLI::App* snooze =
      history.add_subcommand("snooze", "call nothing of what is chosen due for a while");
  AddSubjectOptions(*snooze, *put_off);
  snooze->add_option("--days", put_off->snooze_days, "for so long from now; 0 ends it")
      ->check(NumberIn(0.0, kMostDays))
      ->capture_default_str();
  snooze->callback([put_off, &exit_code] { exit_code = RunSnooze(*put_off); });
}

}  // namespace trammel::app
