#include "tool_offset/files/start_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <array>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "base/json_text.h"
#include "files/json_object.h"
#include "files/new_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
constexpr std::size_t kMostBytes = std::size_t{64} << 10;
constexpr std::size_t kMostTools = 32;
constexpr int kMostTool = 31;
constexpr double kMost_mm = 1000;
constexpr double kLatest_s = 1e11;  // in the year 5138

constexpr std::array<std::pair<StartStage, const char*>, 3> kStages{
    {{StartStage::kPrinting, "printing"},
     {StartStage::kPrinted, "printed"},
     {StartStage::kAnalysed, "analysed"}}};

StartedTool ReadTool(JsonObject& owner, const nlohmann::json& json) {
  JsonObject reader = owner.Inner(json, "tools");
  StartedTool tool{reader.Integer("tool", {0, kMostTool})};
  const NumberRange range{-kMost_mm, kMost_mm};
  const auto x = reader.OptionalNumber("x_mm", range);
  const auto y = reader.OptionalNumber("y_mm", range);
  if (x && y) tool.kept = tool_offset::KeptOffset{*x, *y};
  if (const auto done = reader.Finish(); !done) owner.Adopt(done.error());
  return tool;
}

}  // namespace

Result<void> WriteStart(const fs::path& folder, const StartRecord& record) {
  Json json = {{"format", kFormat}};
  for (const auto& [stage, name] : kStages) {
    if (record.stage == stage) json["stage"] = name;
  }
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
  const auto json = TRY(ReadJsonFile(path, kMostBytes));
  JsonObject object(json, path.string());
  object.Integer("format", {kFormat, kFormat});
  StartRecord record;
  const std::string stage = object.Choice("stage", {"printing", "printed", "analysed"});
  for (const auto& [value, name] : kStages) {
    if (stage == name) record.stage = value;
  }
  record.printer = object.Text("printer");
  record.run = object.Text("run");
  record.started = object.Text("started");
  record.printed_s = static_cast<std::int64_t>(object.Number("printed_s", {0, kLatest_s}));
  for (const auto& tool : object.List("tools", 2, kMostTools)) {
    record.tools.push_back(ReadTool(object, tool));
  }
  TRY(object.Finish());
  return record;
}

Result<StartedSheet> ReadStartedSheet(const fs::path& folder) {
  auto record = TRY(ReadStart(folder));
  // Written once more when the print has ended: where that failed, its time is the begin's.
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
