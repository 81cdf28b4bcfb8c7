#include "tool_offset/files/offset_files.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "base/json_text.h"
#include "files/json_object.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;  // format of history and start.json
constexpr int kMaxTool = 99;
constexpr NumberRange kKept_mm{-1000, 1000};  // no head carries two tools so far from each other

/// Returns the name of an enumeration's value; names are in its order.
template <class Stage, std::size_t kCount>
const char* NameOf(Stage stage, const std::array<const char*, kCount>& names) {
  return names[static_cast<std::size_t>(stage)];
}
template <class Stage, std::size_t kCount>
Stage StageOf(const std::string& name, const std::array<const char*, kCount>& names) {
  return static_cast<Stage>(std::find(names.begin(), names.end(), name) - names.begin());
}

constexpr std::array kOffsetStages{"begun", "applied", "kept", "undone"};
constexpr std::array kStartStages{"printing", "printed", "analysed"};

/// Reads the tools of a stored result: tool_N_dx beside tool_N_dy.
Result<OffsetFile> OffsetsOf(const measurement::Outcome& outcome, const std::string& file) {
  constexpr double kMax_mm = 50;
  OffsetFile offsets;
  for (int number = 0; number <= kMaxTool; ++number) {
    const measurement::Answer* const dx = outcome.Find(fmt::format("tool_{}_dx", number));
    const measurement::Answer* const dy = outcome.Find(fmt::format("tool_{}_dy", number));
    if (dx == nullptr && dy == nullptr) continue;
    if (dx == nullptr || dy == nullptr) {
      return Fail(fmt::format("{}: tool_{} has one of dx and dy alone", file, number));
    }
    const Measured& worse = dx->value.verdict() < dy->value.verdict() ? dy->value : dx->value;
    if (!worse.good()) {
      offsets.refused.push_back(
          fmt::format("tool {}: {}: {}", number, ToString(worse.verdict()), worse.reason()));
      continue;
    }
    const Quantity& x = dx->value.quantity();
    const Quantity& y = dy->value.quantity();
    if (dx->unit != "mm" || dy->unit != "mm" || std::abs(x.value) > kMax_mm ||
        std::abs(y.value) > kMax_mm) {
      return Fail(fmt::format("{}: tool_{}: {} {}, {} {} must be in mm, within +-{}", file, number,
                              x.value, dx->unit, y.value, dy->unit, kMax_mm));
    }
    offsets.good.push_back({number, x.value, y.value, x.interval95, y.interval95});
  }
  if (!offsets.good.empty() || !offsets.refused.empty()) return offsets;
  return Fail(file + ": holds no offsets of tools");
}

}  // namespace

Result<OffsetFile> ReadOffsetFile(const std::filesystem::path& path) {
  auto outcome = TRY(ReadOutcome(path, measurement::Instrument::kToolOffset));
  auto offsets = OffsetsOf(outcome, path.string());
  if (offsets) offsets->result = std::move(outcome);
  return offsets;
}

namespace {

Json Place(const tool_offset::KeptOffset& offset) {
  return {{"x", offset.x_mm}, {"y", offset.y_mm}};
}

tool_offset::KeptOffset ReadPlace(JsonObject& owner, const char* key) {
  const nlohmann::json* place = owner.Find(key);
  if (place == nullptr || !place->is_object()) {
    owner.Fault(key, "must be an object with x and y");
    return {};
  }
  JsonObject reader = owner.Inner(*place, key);
  const tool_offset::KeptOffset offset{reader.Number("x", kKept_mm), reader.Number("y", kKept_mm)};
  if (reader.failed()) owner.Fault(key, "has no x or no y");
  return offset;
}

/// Reads a change; nothing if the line is something else.
std::optional<OffsetChange> ReadChange(const nlohmann::json& json, const std::string& file) {
  JsonObject reader(json, file);
  OffsetChange change;
  const std::string kind = reader.Choice("kind", {"begun", "applied", "kept", "undone"});
  if (!reader.failed()) change.stage = StageOf<OffsetStage>(kind, kOffsetStages);
  change.time = reader.Text("time");
  change.printer = reader.Text("printer");
  change.source = reader.Text("source");
  change.tool = reader.Integer("tool", {0, kMaxTool});
  change.dx_mm = reader.Number("dx_mm", kKept_mm);
  change.dy_mm = reader.Number("dy_mm", kKept_mm);
  change.old_offset = ReadPlace(reader, "old_mm");
  change.new_offset = ReadPlace(reader, "new_mm");
  if (reader.failed()) return std::nullopt;
  return change;
}

}  // namespace

Result<void> AppendToHistory(const fs::path& path, const OffsetChange& change) {
  Json json = {{"format", kFormat}, {"kind", NameOf(change.stage, kOffsetStages)}};
  json["time"] = change.time;
  json["printer"] = change.printer;
  json["source"] = change.source;
  json["tool"] = change.tool;
  json["dx_mm"] = change.dx_mm;
  json["dy_mm"] = change.dy_mm;
  json["old_mm"] = Place(change.old_offset);
  json["new_mm"] = Place(change.new_offset);
  const auto fail = [](const std::string& why) {
    return Fail("the history of offsets cannot be written: " + why + "; --history names another");
  };
  std::error_code code;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), code);
  if (code) return fail(path.string() + ": " + code.message());
  auto added = files::AppendLine(path, json.dump(-1, ' ', false, Json::error_handler_t::replace));
  return added ? added : fail(added.error().message);
}

Result<std::vector<OffsetChange>> ReadOffsetChanges(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code)) return std::vector<OffsetChange>{};
  constexpr std::size_t kMaxBytes = 64'000'000;
  const auto text = TRY(ReadWholeFile(path, kMaxBytes));
  std::vector<OffsetChange> changes;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.size(), text.find('\n', from));
    const auto json = ParseJson(std::string_view(text).substr(from, end - from), path.string());
    from = end + 1;
    if (!json || !json->is_object()) continue;
    const auto format = json->find("format");
    if (format == json->end()) continue;
    if (*format != kFormat) {
      return Fail(
          fmt::format("{}: format {} is not known to this version; --history names another "
                      "file",
                      path.string(), Show(*format)));
    }
    if (auto change = ReadChange(*json, path.string())) changes.push_back(std::move(*change));
  }
  return changes;
}

namespace {

StartedTool ReadTool(JsonObject& owner, const nlohmann::json& json) {
  constexpr int kMaxOnASheet = 31;
  JsonObject reader = owner.Inner(json, "tools");
  StartedTool tool{reader.Integer("tool", {0, kMaxOnASheet})};
  const auto x = reader.OptionalNumber("x_mm", kKept_mm);
  const auto y = reader.OptionalNumber("y_mm", kKept_mm);
  if (x && y) tool.kept = tool_offset::KeptOffset{*x, *y};
  if (const auto done = reader.Finish(); !done) owner.Adopt(done.error());
  return tool;
}

}  // namespace

Result<void> WriteStart(const fs::path& folder, const StartRecord& record) {
  Json json = {{"format", kFormat}, {"stage", NameOf(record.stage, kStartStages)}};
  json["printer"] = record.printer;
  json["run"] = record.run;
  json["started"] = record.started;
  json["printed_s"] = record.printed_s;
  json["tools"] = Json::array();
  for (const StartedTool& tool : record.tools) {
    Json entry = {{"tool", tool.tool}};
    if (tool.kept) {
      entry["x_mm"] = tool.kept->x_mm;
      entry["y_mm"] = tool.kept->y_mm;
    }
    json["tools"].push_back(std::move(entry));
  }
  return WriteWholeFile(folder / kStartFile, JsonText(json), IfThere::kReplace);
}

Result<StartRecord> ReadStart(const fs::path& folder) {
  const fs::path path = folder / kStartFile;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    return Fail(fmt::format("{}: there is no {} in it: it is no folder of trammel offset start",
                            folder.string(), kStartFile));
  }
  constexpr std::size_t kMaxBytes = std::size_t{64} << 10;
  constexpr std::size_t kMaxTools = 32;
  constexpr double kLatest_s = 1e11;  // year 5138
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject object(json, path.string());
  object.Integer("format", {kFormat, kFormat});
  StartRecord record;
  const std::string stage = object.Choice("stage", {"printing", "printed", "analysed"});
  if (!object.failed()) record.stage = StageOf<StartStage>(stage, kStartStages);
  record.printer = object.Text("printer");
  record.run = object.Text("run");
  record.started = object.Text("started");
  record.printed_s = static_cast<std::int64_t>(object.Number("printed_s", {0, kLatest_s}));
  for (const auto& tool : object.List("tools", 2, kMaxTools)) {
    record.tools.push_back(ReadTool(object, tool));
  }
  TRY(object.Finish());
  return record;
}

Result<StartedSheet> ReadStartedSheet(const fs::path& folder) {
  auto record = TRY(ReadStart(folder));
  // Written again after the print: if that failed, its time is the begin's.
  struct stat found {};
  const bool told = ::stat((folder / kStartFile).c_str(), &found) == 0;
  const std::int64_t begun_s = told ? std::int64_t{found.st_mtim.tv_sec} : 0;
  const std::int64_t since_s = record.printed_s > 0 ? record.printed_s : begun_s;
  return StartedSheet{folder, std::move(record), since_s};
}

Result<StartedSheet> LastStart(const fs::path& recordings, const std::string& printer) {
  std::optional<StartedSheet> last;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(recordings, error)) {
    auto sheet = ReadStartedSheet(entry.path());
    if (!sheet || sheet->record.printer != printer) continue;
    if (!last || sheet->since_s > last->since_s) last = std::move(*sheet);
  }
  if (last) return std::move(*last);
  return Fail(fmt::format("{}: no sheet was printed on {} from here{}: print one first",
                          recordings.string(), printer, error ? ", " + error.message() : ""));
}

}  // namespace trammel::files
