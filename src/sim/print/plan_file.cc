#include "sim/print/plan_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

#include "base/bounded_json.h"

namespace trammel::sim {
namespace {

using nlohmann::json;

constexpr double kFarthestMm = 10000;

// What stands in a message for a value, however long or odd it is.
std::string Shown(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() > 40 ? fmt::format("{}...", text.substr(0, 37)) : text;
}

// Collects the first thing that is wrong; every accessor after it returns a harmless value.
class Reader {
 public:
  [[nodiscard]] bool failed() const { return !message_.empty(); }
  [[nodiscard]] const std::string& message() const { return message_; }
  void Reject(std::string message) {
    if (message_.empty()) message_ = std::move(message);
  }

  void CheckKeys(const json& object, const std::string& where,
                 std::initializer_list<const char*> known) {
    for (const auto& [key, value] : object.items()) {
      const bool listed =
          std::any_of(known.begin(), known.end(), [&](const char* name) { return key == name; });
      if (!listed && key.rfind("x_", 0) != 0) {
        Reject(fmt::format("unknown key {}{}", where, Shown(json(key))));
      }
    }
  }

  const json& Member(const json& object, const std::string& where, const char* key) {
    static const json kNothing;
    const auto found = object.find(key);
    if (found != object.end()) return *found;
    Reject(fmt::format("{}\"{}\" is missing", where, key));
    return kNothing;
  }

  double Number(const json& value, const std::string& name, double lo, double hi) {
    if (failed()) return lo;
    if (!value.is_number()) {
      Reject(fmt::format("{} = {}: must be a number", name, Shown(value)));
      return lo;
    }
    const double number = value.get<double>();
    if (std::isfinite(number) && number >= lo && number <= hi) return number;
    Reject(fmt::format("{} = {}: must be within {} ... {}", name, Shown(value), lo, hi));
    return lo;
  }

  double Number(const json& object, const std::string& where, const char* key, double lo,
                double hi) {
    return Number(Member(object, where, key), where + "\"" + key + "\"", lo, hi);
  }

  void Point(const json& object, const std::string& where, const char* key, double& x, double& y) {
    const json& point = Member(object, where, key);
    if (failed()) return;
    if (!point.is_array() || point.size() != 2) {
      Reject(fmt::format("{}\"{}\" = {}: must be [x, y]", where, key, Shown(point)));
      return;
    }
    x = Number(point[0], where + "\"" + key + "\"[0]", -kFarthestMm, kFarthestMm);
    y = Number(point[1], where + "\"" + key + "\"[1]", -kFarthestMm, kFarthestMm);
  }

  /// The list under `key`, or an empty one after a complaint.
  const json& List(const json& object, const char* key, std::size_t limit) {
    static const json kEmpty = json::array();
    const json& list = Member(object, "", key);
    if (failed()) return kEmpty;
    if (!list.is_array() || list.empty() || list.size() > limit) {
      Reject(
          fmt::format("\"{}\" = {}: must be a list of 1 ... {} objects", key, Shown(list), limit));
      return kEmpty;
    }
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].is_object()) continue;
      Reject(fmt::format("\"{}\"[{}] = {}: must be an object", key, i, Shown(list[i])));
      return kEmpty;
    }
    return list;
  }

 private:
  std::string message_;
};

void ReadSegments(Reader& reader, const json& root, Plan& plan) {
  const json& segments = reader.List(root, "segments", 100);
  double sum = 0;
  for (std::size_t i = 0; i < segments.size() && !reader.failed(); ++i) {
    const std::string where = fmt::format("\"segments\"[{}].", i);
    reader.CheckKeys(segments[i], where, {"fraction", "speed_mm_s"});
    const double fraction = reader.Number(segments[i], where, "fraction", 1e-6, 1);
    const double speed_mm_s = reader.Number(segments[i], where, "speed_mm_s", 1e-3, 10000);
    plan.segments.push_back({fraction, speed_mm_s});
    sum += fraction;
  }
  if (std::abs(sum - 1) > 1e-6) {
    reader.Reject(fmt::format("\"segments\": the fractions sum to {}, they must sum to 1", sum));
  }
}

void ReadLines(Reader& reader, const json& root, Plan& plan) {
  const json& lines = reader.List(root, "lines", 100000);
  for (std::size_t i = 0; i < lines.size() && !reader.failed(); ++i) {
    const std::string where = fmt::format("\"lines\"[{}].", i);
    reader.CheckKeys(lines[i], where, {"pattern", "pressure_advance_s", "start_mm", "end_mm"});
    PlannedLine line;
    const double pattern = reader.Number(lines[i], where, "pattern", 0, 100000);
    if (pattern != std::floor(pattern)) {
      reader.Reject(fmt::format("{}\"pattern\" = {}: must be whole", where, pattern));
    }
    line.pattern = static_cast<int>(pattern);
    line.pressure_advance_s = reader.Number(lines[i], where, "pressure_advance_s", 0, 10);
    reader.Point(lines[i], where, "start_mm", line.start_x_mm, line.start_y_mm);
    reader.Point(lines[i], where, "end_mm", line.end_x_mm, line.end_y_mm);
    const double dx = std::abs(line.end_x_mm - line.start_x_mm);
    const double dy = std::abs(line.end_y_mm - line.start_y_mm);
    if (std::min(dx, dy) > 1e-3) {
      reader.Reject(fmt::format("{} runs by {} mm in x and {} mm in y: it must lie along x or y",
                                where.substr(0, where.size() - 1), dx, dy));
    } else if (std::abs(std::max(dx, dy) - plan.line_length_mm) > 1e-3) {
      reader.Reject(fmt::format("{} is {} mm long, \"line_length_mm\" says {}",
                                where.substr(0, where.size() - 1), std::max(dx, dy),
                                plan.line_length_mm));
    }
    plan.lines.push_back(line);
  }
}

}  // namespace

Result<Plan> ParsePlan(std::string_view text) {
  const Result<json> parsed = ParseBoundedJson(text, "the plan");
  if (!parsed) {
    return Fail(parsed.error().message + "; expected a *.plan.json of format 1");
  }
  const json& root = *parsed;
  if (!root.is_object()) return Fail("the plan must be a JSON object, not " + Shown(root));
  Reader reader;
  const json& format = reader.Member(root, "", "format");
  const json& kind = reader.Member(root, "", "kind");
  if (!reader.failed() && kind != "pressure_advance_plan") {
    reader.Reject(fmt::format("\"kind\" = {}: must be \"pressure_advance_plan\"", Shown(kind)));
  }
  if (!reader.failed() && format != 1) {
    reader.Reject(
        fmt::format("\"format\" = {}: this version of trammel reads format 1", Shown(format)));
  }
  reader.CheckKeys(root, "",
                   {"format", "kind", "gcode", "bed_mm", "bed_origin_mm", "layer_height_mm",
                    "line_width_mm", "line_length_mm", "acceleration_mm_s2", "segments", "lines"});
  Plan plan;
  if (!reader.failed()) {
    plan.line_length_mm = reader.Number(root, "", "line_length_mm", 1e-3, 2000);
    plan.acceleration_mm_s2 = reader.Number(root, "", "acceleration_mm_s2", 1e-3, 1e6);
  }
  if (!reader.failed()) ReadSegments(reader, root, plan);
  if (!reader.failed()) ReadLines(reader, root, plan);
  if (reader.failed()) return Fail(reader.message());
  return plan;
}

Result<std::string> ReadTextFile(const std::filesystem::path& path, std::uintmax_t limit_bytes) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return Fail(fmt::format("{}: there is no such file", path.string()));
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > limit_bytes) {
    return Fail(fmt::format("{}: {} bytes; at most {} are read", path.string(), size, limit_bytes));
  }
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file || text.size() > limit_bytes) {
    return Fail(fmt::format("{}: cannot be read; check its permissions", path.string()));
  }
  return text;
}

Result<Plan> ReadPlanFile(const std::filesystem::path& path) {
  Result<Plan> plan = ParsePlan(TRY(ReadTextFile(path, 10'000'000)));
  if (!plan) return Fail(fmt::format("{}: {}", path.string(), plan.error().message));
  return plan;
}

}  // namespace trammel::sim
