#include "measurement/history.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <deque>
#include <fstream>
#include <functional>
#include <map>
#include <utility>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using measurement::Outcome;
using nlohmann::ordered_json;

constexpr std::size_t kMostLine = std::size_t{1} << 20;
constexpr std::size_t kMostKept = std::size_t{64} << 20;
constexpr std::size_t kMostNamed = 10;
constexpr std::size_t kMostApplications = 100;

/// Calls `take` with each line and its number from 1; absent: longer than kMostLine.
Result<void> ForEachLine(
    const fs::path& path,
    const std::function<void(std::optional<std::string_view>, std::size_t)>& take) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Fail(path.string() + ": there is no such file; check the path");
  if (!fs::is_regular_file(status)) return Fail(path.string() + ": is not an ordinary file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return Fail(path.string() + ": cannot be read");
  std::string line;
  bool too_long = false;
  std::size_t number = 1;
  const auto end_line = [&] {
    if (too_long) {
      take(std::nullopt, number);
    } else if (!line.empty()) {
      take(line, number);
    }
    line.clear();
    too_long = false;
    ++number;
  };
  std::array<char, 1 << 16> piece{};
  while (file.read(piece.data(), piece.size()), file.gcount() > 0) {
    std::string_view rest(piece.data(), static_cast<std::size_t>(file.gcount()));
    while (!rest.empty()) {
      const std::size_t end = rest.find('\n');
      const std::string_view part = rest.substr(0, end);
      too_long = too_long || line.size() + part.size() > kMostLine;
      if (!too_long) line += part;
      rest.remove_prefix(part.size());
      if (end == std::string_view::npos) break;
      rest.remove_prefix(1);
      end_line();
    }
  }
  if (file.bad()) return Fail(path.string() + ": reading failed");
  end_line();
  return {};
}

/// Tells results apart: 64-bit FNV-1a of all that result.json says but the details.
std::string Fingerprint(const Outcome& outcome) {
  std::uint64_t hash = 14695981039346656037U;
  for (const unsigned char c :
       JsonOf(outcome).dump(-1, ' ', false, ordered_json::error_handler_t::replace)) {
    hash = (hash ^ c) * 1099511628211U;
  }
  return fmt::format("{:016x}", hash);
}

}  // namespace

Result<History> ReadHistory(const fs::path& path, const HistoryQuery& query) {
  struct Kept {
    HistoryEntry entry;
    std::size_t bytes = 0;
  };
  History history;
  std::deque<Kept> kept;
  std::size_t bytes = 0;
  const auto skip = [&](const std::string& why) {
    if (history.skipped.size() < kMostNamed) history.skipped.push_back(why);
    ++history.skipped_lines;
  };
  const auto take = [&](std::optional<std::string_view> line, std::size_t number) {
    const std::string where = fmt::format("{}, line {}", path.string(), number);
    if (!line) return skip(fmt::format("{}: is longer than {} bytes", where, kMostLine));
    auto read = ParseHistoryLine(*line, where);
    if (!read) return skip(read.error().message);
    if (query.instrument && read->first.provenance.instrument != *query.instrument) return;
    kept.push_back({{std::move(read->first), std::move(read->second)}, line->size()});
    bytes += line->size();
    while (!kept.empty() && (kept.size() > query.last || bytes > kMostKept)) {
      bytes -= kept.front().bytes;
      kept.pop_front();
    }
  };
  if (auto read = ForEachLine(path, take); !read) return tl::unexpected(read.error());
  for (; !kept.empty(); kept.pop_back()) history.entries.push_back(std::move(kept.back().entry));
  return history;
}

Result<void> NoteApplication(const fs::path& path, const Outcome& outcome,
                             const Application& application) {
  const ordered_json json = {{"format", 1},
                             {"utc", application.utc},
                             {"machine", application.machine},
                             {"instrument", ToString(outcome.provenance.instrument)},
                             {"result", Fingerprint(outcome)}};
  return AppendLine(path, json.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

Result<void> AddApplications(const fs::path& path, History& history) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return {};
  std::map<std::string, HistoryEntry*> by_fingerprint;
  for (HistoryEntry& entry : history.entries) by_fingerprint[Fingerprint(entry.outcome)] = &entry;
  return ForEachLine(path, [&](std::optional<std::string_view> line, std::size_t /*number*/) {
    const auto json = line ? ParseJson(*line, path.string()) : Fail("too long");
    if (!json || !json->is_object()) return;
    JsonObject object(*json, path.string());
    object.Integer("format", {1, 1});
    const auto found = by_fingerprint.find(object.Text("result"));
    Application application{object.Text("utc"), object.Text("machine")};
    if (object.failed() || found == by_fingerprint.end()) return;
    std::vector<Application>& applied = found->second->applied;
    if (applied.size() == kMostApplications) applied.erase(applied.begin());
    applied.push_back(std::move(application));
  });
}

}  // namespace trammel::files
