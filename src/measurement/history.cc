#include "measurement/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/json_lines.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using measurement::Instrument;
using measurement::Outcome;
using nlohmann::ordered_json;

constexpr std::size_t kMostNamed = 10;
constexpr std::size_t kMostApplications = 100;
constexpr std::size_t kMostParts = 100;  // of a machine, that one value is set on
using Step = Application::Step;
// As Step has them.
constexpr std::array kSteps = {"applied", "begun", "undone", "undoing", "not_in_force"};

}  // namespace

std::string Fingerprint(const Outcome& outcome) {
  const std::string json =
      JsonOf(outcome).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  return fmt::format("{:016x}", Fnv1a(json));
}

bool Matches(const HistoryQuery& query, const Outcome& outcome) {
  const auto fits = [](const std::string& asked, const std::string& has) {
    return asked.empty() || asked == has;
  };
  return (!query.instrument || *query.instrument == outcome.provenance.instrument) &&
         fits(query.subject.printer, outcome.subject.printer) &&
         fits(query.subject.nozzle, outcome.subject.nozzle) &&
         fits(query.subject.filament, outcome.subject.filament);
}

Result<History> ReadHistory(const fs::path& path, const HistoryQuery& query) {
  struct Kept {
    HistoryEntry entry;
    std::size_t bytes = 0;
  };
  History history;
  std::map<std::pair<std::string, std::size_t>, Kept> kept;  // by time, then by line, as the index
  std::size_t bytes = 0;
  const auto skip = [&](const std::string& why) {
    if (history.skipped.size() < kMostNamed) history.skipped.push_back(why);
    ++history.skipped_lines;
  };
  const auto take = [&](std::optional<std::string_view> line, std::size_t number) {
    const std::string where = fmt::format("{}, line {}", path.string(), number);
    if (!line) return skip(fmt::format("{}: is longer than {} bytes", where, kMostLineBytes));
    auto read = ParseHistoryLine(*line, where);
    if (!read) return skip(read.error().message);
    if (!Matches(query, read->first)) return;
    const std::string utc = read->first.provenance.utc;
    kept[{utc, number}] = {{std::move(read->first), std::move(read->second), {}, number},
                           line->size()};
    bytes += line->size();
    while (!kept.empty() && (kept.size() > query.last || bytes > kMostHistoryBytes)) {
      history.cut = history.cut || kept.size() <= query.last;
      bytes -= kept.begin()->second.bytes;
      kept.erase(kept.begin());
    }
  };
  if (auto read = ForEachLine(path, take); !read) return tl::unexpected(read.error());
  for (auto it = kept.rbegin(); it != kept.rend(); ++it) {
    history.entries.push_back(std::move(it->second.entry));
  }
  return history;
}

bool IsUnfinished(const Application& application) {
  return application.step == Step::kBegun || application.step == Step::kUndoing;
}

Result<bool> HistoryHolds(const fs::path& path, const Outcome& outcome) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return false;
  const std::string own = Fingerprint(outcome);
  bool holds = false;
  const auto take = [&](std::optional<std::string_view> line, std::size_t /*number*/) {
    if (holds || !line || line->find(outcome.provenance.utc) == std::string_view::npos) return;
    const auto read = ParseHistoryLine(*line, path.string());
    holds = read && Fingerprint(read->first) == own;
  };
  if (auto read = ForEachLine(path, take); !read) return tl::unexpected(read.error());
  return holds;
}

ordered_json JsonOf(const Application& application) {
  ordered_json json = {{"utc", application.utc},
                       {"machine", application.machine},
                       {"step", kSteps[static_cast<std::size_t>(application.step)]}};
  if (application.before) json["before"] = *application.before;
  if (application.value) json["value"] = *application.value;
  if (!application.before_each.empty()) json["before_each"] = application.before_each;
  return json;
}

Result<void> NoteApplication(const fs::path& path, Instrument instrument,
                             const std::string& fingerprint, const Application& application) {
  ordered_json json = {
      {"format", 1}, {"instrument", ToString(instrument)}, {"result", fingerprint}};
  json.update(JsonOf(application));
  return AppendLine(path, json.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

Result<void> NoteApplication(const fs::path& path, const Outcome& outcome,
                             const Application& application) {
  return NoteApplication(path, outcome.provenance.instrument, Fingerprint(outcome), application);
}

namespace {

struct AppliedLine {
  std::string instrument;
  std::string fingerprint;
  Application application;
};

// At most kMostParts, each a number.
std::map<std::string, double> ReadBeforeEach(JsonObject& object) {
  std::map<std::string, double> before;
  const nlohmann::json* each = object.Find("before_each");
  if (each == nullptr) return before;
  if (!each->is_object() || each->size() > kMostParts) {
    object.Fault("before_each", fmt::format("must be an object of at most {} keys", kMostParts));
    return before;
  }
  JsonObject values = object.Inner(*each, "before_each");
  for (const auto& [name, value] : each->items()) before[name] = values.Number(name.c_str());
  if (const auto read = values.Faults(); !read) object.Adopt(read.error());
  return before;
}

std::optional<AppliedLine> ParseAppliedLine(std::optional<std::string_view> line,
                                            const fs::path& path) {
  const auto json = line ? ParseJson(*line, path.string()) : Fail("too long");
  if (!json || !json->is_object()) return std::nullopt;
  JsonObject object(*json, path.string());
  object.Integer("format", {1, 1});
  AppliedLine read;
  read.instrument = object.Text("instrument");
  read.fingerprint = object.Text("result");
  Application& application = read.application;
  application.utc = object.Text("utc");
  application.machine = object.Text("machine");
  const std::string step =
      object.OptionalChoice("step", {kSteps[0], kSteps[1], kSteps[2], kSteps[3], kSteps[4]})
          .value_or(kSteps[0]);
  application.step = static_cast<Application::Step>(std::find(kSteps.begin(), kSteps.end(), step) -
                                                    kSteps.begin());
  application.before = object.OptionalNumber("before");
  application.value = object.OptionalNumber("value");
  application.before_each = ReadBeforeEach(object);
  if (object.failed()) return std::nullopt;
  return read;
}

// What was begun and then done, or done and then undone, is one; what was in force before the
// first of them, and what it set, is what counts.
bool Continues(const Application& before, const Application& now) {
  if (now.step == Step::kApplied || now.step == Step::kNotInForce) return IsUnfinished(before);
  return now.step == Step::kUndone || now.step == Step::kUndoing;
}

Application Merged(const Application& before, Application now) {
  now.before = before.before;
  now.before_each = before.before_each;
  if (before.value) now.value = before.value;
  return now;
}

}  // namespace

Result<std::vector<NotedApplication>> Applications(
    const fs::path& path, Instrument instrument,
    const std::function<bool(const std::string& address)>& of_machine) {
  std::vector<NotedApplication> noted;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return noted;
  const auto take = [&](std::optional<std::string_view> line, std::size_t /*number*/) {
    auto read = ParseAppliedLine(line, path);
    if (!read || read->instrument != ToString(instrument) ||
        !of_machine(read->application.machine)) {
      return;
    }
    if (!noted.empty() && noted.back().fingerprint == read->fingerprint &&
        Continues(noted.back().application, read->application)) {
      noted.back().application = Merged(noted.back().application, std::move(read->application));
      return;
    }
    if (noted.size() == kMostApplications) noted.erase(noted.begin());
    noted.push_back({std::move(read->application), std::move(read->fingerprint)});
  };
  if (auto read = ForEachLine(path, take); !read) return tl::unexpected(read.error());
  return noted;
}

Result<std::map<std::string, std::vector<Application>>> AllApplications(
    const fs::path& path, const std::function<bool(const std::string&)>& wanted) {
  std::map<std::string, std::vector<Application>> all;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return all;
  const auto take = [&](std::optional<std::string_view> line, std::size_t /*number*/) {
    auto read = ParseAppliedLine(line, path);
    if (!read || read->fingerprint.empty() || (wanted && !wanted(read->fingerprint))) return;
    std::vector<Application>& applied = all[read->fingerprint];
    Application application = std::move(read->application);
    if (!applied.empty() && applied.back().machine == application.machine &&
        Continues(applied.back(), application)) {
      application = Merged(applied.back(), std::move(application));
      applied.pop_back();
    }
    if (applied.size() == kMostApplications) applied.erase(applied.begin());
    applied.push_back(std::move(application));
  };
  if (auto read = ForEachLine(path, take); !read) return tl::unexpected(read.error());
  return all;
}

Result<void> AddApplications(const fs::path& path, History& history) {
  std::multimap<std::string, HistoryEntry*> by_fingerprint;
  for (HistoryEntry& entry : history.entries) {
    by_fingerprint.emplace(Fingerprint(entry.outcome), &entry);
  }
  const auto all = AllApplications(path, [&by_fingerprint](const std::string& fingerprint) {
    return by_fingerprint.contains(fingerprint);
  });
  if (!all) return tl::unexpected(all.error());
  for (const auto& [fingerprint, entry] : by_fingerprint) {
    const auto found = all->find(fingerprint);
    if (found != all->end()) entry->applied = found->second;
  }
  return {};
}

}  // namespace trammel::files
