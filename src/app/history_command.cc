#include "app/history_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/kept_history.h"
#include "app/option_values.h"
#include "app/provenance.h"
#include "base/json_text.h"
#include "base/measured_json.h"
#include "base/utf8.h"
#include "document/interval_text.h"
#include "measurement/change.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "service/kept_results.h"

namespace trammel::app {
namespace {

using files::HistoryEntry;
using measurement::Answer;
using measurement::Instrument;
using measurement::Subject;
using nlohmann::ordered_json;

constexpr std::size_t kMax = 10'000;
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

struct HistoryArguments {
  std::string path = "recordings";
  std::string instrument = {};  // empty: any
  Subject subject = {};
  std::size_t last = 20;
  std::size_t number = 1;
  std::size_t before = 2;
  double age_days = service::kOldAge_days;
  bool json = false;

  [[nodiscard]] bool chooses() const { return !instrument.empty() || subject != Subject{}; }
};

/// Reads the newest of the selected results, with their applications.
Result<files::History> Read(const HistoryArguments& arguments, std::size_t last) {
  return ReadKept(arguments.path,
                  {last, measurement::InstrumentNamed(arguments.instrument), arguments.subject});
}

std::string AnswerText(const Answer& answer) {
  if (!answer.value.good()) {
    return fmt::format("{}: {}", VerdictText(answer.value.verdict()), answer.value.reason());
  }
  return report::WithInterval(answer.value.quantity(), report::StyleOfUnit(answer.unit));
}

std::string ApplicationText(const files::Application& application) {
  switch (application.step) {
    case files::Application::Step::kApplied:
      return fmt::format("applied {} to {}", application.utc, application.machine);
    case files::Application::Step::kBegun:
      return fmt::format(
          "about to be applied {} to {}, and not noted whether it was: trammel doctor tells, and "
          "the next pa apply notes it",
          application.utc, application.machine);
    case files::Application::Step::kUndone:
      return fmt::format("taken back {} on {}", application.utc, application.machine);
    case files::Application::Step::kUndoing:
      return fmt::format(
          "about to be taken back {} on {}, and not noted whether it was: trammel doctor tells, "
          "and "
          "the next pa apply notes it",
          application.utc, application.machine);
    case files::Application::Step::kNotInForce:
      return fmt::format("not in force {} on {}: the run that was about to set it ended early",
                         application.utc, application.machine);
  }
  return {};
}

std::string AppliedText(const HistoryEntry& entry) {
  if (entry.applied.empty()) return "not applied";
  return ApplicationText(entry.applied.back());
}

/// Returns a result's text with at most `most` of its answers.
std::string EntryText(std::size_t number, const HistoryEntry& entry, std::size_t most) {
  const std::vector<Answer>& answers = entry.outcome.answers;
  std::string text = fmt::format("{:<4} {}  {}  {}  {}\n", number, entry.outcome.provenance.utc,
                                 WordsOf(entry.outcome.provenance.instrument),
                                 VerdictText(entry.outcome.verdict()), AppliedText(entry));
  for (const Answer& answer : std::span(answers).first(std::min(most, answers.size()))) {
    text += fmt::format("     {}  {}\n", answer.name, AnswerText(answer));
  }
  if (answers.size() > most) {
    text +=
        fmt::format("     and {} more: trammel history show {}\n", answers.size() - most, number);
  }
  return text + fmt::format("     {}\n", entry.folder);
}

ordered_json EntryJson(std::size_t number, const HistoryEntry& entry) {
  ordered_json json = files::JsonOf(entry.outcome);
  json["folder"] = entry.folder;
  json["number"] = number;
  json["note"] = entry.remark.note;
  json["pinned"] = entry.remark.pinned;
  json["applied"] = ordered_json::array();
  for (const files::Application& application : entry.applied) {
    json["applied"].push_back(files::JsonOf(application));
  }
  return json;
}

/// Notes that the filter matches nothing: it may be mistyped.
void PrintNothingMatches(const HistoryArguments& arguments) {
  fmt::print(stderr, "{}\n",
             arguments.chooses()
                 ? "no result is of what was chosen; names are compared to the letter: trammel "
                   "history list without a choice shows them"
                 : "no result is kept here");
}

Result<int> RunList(const HistoryArguments& arguments) {
  const auto history = TRY(Read(arguments, arguments.last));
  constexpr std::size_t kShown = 3;
  ordered_json list = ordered_json::array();
  for (std::size_t i = 0; i < history.entries.size(); ++i) {
    const HistoryEntry& entry = history.entries[i];
    if (arguments.json) {
      list.push_back(EntryJson(i + 1, entry));
    } else {
      fmt::print("{}", EntryText(i + 1, entry, kShown));
    }
  }
  if (arguments.json) std::fputs(JsonText(list).c_str(), stdout);
  if (history.entries.empty()) PrintNothingMatches(arguments);
  return kExitGood;
}

Error NoResult(std::size_t number, std::size_t kept) {
  return {ErrorKind::kInput,
          fmt::format("there is no result {}: {} of them are kept", number, kept)};
}

Result<int> RunShow(const HistoryArguments& arguments) {
  const auto history = TRY(Read(arguments, kAll));
  if (history.entries.size() < arguments.number) {
    return tl::unexpected(NoResult(arguments.number, history.entries.size()));
  }
  const HistoryEntry& entry = history.entries[arguments.number - 1];
  if (arguments.json) {
    std::fputs(JsonText(EntryJson(arguments.number, entry)).c_str(), stdout);
    return kExitGood;
  }
  fmt::print("{}", EntryText(arguments.number, entry, entry.outcome.answers.size()));
  const Subject& subject = entry.outcome.subject;
  for (const measurement::Change& change : service::CompareWithEarlier(history, entry)) {
    fmt::print("     {}: {}\n", change.name, service::DriftText(change));
  }
  if (const auto* nozzle = service::NozzleChangeBefore(history, subject.printer, entry.order)) {
    fmt::print("     the nozzle was changed {}: compared with no older result\n", nozzle->utc);
  }
  for (const std::string& source : entry.outcome.provenance.sources) {
    fmt::print("     from {}\n", source);
  }
  fmt::print("     by {}\n", entry.outcome.provenance.program);
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    if (!(subject.*text).empty()) fmt::print("     {} {}\n", words, subject.*text);
  }
  for (const files::Application& application : entry.applied) {
    fmt::print("     {}\n", ApplicationText(application));
    if (application.before) fmt::print("       in force before: {:.4g}\n", *application.before);
  }
  for (const std::string& notice : entry.outcome.notices) fmt::print("     notice: {}\n", notice);
  if (!entry.remark.note.empty()) {
    fmt::print("     note: {}\n", EscapedForTerminal(entry.remark.note));
  }
  if (entry.remark.pinned) fmt::print("     pinned\n");
  return kExitGood;
}

ordered_json ComparisonJson(const HistoryArguments& arguments,
                            const std::vector<measurement::Change>& changes) {
  ordered_json json = {{"before", arguments.before},
                       {"after", arguments.number},
                       {"changes", ordered_json::array()}};
  for (const measurement::Change& change : changes) {
    json["changes"].push_back({{"name", change.name},
                               {"unit", change.unit},
                               {"before", MeasuredJson(change.before)},
                               {"after", MeasuredJson(change.after)},
                               {"difference", MeasuredJson(change.difference)},
                               {"differs", change.differs()}});
  }
  return json;
}

Result<int> RunCompare(const HistoryArguments& arguments) {
  const auto history = TRY(Read(arguments, std::max(arguments.before, arguments.number)));
  for (const std::size_t number : {arguments.before, arguments.number}) {
    if (history.entries.size() < number) {
      return tl::unexpected(NoResult(number, history.entries.size()));
    }
  }
  const measurement::Outcome& before = history.entries[arguments.before - 1].outcome;
  const measurement::Outcome& after = history.entries[arguments.number - 1].outcome;
  if (before.provenance.instrument != after.provenance.instrument) {
    return Fail(
        fmt::format("result {} is of {} and result {} of {}: choose with "
                    "--instrument, or by other numbers",
                    arguments.before, WordsOf(before.provenance.instrument), arguments.number,
                    WordsOf(after.provenance.instrument)));
  }
  const std::vector<measurement::Change> changes = measurement::Compare(before, after);
  const bool told =
      std::any_of(changes.begin(), changes.end(),
                  [](const measurement::Change& each) { return each.difference.good(); });
  const int code = told ? kExitGood : kExitNotTrusted;
  if (arguments.json) {
    std::fputs(JsonText(ComparisonJson(arguments, changes)).c_str(), stdout);
    return code;
  }
  for (const auto& [number, outcome] :
       {std::pair{arguments.before, &before}, std::pair{arguments.number, &after}}) {
    fmt::print("{:<4} {}  {}  {}\n", number, outcome->provenance.utc,
               WordsOf(outcome->provenance.instrument), VerdictText(outcome->verdict()));
  }
  for (const std::string& other : service::OtherConditions(before.subject, after.subject)) {
    fmt::print("     {}\n", other);
  }
  for (const measurement::Change& change : changes) {
    fmt::print("     {}  {}\n", change.name, service::ChangeText(change));
  }
  if (changes.empty()) fmt::print("     they have no quantity in common\n");
  return code;
}

Result<int> RunExport(const HistoryArguments& arguments) {
  const auto history = TRY(Read(arguments, kAll));
  std::fputs(service::ToCsv(history).c_str(), stdout);
  return kExitGood;
}

std::string DueText(const service::Measurand& measurand) {
  std::string text = fmt::format("{:<8} {}", measurand.reasons.empty() ? "fine" : "due",
                                 WordsOf(measurand.instrument));
  for (const auto& [key, words, member] : measurement::SubjectTexts()) {
    const std::string& name = measurand.subject.*member;
    if (!name.empty()) text += fmt::format(", {} {}", words, name);
  }
  text += '\n';
  for (const std::string& reason : measurand.reasons) {
    text += fmt::format("         {}\n", reason);
  }
  if (measurand.reasons.empty()) {
    text += fmt::format("         its last answer is of {}\n", measurand.last_good_utc);
  }
  return text;
}

ordered_json DueJson(const service::Measurand& measurand) {
  ordered_json json = {{"due", !measurand.reasons.empty()}};
  json.update(JsonOf(measurand));
  return json;
}

// A choice that matches nothing was never measured.
std::vector<service::Measurand> MeasurandsOf(const HistoryArguments& arguments,
                                             const files::History& history) {
  auto measurands = service::FindMeasurands(history, UtcNow(), arguments.age_days);
  if (measurands.empty() && arguments.chooses()) {
    measurands.push_back(
        {measurement::InstrumentNamed(arguments.instrument).value_or(Instrument::kPressureAdvance),
         arguments.subject,
         {"it was never measured"}});
  }
  return measurands;
}

Result<int> RunDue(const HistoryArguments& arguments) {
  const auto history = TRY(Read(arguments, kAll));
  ordered_json list = ordered_json::array();
  for (const service::Measurand& measurand : MeasurandsOf(arguments, history)) {
    if (arguments.json) {
      list.push_back(DueJson(measurand));
    } else {
      fmt::print("{}", DueText(measurand));
    }
  }
  if (arguments.json) std::fputs(JsonText(list).c_str(), stdout);
  return kExitGood;
}

/// --in, and the options that choose by instrument, filament, nozzle and printer.
void AddChoice(CLI::App& command, HistoryArguments& arguments) {
  const auto instruments = measurement::InstrumentNames();
  command.add_option("--in", arguments.path, "the folder of the recordings")->capture_default_str();
  command.add_option("--instrument", arguments.instrument, "only its results; left out: of all")
      ->check(CLI::IsMember(std::vector<std::string>{instruments.begin(), instruments.end()}));
  command.add_option("--filament", arguments.subject.filament, "only of this filament");
  command.add_option("--nozzle", arguments.subject.nozzle,
                     "only of the nozzle of this diameter in mm: 0.40");
  command.add_option("--printer", arguments.subject.printer, "only of the printer of this address");
}

void AddNumber(CLI::App& command, const char* name, std::size_t& number) {
  command.add_option(name, number, "as history list counts them: 1 is the newest")
      ->check(CLI::Range(std::size_t{1}, kMax))
      ->capture_default_str();
}

}  // namespace

void AddHistoryCommands(CLI::App& history, int& exit_code) {
  constexpr double kMaxDays = 36'500;
  history.require_subcommand(1);
  const auto add =
      [&](const char* name, const char* text, Result<int> (*run)(const HistoryArguments&),
          const std::vector<std::pair<const char*, std::size_t HistoryArguments::*>>& numbers =
              {}) {
        const auto arguments = std::make_shared<HistoryArguments>();
        CLI::App* const command = history.add_subcommand(name, text);
        for (const auto& [argument, number] : numbers) {
          AddNumber(*command, argument, (*arguments).*number);
        }
        AddChoice(*command, *arguments);
        command->callback([run, arguments, &exit_code] { exit_code = CodeOf(run(*arguments)); });
        return std::pair(command, arguments);
      };
  const auto [list, listed] = add("list", "the kept results, the newest first", RunList);
  list->add_flag("--json", listed->json, "as JSON");
  list->add_option("--last", listed->last, "at most so many")
      ->check(CLI::Range(std::size_t{1}, kMax))
      ->capture_default_str();
  const auto [show, shown] = add("show", "one of them, with all that is known of it", RunShow,
                                 {{"NUMBER", &HistoryArguments::number}});
  show->add_flag("--json", shown->json, "as JSON");
  const auto [compare, compared] = add(
      "compare", "how a result differs from another, with an interval: whether anything changed",
      RunCompare, {{"BEFORE", &HistoryArguments::before}, {"AFTER", &HistoryArguments::number}});
  compare->add_flag("--json", compared->json, "as JSON");
  add("export", "print them as a table (CSV), an answer a row; history list --json has JSON",
      RunExport);
  const auto [due, asked] =
      add("due", "what is to be measured anew: old, changed, or never measured", RunDue);
  due->add_flag("--json", asked->json, "as JSON");
  due->add_option("--age", asked->age_days, "days from which an answer is too old")
      ->check(NumberIn(0.01, kMaxDays))
      ->capture_default_str();
}

}  // namespace trammel::app
