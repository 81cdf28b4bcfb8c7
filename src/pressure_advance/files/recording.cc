#include "pressure_advance/files/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <tuple>
#include <vector>

#include "base/check.h"
#include "base/text.h"
#include "files/json_object.h"
#include "files/whole_file.h"
#include "gcode/dialect.h"

namespace trammel::files {
namespace {

using gcode::FormatNumber;
using pressure_advance::SetupResult;

constexpr double kDegree = std::numbers::pi / 180;

std::string Crop(const PixelRect& crop) {
  return fmt::format("[{}, {}, {}, {}]", crop.x, crop.y, crop.width, crop.height);
}

// Rounds to 4 decimals, but to more than 0.
std::string Sigma(double standard_uncertainty) {
  constexpr double kMin = 1e-4;
  return FormatNumber(std::max(kMin, standard_uncertainty), 4);
}

// "95 %: 27.95 to 28.03"
std::string Between(const Measured& measured, double unit, int decimals) {
  const Interval& interval = measured.quantity().interval95;
  return fmt::format("95 %: {} to {}", FormatNumber(interval.lo / unit, decimals),
                     FormatNumber(interval.hi / unit, decimals));
}

// Returns the name of the section that begins in a line; empty: none.
std::string_view SectionOf(std::string_view line) {
  line = Trimmed(line);
  if (line.empty() || line.front() != '[') return {};
  const auto end = line.find(']');
  return end == std::string_view::npos ? line : line.substr(0, end + 1);
}

bool Sets(std::string_view line, const CameraKeys& keys) {
  line = Trimmed(line);
  const auto equals = line.find('=');
  if (equals == std::string_view::npos) return false;
  const std::string_view key = Trimmed(line.substr(0, equals));
  return std::ranges::any_of(keys, [key](const auto& entry) { return entry.first == key; });
}

std::vector<std::string_view> Lines(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const auto end = text.find('\n');
    lines.push_back(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  }
  return lines;
}

}  // namespace

CameraKeys CameraKeysOf(const SetupResult& result, double focus_height_mm) {
  CameraKeys keys;
  keys.emplace_back("offset_x", FormatNumber(result.offset.x_mm.quantity().value, 3));
  keys.emplace_back("offset_y", FormatNumber(result.offset.y_mm.quantity().value, 3));
  keys.emplace_back("focus_height", FormatNumber(focus_height_mm, 2));
  if (result.crop) keys.emplace_back("crop", Crop(*result.crop));
  const Quantity& scale = result.scale.px_per_mm.quantity();
  const Quantity& angle_rad = result.scan_angle_rad.quantity();
  keys.emplace_back("px_per_mm", FormatNumber(scale.value, 3));
  keys.emplace_back("px_per_mm_sigma", Sigma(scale.standard_uncertainty));
  keys.emplace_back("laser_angle", FormatNumber(angle_rad.value / kDegree, 2));
  keys.emplace_back("laser_angle_sigma", Sigma(angle_rad.standard_uncertainty / kDegree));
  keys.emplace_back("height_direction", fmt::format("\"{}\"", ToString(result.height_direction)));
  return keys;
}

std::string FormatCameraSection(const SetupResult& result, double focus_height_mm) {
  std::string text = "# Measured by trammel pa setup.\n[camera]\n";
  for (const auto& [key, value] : CameraKeysOf(result, focus_height_mm)) {
    std::string note;
    if (key == "offset_x") note = Between(result.offset.x_mm, 1, 3) + " mm";
    if (key == "offset_y") note = Between(result.offset.y_mm, 1, 3) + " mm";
    if (key == "focus_height") note = Between(result.focus_mm, 1, 2) + " mm is sharpest";
    if (key == "px_per_mm") note = Between(result.scale.px_per_mm, 1, 3);
    if (key == "laser_angle") note = Between(result.scan_angle_rad, kDegree, 2) + " degrees";
    text += fmt::format("{} = {}{}{}\n", key, value, note.empty() ? "" : "  # ", note);
  }
  return text;
}

std::string PutCameraKeys(std::string_view text, const CameraKeys& keys) {
  std::string ours;
  for (const auto& [key, value] : keys) ours += fmt::format("{} = {}\n", key, value);
  std::string out;
  bool inside = false, put = false, in_list = false;
  for (const std::string_view line : Lines(text)) {
    if (in_list) {  // the rest of a list over several lines
      out += fmt::format("# before pa setup: {}\n", Trimmed(line));
      in_list = line.find(']') == std::string_view::npos;
      continue;
    }
    if (const std::string_view section = SectionOf(line); !section.empty()) {
      inside = section == "[camera]";
      out += fmt::format("{}\n", line);
      if (inside && !put) {
        out += ours;
        put = true;
      }
      continue;
    }
    if (!inside || !Sets(line, keys)) {
      out += fmt::format("{}\n", line);
      continue;
    }
    out += fmt::format("# before pa setup: {}\n", Trimmed(line));
    in_list = line.find('[') != std::string_view::npos && line.find(']') == std::string_view::npos;
  }
  if (!put) out += fmt::format("{}[camera]\n{}", out.empty() ? "" : "\n", ours);
  return out;
}

namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using pressure_advance::Scan;
using pressure_advance::ScanLine;
using pressure_advance::Segment;

/// Maximum file size: a thousand lines with six thousand capture times each are smaller.
constexpr std::size_t kMaxBytes = std::size_t{128} << 20;

// Validate(Scan) checks ranges, also for scans from other sources; types and keys are checked here.

std::optional<AxisDirection> Direction(JsonObject& object, const char* key) {
  const auto text = object.OptionalChoice(key, {"+x", "-x", "+y", "-y"});
  return text ? ParseAxisDirection(*text) : std::nullopt;
}

/// Returns why a video's name must not be used; empty if it may.
std::string VideoNameFault(const std::string& name) {
  if (name.empty() || name.size() > 255 || name.find('\0') != std::string::npos) {
    return "it must be a file name of 1 … 255 characters";
  }
  const std::filesystem::path path(name);
  if (path.is_absolute() || name.find('\\') != std::string::npos) {
    return "it must be a file name inside the recording's folder, not an absolute path";
  }
  for (const auto& part : path) {
    if (part == "..") {
      return "it must be a file name inside the recording's folder, without '..'";
    }
  }
  return {};
}

Result<ScanLine> ReadLine(JsonObject object) {
  constexpr std::size_t kMaxFrames = 10'000'000;
  constexpr double kLongest_s = 1e6;
  ScanLine line;
  if (object.Find("pattern") != nullptr) line.pattern = object.Integer("pattern", {0, 9999});
  line.pressure_advance_s = object.Number("pressure_advance_s");
  line.video = object.Text("video");
  if (const std::string wrong = VideoNameFault(line.video); !object.failed() && !wrong.empty()) {
    object.Fault("video", fmt::format("is {}; {}", Show(json(line.video)), wrong));
  }
  line.print_direction = Direction(object, "print_direction");
  line.sweep_direction = Direction(object, "sweep_direction");
  if (object.Find("frame_times_s") != nullptr) {
    line.frame_times_s = object.Numbers("frame_times_s", 1, kMaxFrames);
  }
  line.frame_positions_mm = object.OptionalNumbers("frame_positions_mm", 2, kMaxFrames);
  line.late_s = object.Number("late_s", {0, kLongest_s}, 0);
  if (object.Find("lost_frames") != nullptr) {
    line.lost_frames =
        static_cast<std::size_t>(object.Integer("lost_frames", {0, double{kMaxFrames}}));
  }
  TRY(object.Finish());
  return line;
}

Result<Segment> ReadSegment(JsonObject object) {
  const Segment segment{object.Number("fraction"), object.Number("speed_mm_s")};
  TRY(object.Finish());
  return segment;
}

Result<PixelRect> ReadCrop(JsonObject object) {
  constexpr NumberRange kPixel{-1e6, 1e6};
  const PixelRect crop{object.Integer("x", kPixel), object.Integer("y", kPixel),
                       object.Integer("width", kPixel), object.Integer("height", kPixel)};
  TRY(object.Finish());
  return crop;
}

/// Objects within a scan that are still to be read.
struct ScanParts {
  const json* lines = nullptr;
  const json* segments = nullptr;  ///< or nullptr
  const json* crop = nullptr;      ///< or nullptr
  const json* found = nullptr;     ///< or nullptr
};

/// Reads everything except the inner objects.
Result<ScanParts> ReadHead(JsonObject& object, Scan& scan) {
  const double format = object.Number("format");
  if (!object.failed() && format != 1) {
    object.Fault("format", fmt::format("is {}; this trammel reads format 1", format));
  }
  (void)object.Choice("eye", {"laser"});
  ScanParts parts;
  parts.lines = &object.List("lines", 1, 1000);
  scan.frames_per_s = object.Number("frames_per_s", {}, 30);
  scan.scan_speed_mm_s = object.Number("scan_speed_mm_s");
  scan.px_per_mm = object.OptionalNumber("px_per_mm");
  scan.px_per_mm_sigma = object.OptionalNumber("px_per_mm_sigma");
  scan.laser_angle_rad = object.Number("laser_angle_deg", {}, 45) * std::numbers::pi / 180;
  if (const auto sigma_deg = object.OptionalNumber("laser_angle_sigma_deg")) {
    scan.laser_angle_sigma_rad = *sigma_deg * std::numbers::pi / 180;
  }
  scan.height_direction = Direction(object, "height_direction").value_or(AxisDirection::kMinusX);
  parts.crop = object.Find("crop_px");
  parts.found = object.Find("found_crop_px");
  scan.commanded_area_mm2 = object.OptionalNumber("commanded_area_mm2");
  scan.opaque_plate = object.OptionalChoice("plate", {"opaque"}).has_value();
  scan.line_start_mm = object.Number("line_start_mm", {}, 4);
  scan.motion.length_mm = object.Number("line_length_mm", {}, 30);
  scan.motion.acceleration_mm_s2 = object.Number("acceleration_mm_s2", {}, 3000);
  parts.segments = object.OptionalList("segments", 1, 100);
  TRY(object.Finish());
  return parts;
}

Result<Scan> ReadObject(JsonObject object) {
  Scan scan;
  const Result<ScanParts> parts = ReadHead(object, scan);
  if (!parts) return tl::unexpected(parts.error());
  for (const auto& [key, value, crop] : {std::tuple("crop_px", parts->crop, &scan.crop),
                                         {"found_crop_px", parts->found, &scan.found_crop}}) {
    if (value == nullptr) continue;
    const auto read = TRY(ReadCrop(object.Inner(*value, key)));
    *crop = read;
  }
  if (parts->segments == nullptr) scan.motion.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
  for (std::size_t i = 0; parts->segments != nullptr && i < parts->segments->size(); ++i) {
    auto segment =
        TRY(ReadSegment(object.Inner((*parts->segments)[i], fmt::format("segments[{}]", i))));
    scan.motion.segments.push_back(segment);
  }
  for (std::size_t i = 0; i < parts->lines->size(); ++i) {
    auto line = TRY(ReadLine(object.Inner((*parts->lines)[i], fmt::format("lines[{}]", i))));
    scan.lines.push_back(std::move(line));
  }
  return scan;
}

ordered_json FormatLine(const ScanLine& line) {
  ordered_json entry{{"pressure_advance_s", line.pressure_advance_s}, {"video", line.video}};
  if (line.pattern != 0) entry["pattern"] = line.pattern;
  if (line.print_direction) entry["print_direction"] = ToString(*line.print_direction);
  if (line.sweep_direction) entry["sweep_direction"] = ToString(*line.sweep_direction);
  if (!line.frame_times_s.empty()) entry["frame_times_s"] = line.frame_times_s;
  if (line.late_s > 0) entry["late_s"] = line.late_s;
  if (line.lost_frames > 0) entry["lost_frames"] = line.lost_frames;
  if (!line.frame_positions_mm.empty()) {
    ordered_json& positions = entry["frame_positions_mm"] = ordered_json::array();
    for (const auto& position : line.frame_positions_mm) {
      positions.push_back(position ? ordered_json(*position) : ordered_json(nullptr));
    }
  }
  return entry;
}

/// Returns degrees without the rounding errors of the conversion through radians.
double Degrees(double angle_rad) {
  constexpr double kSteps = 1e9;
  return std::round(angle_rad * 180 / std::numbers::pi * kSteps) / kSteps;
}

ordered_json FormatCrop(const PixelRect& crop) {
  return {{"x", crop.x}, {"y", crop.y}, {"width", crop.width}, {"height", crop.height}};
}

ordered_json FormatHead(const Scan& scan) {
  ordered_json head{{"format", 1},
                    {"eye", "laser"},
                    {"frames_per_s", scan.frames_per_s},
                    {"scan_speed_mm_s", scan.scan_speed_mm_s}};
  if (scan.px_per_mm) head["px_per_mm"] = *scan.px_per_mm;
  if (scan.px_per_mm_sigma) head["px_per_mm_sigma"] = *scan.px_per_mm_sigma;
  head["laser_angle_deg"] = Degrees(scan.laser_angle_rad);
  if (scan.laser_angle_sigma_rad) {
    head["laser_angle_sigma_deg"] = Degrees(*scan.laser_angle_sigma_rad);
  }
  head["height_direction"] = ToString(scan.height_direction);
  if (scan.crop) head["crop_px"] = FormatCrop(*scan.crop);
  if (scan.found_crop) head["found_crop_px"] = FormatCrop(*scan.found_crop);
  if (scan.commanded_area_mm2) head["commanded_area_mm2"] = *scan.commanded_area_mm2;
  if (scan.opaque_plate) head["plate"] = "opaque";
  head["line_start_mm"] = scan.line_start_mm;
  head["line_length_mm"] = scan.motion.length_mm.value_or(30);
  ordered_json& segments = head["segments"] = ordered_json::array();
  for (const Segment& segment : scan.motion.segments) {
    segments.push_back({{"fraction", segment.fraction}, {"speed_mm_s", segment.speed_mm_s}});
  }
  head["acceleration_mm_s2"] = scan.motion.acceleration_mm_s2.value_or(3000);
  return head;
}

}  // namespace

std::string FormatScan(const Scan& scan, const json& extra) {
  ordered_json head = FormatHead(scan);
  for (const auto& [key, value] : extra.items()) {
    TRAMMEL_CHECK(key.starts_with("x_"), "'{}' is no key of one's own", key);
    head[key] = value;
  }
  // Writes one line of text per printed line, so that long lists do not disturb a reader.
  constexpr auto kReplace = ordered_json::error_handler_t::replace;
  std::string text = "{\n";
  for (const auto& [key, value] : head.items()) {
    text +=
        fmt::format("  {}: {},\n", json(key).dump(-1, ' ', false, json::error_handler_t::replace),
                    value.dump(-1, ' ', false, kReplace));
  }
  text += "  \"lines\": [";
  for (std::size_t i = 0; i < scan.lines.size(); ++i) {
    text += fmt::format("{}\n    {}", i == 0 ? "" : ",",
                        FormatLine(scan.lines[i]).dump(-1, ' ', false, kReplace));
  }
  return text + "\n  ]\n}\n";
}

Result<Scan> ParseScan(const std::string& text, const std::string& name) {
  const json root = TRY(ParseJson(text, name));
  Result<Scan> scan = ReadObject(JsonObject(root, name));
  if (!scan) return scan;
  if (const auto valid = Validate(*scan); !valid) {
    return Fail(fmt::format("{}: {}", name, valid.error().message));
  }
  return scan;
}

Result<Scan> ReadScan(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "scan.json";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return Fail(
        fmt::format("'{}' is not a folder; name the folder of a recording, with scan.json "
                    "and its videos",
                    folder.string()));
  }
  if (!std::filesystem::is_regular_file(file, error)) {
    if (auto unplaced = UnplacedRecording(folder)) return tl::unexpected(*unplaced);
    return Fail(fmt::format(
        "'{}' has no scan.json; docs/reference/formats.md says what a recording must hold",
        folder.string()));
  }
  const std::string text = TRY(ReadNamedFile(file, kMaxBytes));
  return ParseScan(text, file.string());
}

namespace {

using nlohmann::json;

constexpr std::size_t kMaxBytesOfTimes = std::size_t{256} << 20;

// Counts a video's frames by the lines of its times; 0 if they cannot be read.
std::size_t FramesOf(const std::filesystem::path& video) {
  const auto text = ReadNamedFile(video.string() + ".times", kMaxBytesOfTimes);
  if (!text) return 0;
  std::size_t frames = 0;
  for (std::size_t begin = 0; begin < text->size();) {
    const std::size_t end = text->find('\n', begin);
    if (end == std::string::npos) break;
    const char first = (*text)[begin];
    frames += first >= '0' && first <= '9';
    begin = end + 1;
  }
  return frames;
}

// Returns the reason stored with the last sweep that could not be placed.
std::string Reason(const json& root) {
  const auto list = root.find("not_placed");
  if (list == root.end() || !list->is_array() || list->empty()) return {};
  const json& last = list->back();
  const auto text = [&](const char* key) {
    const auto found = last.is_object() ? last.find(key) : last.end();
    return last.is_object() && found != last.end() && found->is_string() ? found->get<std::string>()
                                                                         : std::string();
  };
  return text("why").empty() ? "" : text("video") + ": " + text("why");
}

}  // namespace

std::optional<Error> UnplacedRecording(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "sweeps.json";
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  const auto text = ReadNamedFile(file, kMaxBytesOfTimes);
  if (!text) return text.error();
  const auto root = ParseJson(*text, file.string());
  if (!root) return root.error();
  const auto sweeps = root->is_object() ? root->find("sweeps") : root->end();
  if (!root->is_object() || sweeps == root->end() || !sweeps->is_array()) {
    return Error{ErrorKind::kInput, file.string() + ": has no list of sweeps"};
  }
  const std::size_t frames = FramesOf(folder / "line0.avi");
  if (sweeps->empty()) {
    return Error{
        ErrorKind::kMeasurement,
        fmt::format(
            "'{}' holds a scan that ended in its first sweep: {}, and the motion of "
            "no line, without which no frame has a place. Nothing can be measured "
            "from it; scan the pattern again",
            folder.string(),
            frames == 0 ? std::string("no frame") : fmt::format("{} frames in line0.avi", frames))};
  }
  const std::string why = Reason(*root);
  return Error{
      ErrorKind::kMeasurement,
      fmt::format("'{}' holds {} sweeps whose frames could not be tied to the motion{}{}. "
                  "Videos, times and motion (sweeps.json) are kept; scan the pattern again",
                  folder.string(), sweeps->size(), why.empty() ? "" : ": ", why)};
}

}  // namespace trammel::files
