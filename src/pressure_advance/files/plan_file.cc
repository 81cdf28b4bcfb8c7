#include "pressure_advance/files/plan_file.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "files/json_object.h"
#include "files/new_file.h"
#include "gcode/dialect.h"
#include "measurement/applied.h"

namespace trammel::files {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using pressure_advance::PatternPlan;
using pressure_advance::PlanLine;
using pressure_advance::Segment;

constexpr int kFormat = 1;
constexpr const char* kKind = "pressure_advance_plan";
constexpr NumberRange kCoordinate_mm{-10000, 10000};
constexpr double kSlack_mm = 0.001;  // positions are written to 1 um

Result<Segment> ParseSegment(JsonObject object) {
  Segment segment;
  segment.fraction = object.Number("fraction", {1e-6, 1});
  segment.speed_mm_s = object.Number("speed_mm_s", {0.01, 10000});
  TRY(object.Finish());
  return segment;
}

Result<PlanLine> ParseLine(JsonObject object, const PatternPlan& plan) {
  PlanLine line;
  line.pattern = object.Integer("pattern", {0, 9999});
  line.pressure_advance_s = object.Number("pressure_advance_s", {0, 10});
  const auto point = [&](const char* key, double& x_mm, double& y_mm) {
    const std::vector<double> xy = object.Numbers(key, 2, 2, kCoordinate_mm);
    if (xy.size() != 2) return;
    x_mm = xy[0];
    y_mm = xy[1];
    const double beyond_mm = std::max({plan.bed_origin_x_mm - x_mm, plan.bed_origin_y_mm - y_mm,
                                       x_mm - plan.bed_origin_x_mm - plan.bed_size_x_mm,
                                       y_mm - plan.bed_origin_y_mm - plan.bed_size_y_mm});
    if (beyond_mm > kSlack_mm) {
      object.Fault(key, fmt::format("is ({}, {}), off the bed of {} x {} mm at ({}, {})", x_mm,
                                    y_mm, plan.bed_size_x_mm, plan.bed_size_y_mm,
                                    plan.bed_origin_x_mm, plan.bed_origin_y_mm));
    }
  };
  point("start_mm", line.start_x_mm, line.start_y_mm);
  point("end_mm", line.end_x_mm, line.end_y_mm);
  const double length_mm =
      std::hypot(line.end_x_mm - line.start_x_mm, line.end_y_mm - line.start_y_mm);
  if (std::abs(length_mm - plan.line_length_mm) > 2 * kSlack_mm) {
    object.Fault("end_mm", fmt::format("lies {:.3f} mm from start_mm, but line_length_mm is {}",
                                       length_mm, plan.line_length_mm));
  }
  TRY(object.Finish());
  return line;
}

std::vector<std::string_view> FirmwareNames() {
  std::vector<std::string_view> names;
  for (const gcode::FirmwareWords& firmware : gcode::Firmwares()) names.push_back(firmware.name);
  return names;
}

/// Parses all keys but the lists of objects; unknown keys are checked later, with those lists.
void ParseHead(JsonObject& object, PatternPlan& plan) {
  const int format = object.Integer("format", {0, 1e6});
  if (!object.failed() && format != kFormat) {
    object.Fault("format", fmt::format("is {}; this trammel reads format {}", format, kFormat));
  }
  (void)object.Choice("kind", {kKind});
  plan.gcode = object.Text("gcode");
  if (!object.failed() && std::filesystem::path(plan.gcode).filename() != plan.gcode) {
    object.Fault("gcode", fmt::format("is {}; it must be a file name without a folder",
                                      Show(json(plan.gcode))));
  }
  if (const auto size = object.Numbers("bed_mm", 2, 2, {1, 10000}); size.size() == 2) {
    plan.bed_size_x_mm = size[0];
    plan.bed_size_y_mm = size[1];
  }
  if (object.has("bed_origin_mm")) {
    const auto origin = object.Numbers("bed_origin_mm", 2, 2, kCoordinate_mm);
    if (origin.size() == 2) {
      plan.bed_origin_x_mm = origin[0];
      plan.bed_origin_y_mm = origin[1];
    }
  }
  plan.layer_height_mm = object.Number("layer_height_mm", {0.001, 10});
  plan.line_width_mm = object.Number("line_width_mm", {0.001, 100});
  plan.line_length_mm = object.Number("line_length_mm", {0.001, 10000});
  plan.acceleration_mm_s2 = object.Number("acceleration_mm_s2", {0.001, 1e6});
  if (object.has("corner_mark"))
    plan.corner_mark = object.Choice("corner_mark", {"printed"}) == "printed";
  if (object.has("firmware")) {
    plan.printed_by.dialect = gcode::ParseDialect(object.Choice("firmware", FirmwareNames()))
                                  .value_or(gcode::Dialect::kKlipper);
  }
  if (object.has("extruder_drive")) {
    plan.printed_by.drive = object.Integer("extruder_drive", {0, 31});
  }
}

}  // namespace

std::string FormatPlan(const PatternPlan& plan) {
  // Sums such as 109.085 + 4 have meaningless last digits.
  const auto rounded = [](double value_mm) { return std::round(value_mm * 1000) / 1000; };
  ordered_json segments = ordered_json::array();
  for (const Segment& segment : plan.segments) {
    segments.push_back({{"fraction", segment.fraction}, {"speed_mm_s", segment.speed_mm_s}});
  }
  ordered_json head{{"format", kFormat},
                    {"kind", kKind},
                    {"gcode", plan.gcode},
                    {"bed_mm", {plan.bed_size_x_mm, plan.bed_size_y_mm}},
                    {"bed_origin_mm", {plan.bed_origin_x_mm, plan.bed_origin_y_mm}},
                    {"layer_height_mm", plan.layer_height_mm},
                    {"line_width_mm", plan.line_width_mm},
                    {"line_length_mm", plan.line_length_mm},
                    {"acceleration_mm_s2", plan.acceleration_mm_s2}};
  if (plan.corner_mark) head["corner_mark"] = "printed";
  if (plan.printed_by.dialect != gcode::Dialect::kKlipper) {
    head["firmware"] = ToString(plan.printed_by.dialect);
  }
  if (plan.printed_by.drive != 0) head["extruder_drive"] = plan.printed_by.drive;
  head["segments"] = std::move(segments);
  // Writes one key and one printed line per line of text, so that people can read and compare it.
  std::string out = "{";
  for (const auto& [key, value] : head.items()) {
    out += fmt::format("{} \"{}\": {},\n", out.size() == 1 ? "" : " ", key,
                       // a file name may contain any bytes
                       value.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
  }
  out += "  \"lines\": [";
  for (const PlanLine& line : plan.lines) {
    const ordered_json entry{{"pattern", line.pattern},
                             {"pressure_advance_s", line.pressure_advance_s},
                             {"start_mm", {rounded(line.start_x_mm), rounded(line.start_y_mm)}},
                             {"end_mm", {rounded(line.end_x_mm), rounded(line.end_y_mm)}}};
    out += (out.back() == '[' ? "\n    " : ",\n    ") +
           entry.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  return out + "]}\n";
}

Result<PatternPlan> ParsePlan(std::string_view text, const std::string& file) {
  const json root = TRY(ParseJson(text, file));
  PatternPlan plan;
  JsonObject object(root, file);
  ParseHead(object, plan);
  const json& segments = object.List("segments", 1, 1000);
  const json& lines = object.List("lines", 1, 100000);
  TRY(object.Finish());
  double sum = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    auto segment = TRY(ParseSegment(object.Inner(segments[i], fmt::format("segments[{}]", i))));
    sum += segment.fraction;
    plan.segments.push_back(segment);
  }
  constexpr double kFractionTolerance = 1e-6;
  if (std::abs(sum - 1) > kFractionTolerance) {
    return Fail(
        fmt::format("{}: the fractions of segments sum to {}; they must sum to 1", file, sum));
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    auto line = TRY(ParseLine(object.Inner(lines[i], fmt::format("lines[{}]", i)), plan));
    plan.lines.push_back(line);
  }
  return plan;
}

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
