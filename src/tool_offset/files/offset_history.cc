#include "tool_offset/files/offset_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "files/json_object.h"
#include "files/new_file.h"
#include "files/whole_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
constexpr std::size_t kMostBytes = 64'000'000;
constexpr double kMost_mm = 1000;
constexpr int kMostTool = 99;

constexpr std::array<std::pair<OffsetStage, const char*>, 4> kStages{
    {{OffsetStage::kBegun, "begun"},
     {OffsetStage::kApplied, "applied"},
     {OffsetStage::kKept, "kept"},
     {OffsetStage::kUndone, "undone"}}};

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
  const NumberRange range{-kMost_mm, kMost_mm};
  const tool_offset::KeptOffset offset{reader.Number("x", range), reader.Number("y", range)};
  if (reader.failed()) owner.Fault(key, "has no x or no y");
  return offset;
}

/// Nothing where the line is something else.
std::optional<OffsetChange> ReadChange(const nlohmann::json& json, const std::string& file) {
  JsonObject reader(json, file);
  OffsetChange change;
  const std::string kind = reader.Choice("kind", {"begun", "applied", "kept", "undone"});
  for (const auto& [stage, name] : kStages) {
    if (kind == name) change.stage = stage;
  }
  change.time = reader.Text("time");
  change.printer = reader.Text("printer");
  change.source = reader.Text("source");
  change.tool = reader.Integer("tool", {0, kMostTool});
  const NumberRange range{-kMost_mm, kMost_mm};
  change.dx_mm = reader.Number("dx_mm", range);
  change.dy_mm = reader.Number("dy_mm", range);
  change.old_offset = ReadPlace(reader, "old_mm");
  change.new_offset = ReadPlace(reader, "new_mm");
  if (reader.failed()) return std::nullopt;
  return change;
}

}  // namespace

Result<void> AppendToHistory(const fs::path& path, const OffsetChange& change) {
  Json json = {{"format", kFormat}};
  for (const auto& [stage, name] : kStages) {
    if (change.stage == stage) json["kind"] = name;
  }
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
  const auto text = TRY(ReadWholeFile(path, kMostBytes));
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

}  // namespace trammel::files
