#include "app/history_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/history_csv.h"
#include "app/history_due_command.h"
#include "app/history_options.h"
#include "app/kept_history.h"
#include "app/number_range.h"
#include "base/json_text.h"
#include "base/measured_json.h"
#include "document/interval_text.h"
#include "measurement/change.h"
#include "measurement/history.h"
#include "measurement/history_index.h"
#include "measurement/outcome_file.h"
#include "measurement/retention.h"
#include "session/run_journal.h"

namespace trammel::app {
namespace {

using files::HistoryEntry;
using measurement::Answer;
using measurement::Instrument;
using nlohmann::ordered_json;

constexpr std::size_t kMost = 10'000;

struct HistoryArguments : HistoryOptions {
  std::string out;
  std::size_t last = 20;
  std::size_t number = 1;
  std::size_t before = 2;
  bool json = false;
};

std::string AnswerText(const Answer& answer) {
  if (!answer.value.good()) {
    return fmt::format("{}: {}", VerdictWords(answer.value.verdict()), answer.value.reason());
  }
  report::IntervalStyle style;
  style.unit = answer.unit;
  return report::WithInterval(answer.value.quantity(),
                              answer.unit == "rad" ? report::kPerMille : style);
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

/// A result with at most `most` of its answers.
std::string EntryText(std::size_t number, const HistoryEntry& entry, std::size_t most) {
  const std::vector<Answer>& answers = entry.outcome.answers;
  std::string text = fmt::format("{:<4} {}  {}  {}  {}\n", number, entry.outcome.provenance.utc,
                                 WordsOf(entry.outcome.provenance.instrument),
                                 VerdictWords(entry.outcome.verdict()), AppliedText(entry));
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
  json["applied"] = ordered_json::array();
  for (const files::Application& application : entry.applied) {
    json["applied"].push_back(files::JsonOf(application));
  }
  return json;
}

void SaySkipped(const files::SkippedLines& skipped) {
  for (const std::string& why : skipped.named) fmt::print(stderr, "passed over: {}\n", why);
  if (skipped.count > skipped.named.size()) {
    fmt::print(stderr, "passed over: {} more lines\n", skipped.count - skipped.named.size());
  }
}

/// The newest, with what was applied of them; says on standard error which lines are no results.
Result<files::History> Read(const HistoryArguments& arguments, std::size_t last) {
  auto history = ReadKeptAndApplied(arguments.path, QueryOf(arguments, last));
  if (history) SaySkipped({history->skipped, history->skipped_lines});
  return history;
}

/// A filter that leaves nothing may be a slip of the pen.
void SayNothingMatches(const HistoryArguments& arguments) {
  fmt::print(stderr, "{}\n",
             arguments.chooses()
                 ? "no result is of what was chosen; names are compared to the letter: trammel "
                   "history list without a choice shows them"
                 : "no result is kept here");
}

int RunList(const HistoryArguments& arguments) {
  const auto history = Read(arguments, arguments.last);
  if (!history) return PrintError(history.error());
  constexpr std::size_t kShown = 3;
  ordered_json list = ordered_json::array();
  for (std::size_t i = 0; i < history->entries.size(); ++i) {
    const HistoryEntry& entry = history->entries[i];
    if (arguments.json) {
      list.push_back(EntryJson(i + 1, entry));
    } else {
      fmt::print("{}", EntryText(i + 1, entry, kShown));
    }
  }
  if (arguments.json) std::fputs(JsonText(list).c_str(), stdout);
  if (history->entries.empty()) SayNothingMatches(arguments);
  return kExitGood;
}

int RunShow(const HistoryArguments& arguments) {
  const auto history = Read(arguments, arguments.number);
  if (!history) return PrintError(history.error());
  if (history->entries.size() < arguments.number) {
    return PrintError({ErrorKind::kInput, fmt::format("there is no result {}: {} of them are kept",
                                                      arguments.number, history->entries.size())});
  }
  const HistoryEntry& entry = history->entries.back();
  if (arguments.json) {
    std::fputs(JsonText(EntryJson(arguments.number, entry)).c_str(), stdout);
    return kExitGood;
  }
  fmt::print("{}", EntryText(arguments.number, entry, entry.outcome.answers.size()));
  const auto earlier = CompareWithEarlier(arguments.path, entry.outcome);
  if (!earlier) return PrintError(earlier.error());
  for (const measurement::Change& change : earlier->drift) {
    fmt::print("     {}: {}\n", change.name, DriftText(change));
  }
  for (const measurement::Creep& creep : earlier->creep) {
    fmt::print("     {}: {}\n", creep.name, CreepText(creep, earlier->applied_utc));
  }
  if (!earlier->nozzle_utc.empty()) {
    fmt::print("     the nozzle was changed {}: compared with no older result\n",
               earlier->nozzle_utc);
  }
  if (earlier->other_analyses > 0) {
    fmt::print("     {} more of this recording in the history, by other analyses\n",
               earlier->other_analyses);
  }
  for (const std::string& source : entry.outcome.provenance.sources) {
    fmt::print("     from {}\n", source);
  }
  fmt::print("     by {}\n", entry.outcome.provenance.program);
  const measurement::Subject& subject = entry.outcome.subject;
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    if (!(subject.*text).empty()) fmt::print("     {} {}\n", words, subject.*text);
  }
  for (const files::Application& application : entry.applied) {
    fmt::print("     {}\n", ApplicationText(application));
    if (application.before) fmt::print("       in force before: {:.4g}\n", *application.before);
  }
  for (const std::string& notice : entry.outcome.notices) fmt::print("     notice: {}\n", notice);
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

/// What is known to differ in what was measured.
std::string OtherThings(const measurement::Subject& before, const measurement::Subject& after) {
  std::string text;
  for (const auto& [key, words, member] : measurement::SubjectTexts()) {
    const std::string& a = before.*member;
    const std::string& b = after.*member;
    if (a == b) continue;
    text += fmt::format("     another {}: {}, then {}\n", words, a.empty() ? "not noted" : a,
                        b.empty() ? "not noted" : b);
  }
  return text;
}

int RunCompare(const HistoryArguments& arguments) {
  const auto history = Read(arguments, std::max(arguments.before, arguments.number));
  if (!history) return PrintError(history.error());
  for (const std::size_t number : {arguments.before, arguments.number}) {
    if (history->entries.size() < number) {
      return PrintError(
          {ErrorKind::kInput, fmt::format("there is no result {}: {} of them are kept", number,
                                          history->entries.size())});
    }
  }
  const measurement::Outcome& before = history->entries[arguments.before - 1].outcome;
  const measurement::Outcome& after = history->entries[arguments.number - 1].outcome;
  if (before.provenance.instrument != after.provenance.instrument) {
    return PrintError(
        {ErrorKind::kInput, fmt::format("result {} is of {} and result {} of {}: choose with "
                                        "--instrument, or by other numbers",
                                        arguments.before, WordsOf(before.provenance.instrument),
                                        arguments.number, WordsOf(after.provenance.instrument))});
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
               WordsOf(outcome->provenance.instrument), VerdictWords(outcome->verdict()));
  }
  fmt::print("{}", OtherThings(before.subject, after.subject));
  for (const measurement::Change& change : changes) {
    fmt::print("     {}  {}\n", change.name, ChangeText(change));
  }
  if (changes.empty()) fmt::print("     they have no quantity in common\n");
  return code;
}

int RunExport(const HistoryArguments& arguments) {
  const auto state = files::StateFolder();
  if (!state) return PrintError(state.error());
  const auto applied = files::AllApplications(*state / files::kAppliedFile);
  if (!applied) return PrintError(applied.error());
  std::fputs(kHistoryColumns, stdout);
  const auto skipped =
      ForEachKept(arguments.path, QueryOf(arguments, std::numeric_limits<std::size_t>::max()),
                  [&applied](files::HistoryEntry entry, std::size_t /*bytes*/) {
                    const auto found = applied->find(files::Fingerprint(entry.outcome));
                    if (found != applied->end()) entry.applied = found->second;
                    std::fputs(HistoryRows(entry).c_str(), stdout);
                  });
  if (!skipped) return PrintError(skipped.error());
  SaySkipped(*skipped);
  return kExitGood;
}

int RunRebuild(const HistoryArguments& arguments) {
  const auto rebuilt = files::RebuildIndex(arguments.path, arguments.out);
  if (!rebuilt) return PrintError(rebuilt.error());
  fmt::print("{} results, {} of them from folders alone\n", rebuilt->results,
             rebuilt->from_folders);
  return kExitGood;
}

struct PruneArguments {
  std::string path = "recordings";
  double budget_mb = 0;
  std::size_t keep_last = 3;
  bool yes = false;
};

int RunPrune(const PruneArguments& arguments) {
  constexpr double kMb = 1e6;
  const auto plan = files::PlanPruning(
      arguments.path, static_cast<std::uintmax_t>(arguments.budget_mb * kMb), arguments.keep_last);
  if (!plan) return PrintError(plan.error());
  const auto mb = [](std::uintmax_t bytes) { return static_cast<double>(bytes) / kMb; };
  for (const files::RawData& raw : plan->gone) {
    fmt::print("{}  {:8.1f} MB  {}\n", raw.utc, mb(raw.bytes), raw.folder.string());
    for (const auto& file : raw.files) {
      fmt::print("     {}\n", file.lexically_relative(raw.folder).string());
    }
  }
  if (arguments.yes) {
    if (auto done = files::Prune(*plan); !done) return PrintError(done.error());
  }
  fmt::print("recordings        {:.1f} MB, {} {:.1f} MB\n", mb(plan->bytes_before),
             arguments.yes ? "now" : "then", mb(plan->bytes_after));
  if (plan->without_result > 0) {
    fmt::print("left alone        {} folders without a result, which are not counted\n",
               plan->without_result);
  }
  if (mb(plan->bytes_after) > arguments.budget_mb) {
    fmt::print("above the budget  results, reports and the newest {} recordings stay\n",
               arguments.keep_last);
  }
  if (!plan->gone.empty() && !arguments.yes) {
    fmt::print("nothing removed   --yes removes these files for good; the results stay\n");
  }
  return kExitGood;
}

void AddJson(CLI::App& command, HistoryArguments& arguments) {
  command.add_flag("--json", arguments.json, "as JSON");
}

}  // namespace

void AddHistoryCommands(CLI::App& history, int& exit_code) {
  history.require_subcommand(1);
  const auto listed = std::make_shared<HistoryArguments>();
  CLI::App* list = history.add_subcommand("list", "the kept results, the newest first");
  AddHistoryOptions(*list, *listed);
  AddJson(*list, *listed);
  list->add_option("--last", listed->last, "at most so many")
      ->check(CLI::Range(std::size_t{1}, kMost))
      ->capture_default_str();
  list->callback([listed, &exit_code] { exit_code = RunList(*listed); });

  const auto shown = std::make_shared<HistoryArguments>();
  CLI::App* show = history.add_subcommand("show", "one of them, with all that is known of it");
  show->add_option("NUMBER", shown->number, "as history list counts them: 1 is the newest")
      ->check(CLI::Range(std::size_t{1}, kMost))
      ->capture_default_str();
  AddHistoryOptions(*show, *shown);
  AddJson(*show, *shown);
  show->callback([shown, &exit_code] { exit_code = RunShow(*shown); });

  const auto compared = std::make_shared<HistoryArguments>();
  CLI::App* compare = history.add_subcommand(
      "compare", "how a result differs from another, with an interval: whether anything changed");
  compare->add_option("BEFORE", compared->before, "as history list counts them")
      ->check(CLI::Range(std::size_t{1}, kMost))
      ->capture_default_str();
  compare->add_option("AFTER", compared->number, "the same: 1 is the newest")
      ->check(CLI::Range(std::size_t{1}, kMost))
      ->capture_default_str();
  AddHistoryOptions(*compare, *compared);
  AddJson(*compare, *compared);
  compare->callback([compared, &exit_code] { exit_code = RunCompare(*compared); });

  const auto exported = std::make_shared<HistoryArguments>();
  CLI::App* table = history.add_subcommand(
      "export", "print them as a table (CSV), an answer a row; history list --json has JSON");
  AddHistoryOptions(*table, *exported);
  table->callback([exported, &exit_code] { exit_code = RunExport(*exported); });

  AddHistoryDueCommands(history, exit_code);

  const auto pruned = std::make_shared<PruneArguments>();
  CLI::App* prune = history.add_subcommand(
      "prune", "the raw data of old recordings that would go for a budget; --yes removes it");
  prune->add_option("--in", pruned->path, "the folder of the recordings")->capture_default_str();
  prune->add_option("--budget", pruned->budget_mb, "MB that all recordings may take together")
      ->required()
      ->check(NumberIn(0.0, 1e9));
  prune->add_option("--keep-last", pruned->keep_last, "the newest so many stay whole")
      ->check(CLI::Range(std::size_t{0}, kMost))
      ->capture_default_str();
  prune->add_flag("--yes", pruned->yes, "remove it");
  prune->callback([pruned, &exit_code] { exit_code = RunPrune(*pruned); });

  const auto built = std::make_shared<HistoryArguments>();
  CLI::App* rebuild = history.add_subcommand(
      "rebuild", "build the index anew, from history.jsonl and the recordings' folders");
  rebuild->add_option("--in", built->path, "the folder of the recordings")->capture_default_str();
  rebuild->add_option("-o,--out", built->out,
                      "into a new file, and leave the folder's own as it is");
  rebuild->callback([built, &exit_code] { exit_code = RunRebuild(*built); });
}

}  // namespace trammel::app
