// Answers of a server to requests about results: history, comparison, notes, deletion, use, taps.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "document/interval_text.h"
#include "measurement/outcome_file.h"
#include "service/job_record.h"
#include "service/job_server.h"
#include "service/kept_results.h"
#include "service/request_params.h"
#include "service/tap_log.h"
#include "session/crash_recovery.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using machine::RpcAnswer;
using measurement::Instrument;
using nlohmann::json;

constexpr std::size_t kMaxHistory = 1000;
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

RpcAnswer Refused(const Error& error) { return RpcAnswer::Refused(kRefused, error.message); }

Result<files::HistoryQuery> QueryOf(const json& params) {
  files::HistoryQuery query;
  query.last = TRY(CountOf(params, "last", query.last, kMaxHistory));
  const auto instrument = TRY(TextOf(params, "instrument"));
  if (!instrument.empty()) {
    query.instrument = measurement::InstrumentNamed(instrument);
    if (!query.instrument) return Fail(fmt::format("there is no instrument '{}'", instrument));
  }
  for (const auto& [key, text] : {std::pair{"filament", &query.subject.filament},
                                  std::pair{"nozzle", &query.subject.nozzle}}) {
    *text = TRY(TextOf(params, key));
  }
  return query;
}

std::string WordsOf(const measurement::Answer& answer, Instrument instrument) {
  if (!answer.value.good()) return answer.value.reason();
  report::IntervalStyle style = report::StyleOfUnit(answer.unit);
  style.signs = instrument == Instrument::kToolOffset;
  return report::WithInterval(answer.value.quantity(), style);
}

// @param here  name of the printer that is asked for
json ResultJson(const files::HistoryEntry& entry, const std::string& here) {
  const fs::path folder = entry.folder;
  const std::string run = folder.filename().string();
  const bool there = FolderOfRun(folder.parent_path(), run).has_value();
  json result = files::JsonOf(entry.outcome);
  result["folder"] = entry.folder;
  result["run"] = there ? json(run) : json();
  result["note"] = entry.remark.note;
  result["pinned"] = entry.remark.pinned;
  for (std::size_t i = 0; i < entry.outcome.answers.size(); ++i) {
    result["answers"][i]["words"] =
        WordsOf(entry.outcome.answers[i], entry.outcome.provenance.instrument);
  }
  result["applied"] = json::array();
  for (const files::Application& applied : entry.applied) {
    result["applied"].push_back(json(files::JsonOf(applied)));
    result["applied"].back()["here"] = procedure::PrinterName(applied.machine) == here;
  }
  return result;
}

// True for a folder that has a result, or the name of a run: others are the owner's.
bool IsRecording(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(fs::symlink_status(folder / files::kResultFile, error)) ||
         IsResultPicture(folder.filename().string() + ".png");
}

// Returns why a result must not be set on a printer that it was not measured on; empty: it may be.
std::string WhyNotElsewhere(const measurement::Outcome& outcome, const std::string& address) {
  const std::string& printer = outcome.subject.printer;
  const bool elsewhere =
      printer.empty() || procedure::PrinterName(printer) != procedure::PrinterName(address);
  if (!elsewhere || outcome.provenance.instrument == Instrument::kPressureAdvance) return {};
  return fmt::format("{} were measured on {}, and are no other printer's",
                     measurement::WordsOf(outcome.provenance.instrument),
                     printer.empty() ? "a printer that is not noted" : printer);
}

}  // namespace

std::string JobServer::subject() const { return procedure::PrinterName(options_.address); }

Result<files::History> JobServer::ReadResults(const files::HistoryQuery& query) const {
  std::error_code ignored;
  if (!fs::exists(options_.recordings, ignored)) return files::History();  // nothing measured yet
  auto history = TRY(ReadHistoryByPrinter(options_.recordings, query));
  TRY(files::AddApplications(options_.state_folder / files::kAppliedFile, history));
  return history;
}

RpcAnswer JobServer::HistoryAsked(const json& params) const {
  const auto query = QueryOf(params);
  if (!query) return Invalid(query.error().message);
  const auto history = ReadResults(*query);
  if (!history) return Refused(history.error());
  json results = json::array();
  for (const files::HistoryEntry& entry : history->entries) {
    results.push_back(ResultJson(entry, subject()));
  }
  return Ok({{"results", std::move(results)}});
}

RpcAnswer JobServer::CompareAsked(const json& params) const {
  std::vector<measurement::Outcome> outcomes;
  for (const char* key : {"before", "after"}) {
    const auto run = RunOf(params, key);
    if (!run) return Invalid(run.error().message);
    const auto folder = FolderOfRun(options_.recordings, *run);
    auto outcome =
        folder ? files::ReadOutcome(*folder / files::kResultFile) : tl::unexpected(folder.error());
    if (!outcome) return RpcAnswer::Refused(kNothing, outcome.error().message);
    outcomes.push_back(std::move(*outcome));
  }
  const auto& [before, after] = std::tie(outcomes[0], outcomes[1]);
  if (before.provenance.instrument != after.provenance.instrument) {
    return RpcAnswer::Refused(kRefused,
                              fmt::format("one result is of {}, the other of {}",
                                          measurement::WordsOf(before.provenance.instrument),
                                          measurement::WordsOf(after.provenance.instrument)));
  }
  json changes = json::array();
  for (const measurement::Change& change : measurement::Compare(before, after)) {
    changes.push_back({{"name", change.name},
                       {"unit", change.unit},
                       {"words", ChangeText(change)},
                       {"differs", change.differs()}});
  }
  return Ok({{"changes", std::move(changes)},
             {"others", OtherConditions(before.subject, after.subject)}});
}

RpcAnswer JobServer::DueAsked() const {
  files::HistoryQuery query{kMaxHistory};
  query.subject.printer = subject();
  const auto history = ReadResults(query);
  if (!history) return Refused(history.error());
  json due = json::array();
  for (const Measurand& measurand : FindMeasurands(*history, options_.utc_now(), kOldAge_days)) {
    if (!measurand.reasons.empty()) due.push_back(json(JsonOf(measurand)));
  }
  return Ok({{"due", std::move(due)}});
}

RpcAnswer JobServer::AnnotateAsked(const json& params) const {
  const auto run = RunOf(params);
  const auto note = TextOf(params, "note", files::kMaxNoteBytes, Lines::kSeveral);
  for (const auto& text : {run, note}) {
    if (!text) return Invalid(text.error().message);
  }
  const auto folder = FolderOfRun(options_.recordings, *run);
  if (!folder) return RpcAnswer::Refused(kNothing, folder.error().message);
  if (!IsRecording(*folder)) {
    return RpcAnswer::Refused(kNothing, fmt::format("{} is no recording", *run));
  }
  files::Remark remark = files::ReadRemark(*folder);
  if (params.contains("note")) remark.note = *note;
  if (const auto pinned = params.find("pinned"); pinned != params.end()) {
    if (!pinned->is_boolean()) return Invalid("'pinned' must be true or false");
    remark.pinned = pinned->get<bool>();
  }
  const auto written = files::WriteRemark(*folder, remark);
  if (!written) return Refused(written.error());
  return Ok({{"run", *run}, {"note", remark.note}, {"pinned", remark.pinned}});
}

RpcAnswer JobServer::DeleteAsked(const json& params) const {
  const auto run = RunOf(params);
  if (!run) return Invalid(run.error().message);
  const auto folder = FolderOfRun(options_.recordings, *run);
  if (!folder) return RpcAnswer::Refused(kNothing, folder.error().message);
  if (!IsRecording(*folder)) {
    return RpcAnswer::Refused(kNothing, fmt::format("{} is no recording", *run));
  }
  if (files::ReadRemark(*folder).pinned) {
    return RpcAnswer::Refused(kRefused, fmt::format("{} is pinned", *run));
  }
  const auto hold = options_.in_use->Delete(*folder);
  if (hold == nullptr) return RpcAnswer::Refused(kBusy, fmt::format("at work on {}", *run));
  {
    const std::lock_guard lock(mutex_);
    if (proposal_ && proposal_->folder == folder->string()) {
      return RpcAnswer::Refused(
          kRefused, fmt::format("the answer of {} waits: use it or drop it first", *run));
    }
  }
  const auto deleted = files::DeleteRecording(options_.recordings, *run);
  return deleted ? Ok(json::object()) : Refused(deleted.error());
}

RpcAnswer JobServer::UseAsked(const json& params) {
  const auto run = RunOf(params);
  const auto filament = TextOf(params, "filament");
  for (const auto& text : {run, filament}) {
    if (!text) return Invalid(text.error().message);
  }
  const auto folder = FolderOfRun(options_.recordings, *run);
  if (!folder) return RpcAnswer::Refused(kNothing, folder.error().message);
  const auto outcome = files::ReadOutcome(*folder / files::kResultFile);
  if (!outcome || outcome->verdict() != Verdict::kGood) {
    return RpcAnswer::Refused(kNothing, fmt::format("{} has no good answer", *run));
  }
  const auto kind = std::ranges::find_if(options_.jobs, [&outcome](const JobKind& each) {
    return each.instrument == outcome->provenance.instrument && each.apply;
  });
  if (kind == options_.jobs.end()) {
    return RpcAnswer::Refused(kRefused,
                              fmt::format("{} cannot be set from here",
                                          measurement::WordsOf(outcome->provenance.instrument)));
  }
  if (const std::string why = WhyNotElsewhere(*outcome, options_.address); !why.empty()) {
    return RpcAnswer::Refused(kRefused, why);
  }
  Proposal proposal{*run, kind->name, folder->string(), {}};
  if (!filament->empty()) proposal.arguments["filament"] = *filament;
  const auto waiting = FindWaiting(proposal);
  if (!waiting) {
    return RpcAnswer::Refused(kNothing, fmt::format("{} has no answer that could be set", *run));
  }
  if (!waiting->answer.why_not_set.empty()) {
    return RpcAnswer::Refused(kRefused, waiting->answer.why_not_set);
  }
  return BeginAsRequested({kApply, proposal.arguments, proposal.folder, waiting->kind, true});
}

// Returns why a run's value is not the one that would be set back; empty: it is.
std::string JobServer::WhyNotUndone(Instrument instrument, const std::string& run) const {
  const auto history = ReadResults({kMaxHistory, instrument});
  if (!history) return history.error().message;
  std::string last, utc;
  for (const files::HistoryEntry& entry : history->entries) {
    for (const files::Application& applied : entry.applied) {
      const bool here = procedure::PrinterName(applied.machine) == subject();
      if (!here || applied.utc < utc) continue;
      utc = applied.utc;
      last = fs::path(entry.folder).filename().string();
    }
  }
  return last == run ? "" : fmt::format("another value was set since that of {}", run);
}

RpcAnswer JobServer::UndoAsked(const json& params) {
  const auto name = TextOf(params, "instrument");
  if (!name) return Invalid(name.error().message);
  const auto instrument = measurement::InstrumentNamed(*name);
  if (!instrument) return Invalid(fmt::format("there is no instrument '{}'", *name));
  const auto kind = std::ranges::find_if(options_.jobs, [&instrument](const JobKind& each) {
    return each.instrument == instrument && !each.undo.empty();
  });
  if (kind == options_.jobs.end()) {
    return RpcAnswer::Refused(
        kRefused, fmt::format("{} cannot be set back", measurement::WordsOf(*instrument)));
  }
  const auto run = RunOf(params);
  if (!run) return Invalid(run.error().message);
  if (const std::string why = run->empty() ? "" : WhyNotUndone(*instrument, *run); !why.empty()) {
    return RpcAnswer::Refused(kRefused, why);
  }
  Plan plan{kUndo, {}, {}, &*kind, true};
  plan.undoes = true;
  return BeginAsRequested(std::move(plan));
}

Result<std::string> JobServer::Table() const { return ReadResults({kAll}).map(ToCsv); }

RpcAnswer JobServer::TapsAsked(const json& params) const {
  constexpr std::size_t kUsual = 20;
  constexpr std::size_t kMost = 100;
  const auto last = CountOf(params, "last", kUsual, kMost);
  if (!last) return Invalid(last.error().message);
  return Ok({{"taps", NewestTaps(options_.recordings, subject(), *last)},
             {"watching", options_.answers_taps}});
}

RpcAnswer JobServer::TapAsked(const json& params) const {
  const auto tap = TextOf(params, "tap");
  if (!tap) return Invalid(tap.error().message);
  auto found = TapIn(options_.recordings, *tap);
  if (!found) return RpcAnswer::Refused(kNothing, found.error().message);
  return Ok(std::move(*found));
}

}  // namespace trammel::service
