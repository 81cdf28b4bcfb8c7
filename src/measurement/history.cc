#include "measurement/history.h"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/json_lines.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using measurement::Outcome;
using nlohmann::ordered_json;

constexpr std::size_t kMostKept = std::size_t{64} << 20;
constexpr std::size_t kMostNamed = 10;
constexpr std::size_t kMostApplications = 100;
constexpr const char* kBegun = "begun";
constexpr const char* kApplied = "applied";

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
    kept[{utc, number}] = {{std::move(read->first), std::move(read->second)}, line->size()};
    bytes += line->size();
    while (!kept.empty() && (kept.size() > query.last || bytes > kMostKept)) {
      bytes -= kept.begin()->second.bytes;
      kept.erase(kept.begin());
    }
  };
  if (auto read = ForEachLine(path, {}, take); !read) return tl::unexpected(read.error());
  for (auto it = kept.rbegin(); it != kept.rend(); ++it) {
    history.entries.push_back(std::move(it->second.entry));
  }
  return history;
}

ordered_json JsonOf(const Application& application) {
  ordered_json json = {{"utc", application.utc},
                       {"machine", application.machine},
                       {"step", application.begun ? kBegun : kApplied}};
  if (application.before) json["before"] = *application.before;
  return json;
}

Result<void> NoteApplication(const fs::path& path, const Outcome& outcome,
                             const Application& application) {
  ordered_json json = {{"format", 1},
                       {"instrument", ToString(outcome.provenance.instrument)},
                       {"result", Fingerprint(outcome)}};
  json.update(JsonOf(application));
  return AppendLine(path, json.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

Result<void> AddApplications(const fs::path& path, History& history) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return {};
  std::map<std::string, HistoryEntry*> by_fingerprint;
  for (HistoryEntry& entry : history.entries) by_fingerprint[Fingerprint(entry.outcome)] = &entry;
  const auto take = [&](std::optional<std::string_view> line, std::size_t /*number*/) {
    const auto json = line ? ParseJson(*line, path.string()) : Fail("too long");
    if (!json || !json->is_object()) return;
    JsonObject object(*json, path.string());
    object.Integer("format", {1, 1});
    const auto found = by_fingerprint.find(object.Text("result"));
    Application application{object.Text("utc"), object.Text("machine")};
    application.begun = object.OptionalChoice("step", {kBegun, kApplied}) == kBegun;
    application.before = object.OptionalNumber("before");
    if (object.failed() || found == by_fingerprint.end()) return;
    std::vector<Application>& applied = found->second->applied;
    if (!application.begun && !applied.empty() && applied.back().begun &&
        applied.back().machine == application.machine) {
      application.before = applied.back().before;
      applied.pop_back();
    }
    if (applied.size() == kMostApplications) applied.erase(applied.begin());
    applied.push_back(std::move(application));
  };
  if (auto read = ForEachLine(path, {}, take); !read) return tl::unexpected(read.error());
  return {};
}

}  // namespace trammel::files
