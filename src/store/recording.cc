#include "store/recording.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

namespace trammel::store {
namespace {

using Json = nlohmann::json;
using pressure_advance::AxisDirection;
using pressure_advance::Scan;
using pressure_advance::ScanLine;
using pressure_advance::Segment;

/// A thousand lines with ten thousand capture times each stay below this.
constexpr std::uintmax_t kMaxBytes = std::uintmax_t{256} << 20;

/// A value as it stands in the file, cut to a length that fits into a message.
std::string Show(const Json& value) {
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > 60) {
    text = text.substr(0, 57) + "...";
  }
  return text;
}

/// Reads typed values out of one JSON object and keeps the first thing that is wrong.
class Section {
 public:
  Section(const Json& object, std::string path, std::string& fault)
      : object_(object), path_(std::move(path)), fault_(fault) {
    if (!object.is_object()) {
      Say(fmt::format("{} is {}; it must be an object",
                      path_.empty() ? "the file's content" : path_, Show(object)));
    }
  }

  [[nodiscard]] std::string At(std::string_view key) const {
    return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
  }
  void Say(const std::string& text) {
    if (fault_.empty()) {
      fault_ = text;
    }
  }
  /// The value of a key, or nullptr; absent required keys are a fault.
  const Json* Find(std::string_view key, bool required) {
    if (!object_.is_object()) {
      return nullptr;
    }
    const auto found = object_.find(key);
    if (found != object_.end()) {
      return &*found;
    }
    if (required) {
      Say(fmt::format("{} is missing", At(key)));
    }
    return nullptr;
  }
  std::optional<double> Number(std::string_view key, bool required = false) {
    const Json* value = Find(key, required);
    if (value == nullptr) {
      return std::nullopt;
    }
    return AsNumber(*value, At(key));
  }
  std::optional<double> AsNumber(const Json& value, const std::string& at) {
    if (!value.is_number() || !std::isfinite(value.get<double>())) {
      Say(fmt::format("{} is {}; it must be a finite number", at, Show(value)));
      return std::nullopt;
    }
    return value.get<double>();
  }
  std::optional<int> Whole(std::string_view key) {
    const auto number = Number(key, true);
    if (!number) {
      return std::nullopt;
    }
    if (*number != std::floor(*number) || std::abs(*number) > 1e6) {
      Say(fmt::format("{} is {}; it must be a whole number of at most 1000000", At(key), *number));
      return std::nullopt;
    }
    return static_cast<int>(*number);
  }
  std::optional<std::string> Text(std::string_view key, bool required = false) {
    const Json* value = Find(key, required);
    if (value == nullptr) {
      return std::nullopt;
    }
    if (!value->is_string()) {
      Say(fmt::format("{} is {}; it must be text", At(key), Show(*value)));
      return std::nullopt;
    }
    return value->get<std::string>();
  }
  std::optional<AxisDirection> Direction(std::string_view key) {
    const auto text = Text(key);
    if (!text) {
      return std::nullopt;
    }
    if (*text == "+x") return AxisDirection::kPlusX;
    if (*text == "-x") return AxisDirection::kMinusX;
    if (*text == "+y") return AxisDirection::kPlusY;
    if (*text == "-y") return AxisDirection::kMinusY;
    Say(fmt::format(R"({} is {}; it must be "+x", "-x", "+y" or "-y")", At(key), Show(*text)));
    return std::nullopt;
  }
  /// A list, or nullptr.
  const Json* List(std::string_view key, bool required = false) {
    const Json* value = Find(key, required);
    if (value != nullptr && !value->is_array()) {
      Say(fmt::format("{} is {}; it must be a list", At(key), Show(*value)));
      return nullptr;
    }
    return value;
  }
  /// Every key must be one of these or begin with x_.
  void Only(std::initializer_list<std::string_view> keys) {
    if (!object_.is_object()) {
      return;
    }
    for (const auto& item : object_.items()) {
      const std::string& key = item.key();
      if (key.starts_with("x_")) {
        continue;
      }
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
        Say(fmt::format("{} is not a known key (known: {}; keys of your own begin with x_)",
                        At(Show(key)), fmt::join(keys, ", ")));
      }
    }
  }

 private:
  const Json& object_;
  std::string path_;
  std::string& fault_;
};

/// Why a video's name must not be used; empty where it may be.
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

ScanLine ReadLine(const Json& json, std::size_t index, std::string& fault) {
  Section section(json, fmt::format("lines[{}]", index), fault);
  section.Only(
      {"pressure_advance_s", "video", "print_direction", "sweep_direction", "frame_times_s"});
  ScanLine line;
  line.pressure_advance_s = section.Number("pressure_advance_s", true).value_or(0);
  if (const auto video = section.Text("video", true)) {
    line.video = *video;
    if (const std::string wrong = VideoNameFault(line.video); !wrong.empty()) {
      section.Say(fmt::format("{} is {}; {}", section.At("video"), Show(*video), wrong));
    }
  }
  line.print_direction = section.Direction("print_direction");
  line.sweep_direction = section.Direction("sweep_direction");
  if (const Json* times = section.List("frame_times_s")) {
    for (std::size_t i = 0; i < times->size() && fault.empty(); ++i) {
      const std::string at = fmt::format("{}[{}]", section.At("frame_times_s"), i);
      line.frame_times_s.push_back(section.AsNumber((*times)[i], at).value_or(0));
    }
    if (times->empty()) {
      section.Say(section.At("frame_times_s") +
                  " is empty; give one time per frame or leave it out");
    }
  }
  return line;
}

void ReadSegments(Section& section, std::string& fault, std::vector<Segment>& segments) {
  const Json* list = section.List("segments");
  if (list == nullptr) {
    segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
    return;
  }
  for (std::size_t i = 0; i < list->size() && fault.empty(); ++i) {
    Section entry((*list)[i], fmt::format("segments[{}]", i), fault);
    entry.Only({"fraction", "speed_mm_s"});
    segments.push_back(
        {entry.Number("fraction", true).value_or(0), entry.Number("speed_mm_s", true).value_or(0)});
  }
}

void ReadCrop(Section& section, std::string& fault, Scan& scan) {
  const Json* crop = section.Find("crop_px", false);
  if (crop == nullptr) {
    return;
  }
  Section entry(*crop, "crop_px", fault);
  entry.Only({"x", "y", "width", "height"});
  scan.crop = PixelRect{entry.Whole("x").value_or(0), entry.Whole("y").value_or(0),
                        entry.Whole("width").value_or(0), entry.Whole("height").value_or(0)};
}

Scan ReadObject(const Json& json, std::string& fault) {
  Section section(json, "", fault);
  section.Only({"format", "eye", "lines", "frames_per_s", "scan_speed_mm_s", "px_per_mm",
                "laser_angle_deg", "height_direction", "crop_px", "line_start_mm", "line_length_mm",
                "segments", "acceleration_mm_s2"});
  Scan scan;
  const auto format = section.Number("format", true);
  if (format && *format != 1) {
    section.Say(fmt::format("format is {}; this trammel reads format 1", *format));
  }
  const auto eye = section.Text("eye", true);
  if (eye && *eye != "laser") {
    section.Say(fmt::format("eye is {}; it must be \"laser\"", Show(*eye)));
  }
  if (const Json* lines = section.List("lines", true)) {
    if (lines->size() > 1000) {
      section.Say(fmt::format("lines has {} entries; it must have 1 … 1000", lines->size()));
    }
    for (std::size_t i = 0; i < lines->size() && fault.empty(); ++i) {
      scan.lines.push_back(ReadLine((*lines)[i], i, fault));
    }
  }
  scan.frames_per_s = section.Number("frames_per_s").value_or(30);
  scan.scan_speed_mm_s = section.Number("scan_speed_mm_s", true).value_or(0);
  scan.px_per_mm = section.Number("px_per_mm");
  scan.laser_angle_rad = section.Number("laser_angle_deg").value_or(45) * std::numbers::pi / 180;
  scan.height_direction = section.Direction("height_direction").value_or(AxisDirection::kMinusX);
  ReadCrop(section, fault, scan);
  scan.line_start_mm = section.Number("line_start_mm").value_or(4);
  scan.motion.length_mm = section.Number("line_length_mm").value_or(30);
  scan.motion.acceleration_mm_s2 = section.Number("acceleration_mm_s2").value_or(3000);
  ReadSegments(section, fault, scan.motion.segments);
  return scan;
}

/// Parses strictly: a key given twice is a fault, for JSON would silently keep one of them.
Json ParseStrictly(const std::string& text, std::string& fault) {
  std::vector<std::set<std::string>> open;
  const Json::parser_callback_t watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) {
      open.emplace_back();
    } else if (event == Json::parse_event_t::object_end) {
      open.pop_back();
    } else if (event == Json::parse_event_t::key && !open.empty() &&
               !open.back().insert(parsed.get<std::string>()).second && fault.empty()) {
      fault = fmt::format("the key {} is given twice", Show(parsed));
    }
    if (depth > 16 && fault.empty()) {
      fault = "objects and lists are nested more than 16 deep";
    }
    return depth <= 16;
  };
  try {
    return Json::parse(text, watch);
  } catch (const Json::exception& error) {
    // The library's own prefix in brackets says nothing to a user.
    const std::string_view what = error.what();
    const auto bracket = what.find("] ");
    fault = fmt::format("not valid JSON: {}",
                        bracket == std::string_view::npos ? what : what.substr(bracket + 2));
    return {};
  }
}

}  // namespace

Result<Scan> ParseScan(const std::string& text, const std::string& name) {
  std::string fault;
  const Json json = ParseStrictly(text, fault);
  Scan scan;
  if (fault.empty()) {
    scan = ReadObject(json, fault);
  }
  if (!fault.empty()) {
    return Fail(fmt::format("{}: {}", name, fault));
  }
  if (const auto valid = Validate(scan); !valid) {
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
    return Fail(fmt::format(
        "'{}' has no scan.json; docs/formats.md says what a recording must hold", folder.string()));
  }
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > kMaxBytes) {
    return Fail(
        fmt::format("'{}' has {} bytes; at most {} are read", file.string(), size, kMaxBytes));
  }
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)),
                         std::istreambuf_iterator<char>());
  if (!stream) {
    return Fail(fmt::format("'{}' cannot be read; check its permissions", file.string()));
  }
  return ParseScan(text, file.string());
}

}  // namespace trammel::store
