#include "pressure_advance/commands/pattern_options.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "app/option_values.h"

namespace trammel::app {

using pressure_advance::Segment;

namespace {

constexpr double kMax_s = 10;
constexpr std::size_t kMaxValues = 1000;   // as many lines as scan.json may have
constexpr std::size_t kMaxSegments = 100;  // as in scan.json

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

}  // namespace trammel::app
