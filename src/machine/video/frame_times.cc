#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "machine/net/file_bytes.h"
#include "machine/video/video_writer.h"

namespace trammel::machine {
namespace {

template <class T>
std::optional<T> Number(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return value;
}

/// Whether the two fields are "- -" or a time with its clock's name.
bool ReadTime(std::string_view time, std::string_view clock, std::optional<CameraTime>& out) {
  if (time == "-" && clock == "-") return true;
  using enum CameraClock;
  for (const auto& [name, value] :
       {std::pair{"ours", kOurs}, std::pair{"camera", kCameraMonotonic},
        std::pair{"wall", kCameraWall}, std::pair{"recording", kRecording}}) {
    const auto number = Number<double>(time);
    if (clock == name && number) {
      out = CameraTime{*number, value};
      return true;
    }
  }
  return false;
}

bool ReadFault(std::string_view text, FrameFault& out) {
  using enum FrameFault;
  for (const FrameFault fault : {kNone, kNotAnImage, kCutOff, kOtherSize, kNoSignal, kTimeJumped}) {
    if (ToString(fault) == text) {
      out = fault;
      return true;
    }
  }
  return false;
}

template <class T>
bool ReadNumber(std::string_view text, std::optional<T>& out) {
  if (text == "-") return true;
  out = Number<T>(text);
  return out.has_value();
}

std::optional<FrameTimes> ParseLine(std::string_view line) {
  std::array<std::string_view, 8> field;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const std::size_t end = line.find(' ');
    if ((end == std::string_view::npos) != (i + 1 == field.size())) return std::nullopt;
    field[i] = line.substr(0, end);
    line.remove_prefix(end == std::string_view::npos ? line.size() : end + 1);
  }
  FrameTimes times;
  const auto arrival = Number<double>(field[1]);
  if (!arrival || !ReadNumber(field[0], times.frame) ||
      !ReadTime(field[2], field[3], times.captured) || !ReadTime(field[4], field[5], times.sent) ||
      !ReadNumber(field[6], times.sequence) || !ReadFault(field[7], times.fault)) {
    return std::nullopt;
  }
  times.arrival_s = *arrival;
  return times;
}

}  // namespace

Result<std::vector<FrameTimes>> ReadFrameTimes(const std::filesystem::path& path) {
  constexpr std::size_t kMostLines = 200'000;
  constexpr std::size_t kLongestLine = 400;
  const auto broken = [&](std::size_t line, const std::string& what) {
    return Fail(fmt::format("frame times '{}', line {}: {}", path.string(), line, what),
                ErrorKind::kMeasurement);
  };
  const auto bytes = ReadFileBytes(path, static_cast<std::int64_t>(kMostLines * kLongestLine));
  if (!bytes) {
    return Fail(fmt::format("frame times '{}': {}", path.string(), bytes.error().message),
                ErrorKind::kMeasurement);
  }
  std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  // What has no end of line was cut off when its writer was killed.
  const auto next = [&text]() -> std::optional<std::string_view> {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    return line;
  };
  if (next() != "# trammel frame times, format 1") {
    return broken(1, "does not begin with '# trammel frame times, format 1'");
  }
  std::vector<FrameTimes> all;
  std::size_t number = 2;
  for (auto line = next(); line; line = next(), ++number) {
    if (!line->empty() && line->front() == '#') continue;
    if (line->size() > kLongestLine || all.size() == kMostLines) {
      return broken(number, "longer than any recording's");
    }
    const auto times = ParseLine(*line);
    if (!times) {
      return broken(number, fmt::format("'{}' is not: frame, arrival, capture time and its clock, "
                                        "time of sending and its clock, sequence, fault",
                                        *line));
    }
    all.push_back(*times);
  }
  return all;
}

}  // namespace trammel::machine
