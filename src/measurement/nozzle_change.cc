#include "measurement/nozzle_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <system_error>
#include <vector>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/json_lines.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;

/// Hands over each change of a file with its line, in their order; none where it is not there.
Result<void> ForEachChange(
    const fs::path& path,
    const std::function<void(const NozzleChange&, std::string_view line)>& take) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(path, ignored))) return {};
  return ForEachLine(path, [&](std::optional<std::string_view> line, std::size_t) {
    const auto json = line ? ParseJson(*line, "") : tl::unexpected(Error{});
    if (!json || !json->is_object()) return;
    constexpr double kMostResults = 1e9;
    JsonObject object(*json, "");
    NozzleChange change{object.Text("utc"), object.Text("printer")};
    const auto results = object.OptionalNumber("results", {0, kMostResults});
    if (results) change.results = static_cast<std::size_t>(*results);
    if (!object.failed()) take(change, *line);
  });
}

std::optional<std::size_t> LinesOf(const fs::path& history) {
  std::size_t lines = 0;
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(history, ignored))) return lines;  // nothing was measured yet
  const auto read = ForEachLine(
      history, [&lines](std::optional<std::string_view>, std::size_t number) { lines = number; });
  return read ? std::optional(lines) : std::nullopt;
}

}  // namespace

bool IsAfter(const NozzleChange& change, const MeasuredAt& measured) {
  if (change.results && measured.line) return *change.results >= *measured.line;
  return change.utc > measured.utc;
}

Result<void> NoteNozzleChange(const fs::path& path, const NozzleChange& change) {
  constexpr std::size_t kDay = std::string_view("2026-01-02").size();
  const auto day = [](const std::string& utc) { return utc.substr(0, kDay); };
  std::vector<std::string> lines;
  std::size_t today = 0;
  const auto read = ForEachChange(path, [&](const NozzleChange& noted, std::string_view line) {
    lines.emplace_back(line);
    today += noted.printer == change.printer && day(noted.utc) == day(change.utc) ? 1 : 0;
    if (lines.size() > 2 * kMostChanges) lines.erase(lines.begin(), lines.begin() + kMostChanges);
  });
  if (!read) return read;
  if (today >= kMostChangesADay) {
    return Fail(
        fmt::format("{} changes of this printer's nozzle are noted of today already; does a "
                    "macro or a program note them again and again?",
                    today),
        ErrorKind::kMeasurement);
  }
  nlohmann::ordered_json json = {{"utc", change.utc}, {"printer", change.printer}};
  const auto results = change.results ? change.results : LinesOf(path.parent_path() / kHistoryFile);
  if (results) json["results"] = *results;
  const std::string line =
      json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  if (lines.size() < kMostChanges) return AppendLine(path, line);
  std::string text;
  for (std::size_t i = lines.size() - kMostChanges + 1; i < lines.size(); ++i)
    text += lines[i] + '\n';
  return WriteWholeFile(path, text + line + '\n', IfThere::kReplace);
}

Result<std::optional<NozzleChange>> LastNozzleChange(const fs::path& path, std::string_view printer,
                                                     const MeasuredAt& before) {
  std::optional<NozzleChange> last;
  const auto read = ForEachChange(path, [&](const NozzleChange& change, std::string_view) {
    if (change.printer != printer || IsAfter(change, before)) return;
    // Lines of earlier programs stand in the order of their clock alone.
    if (change.results || !last || change.utc >= last->utc) last = change;
  });
  if (!read) return tl::unexpected(read.error());
  return last;
}

}  // namespace trammel::files
