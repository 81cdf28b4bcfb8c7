#include "app/option_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

namespace trammel::app {

using pressure_advance::Segment;

namespace {

constexpr double kMax_s = 10;
constexpr std::size_t kMaxValues = 1000;   // as many lines as scan.json may have
constexpr std::size_t kMaxSegments = 100;  // as in scan.json

std::string_view WithoutSpaces(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

/// The whole text as one number; nothing where it is not, or not finite.
template <class Number>
std::optional<Number> ParseNumber(std::string_view text) {
  Number value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, code] = std::from_chars(text.data(), last, value);
  if (code != std::errc{} || end != last || !std::isfinite(static_cast<double>(value))) return {};
  return value;
}

/// Cut at each separator; at most one more than `most` parts.
std::vector<std::string_view> Split(std::string_view text, char separator, std::size_t most) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= text.size() && parts.size() <= most;) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

Result<std::vector<double>> ParseNumbers(std::string_view text, char separator) {
  std::vector<double> numbers;
  for (const std::string_view part : Split(text, separator, kMaxValues)) {
    const auto number = ParseNumber<double>(WithoutSpaces(part));
    if (!number) return Fail(fmt::format("--pa {}: \"{}\" is not a number", text, part));
    numbers.push_back(*number);
  }
  if (numbers.size() > kMaxValues)
    return Fail(fmt::format("--pa: more than {} values", kMaxValues));
  return numbers;
}

Result<std::vector<double>> Expand(std::string_view text, double start, double end, double third) {
  if (end <= start) {
    return Fail(fmt::format("--pa {}: the end {} is not above the start {}", text, end, start));
  }
  if (!(third > 0)) {
    return Fail(fmt::format("--pa {}: the third part {} must be above 0", text, third));
  }
  const bool is_step = third <= end - start;
  const double intervals = is_step ? (end - start) / third : third - 1;
  constexpr double kWhole = 1e-6;  // decimal steps are not exact in binary
  if (std::abs(intervals - std::round(intervals)) > kWhole || std::round(intervals) < 1) {
    return Fail(fmt::format("--pa {}: {} neither divides the range {} nor is a count of at least 2",
                            text, third, end - start));
  }
  if (intervals + 1 > static_cast<double>(kMaxValues)) {
    return Fail(
        fmt::format("--pa {}: {:.0f} values are more than {}", text, intervals + 1, kMaxValues));
  }
  std::vector<double> values;
  const auto last = static_cast<int>(std::lround(intervals));
  for (int i = 0; i <= last; ++i) {
    values.push_back(std::round(std::lerp(start, end, double(i) / last) * 1e9) / 1e9);
  }
  return values;
}

}  // namespace

Result<std::vector<double>> ParsePressureAdvances(std::string_view text) {
  const bool range = text.find(':') != std::string_view::npos;
  Result<std::vector<double>> parts = ParseNumbers(text, range ? ':' : ',');
  if (!parts) return parts;
  if (range) {
    if (parts->size() != 3) {
      return Fail(fmt::format("--pa {}: a range is START:END:STEP or START:END:COUNT", text));
    }
    parts = Expand(text, (*parts)[0], (*parts)[1], (*parts)[2]);
    if (!parts) return parts;
  }
  for (double value : *parts) {
    if (value < 0 || value > kMax_s) {
      return Fail(fmt::format("--pa {}: {} s is outside 0 ... {} s", text, value, kMax_s));
    }
  }
  return parts;
}

Result<std::vector<Segment>> ParseSegments(std::string_view text) {
  std::vector<Segment> segments;
  double sum = 0;
  for (const std::string_view part : Split(text, ',', kMaxSegments)) {
    const auto sides = Split(part, ':', 2);
    const auto fraction = ParseNumber<double>(sides.front());
    const auto speed = sides.size() == 2 ? ParseNumber<double>(sides.back()) : std::nullopt;
    if (!fraction || !speed || !(*fraction > 0 && *fraction < 1) ||
        !(*speed >= 0.1 && *speed <= 2000)) {
      return Fail(fmt::format(
          "--segments: '{}' is not FRACTION:SPEED with a fraction between 0 and 1 and a speed of "
          "0.1 to 2000 mm/s, as in 0.1:10,0.6:100,0.3:10",
          part));
    }
    segments.push_back({*fraction, *speed});
    sum += *fraction;
  }
  if (segments.size() > kMaxSegments) {
    return Fail(fmt::format("--segments: more than {} segments", kMaxSegments));
  }
  if (std::abs(sum - 1) > 1e-3) {
    return Fail(fmt::format("--segments: the fractions of {} sum to {:.4g}; they must sum to 1",
                            text, sum));
  }
  return segments;
}

std::optional<WholePair> ParseWholePair(std::string_view text) {
  const auto sides = Split(text, 'x', 2);
  if (sides.size() != 2) return std::nullopt;
  const auto first = ParseNumber<int>(sides[0]);
  const auto second = ParseNumber<int>(sides[1]);
  if (!first || !second) return std::nullopt;
  return WholePair{*first, *second};
}

Result<ToolShift> ParseToolShift(std::string_view option, std::string_view text, int most_tool) {
  std::array<double, 3> numbers{};
  const char* at = text.data();
  const char* end = at + text.size();
  constexpr std::array kBehind = {':', ',', '\0'};
  bool good = true;
  for (std::size_t i = 0; i < numbers.size() && good; ++i) {
    const auto [stop, fault] = std::from_chars(at, end, numbers[i]);
    good = fault == std::errc() && (i == 2 ? stop == end : stop != end && *stop == kBehind[i]);
    at = good && i < 2 ? stop + 1 : stop;
  }
  const double tool = numbers[0];
  const auto near = [](double mm) { return mm >= -1000 && mm <= 1000; };
  good = good && tool >= 0 && tool <= most_tool && tool == static_cast<int>(tool) &&
         near(numbers[1]) && near(numbers[2]);
  if (good) return ToolShift{static_cast<int>(tool), numbers[1], numbers[2]};
  return Fail(
      fmt::format("{} {}: must be TOOL:X,Y, for example 1:0.2,-0.1, with tools 0 ... {} and mm",
                  option, text.substr(0, 40), most_tool));
}

}  // namespace trammel::app
