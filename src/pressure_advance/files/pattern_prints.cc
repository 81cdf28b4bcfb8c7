#include "pressure_advance/files/pattern_prints.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/applied.h"

namespace trammel::files {
namespace {

constexpr const char* kBegun = "begun";
constexpr const char* kEnded = "ended";
constexpr const char* kPhoto = "photo";
constexpr const char* kScan = "scan";

std::optional<PatternPrint> ParseLine(std::string_view line) {
  const auto json = ParseJson(line, "");
  if (!json || !json->is_object()) return std::nullopt;
  JsonObject object(*json, "");
  PatternPrint print;
  print.utc = object.Text("utc");
  print.printer = object.Text("printer");
  print.folder = object.Text("folder");
  const std::string step = object.Choice("step", {kBegun, kEnded});
  print.ended = step == kEnded;
  print.for_photo = object.OptionalChoice("for", {kPhoto, kScan}) != kScan;
  if (object.failed()) return std::nullopt;
  if (const auto* const name = object.Find("filament"); name != nullptr && name->is_string()) {
    print.filament = name->get<std::string>();
  }
  if (const auto* const time = object.Find("server_s"); time != nullptr && time->is_number()) {
    const double time_s = time->get<double>();
    if (std::isfinite(time_s)) print.server_s = time_s;
  }
  return print;
}

}  // namespace

Result<void> NotePatternPrint(const std::filesystem::path& path, const PatternPrint& print) {
  nlohmann::ordered_json json = {{"utc", print.utc},
                                 {"printer", print.printer},
                                 {"folder", print.folder},
                                 {"step", print.ended ? kEnded : kBegun},
                                 {"for", print.for_photo ? kPhoto : kScan}};
  if (!print.filament.empty()) json["filament"] = print.filament;
  if (print.server_s) json["server_s"] = *print.server_s;
  return AppendLine(path, json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

Result<std::map<std::string, PatternPrint>> LastPatternPrints(const std::filesystem::path& path,
                                                              PrintsFor which) {
  std::map<std::string, PatternPrint> last;
  std::error_code ignored;
  if (!std::filesystem::exists(std::filesystem::symlink_status(path, ignored))) return last;
  const auto read = ForEachLine(path, [&](std::string_view line) {
    auto print = ParseLine(line);
    if (!print || (which == PrintsFor::kPhoto && !print->for_photo)) return;
    last[print->printer] = std::move(*print);
  });
  if (!read) return tl::unexpected(read.error());
  return last;
}

Result<std::optional<PatternPrint>> LastPatternPrint(const std::filesystem::path& path,
                                                     std::string_view printer, PrintsFor which) {
  const auto last = TRY(LastPatternPrints(path, which));
  const auto found = last.find(std::string(printer));
  return found == last.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace trammel::files
