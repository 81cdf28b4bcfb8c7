#include "pressure_advance/files/camera_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "gcode/dialect.h"

namespace trammel::files {
namespace {

using gcode::FormatNumber;
using pressure_advance::SetupResult;

constexpr double kDegree = std::numbers::pi / 180;

std::string Crop(const PixelRect& crop) {
  return fmt::format("[{}, {}, {}, {}]", crop.x, crop.y, crop.width, crop.height);
}

// Above 0, which no uncertainty is.
std::string Sigma(double standard_uncertainty) {
  constexpr double kLeast = 1e-4;
  return FormatNumber(std::max(kLeast, standard_uncertainty), 4);
}

// "95 %: 27.95 to 28.03"
std::string Between(const Measured& measured, double unit, int decimals) {
  const Interval& interval = measured.quantity().interval95;
  return fmt::format("95 %: {} to {}", FormatNumber(interval.lo / unit, decimals),
                     FormatNumber(interval.hi / unit, decimals));
}

// The name of the section that a line begins; empty: it begins none.
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

}  // namespace trammel::files
