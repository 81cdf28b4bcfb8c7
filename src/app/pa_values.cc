#include "app/pa_values.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>

namespace trammel::app {
namespace {

constexpr double kMax_s = 10;
constexpr std::size_t kMaxValues = 1000;

std::optional<double> ParseNumber(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  double value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

Result<std::vector<double>> ParseNumbers(std::string_view text, char separator) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    const std::string_view part = text.substr(begin, end - begin);
    const std::optional<double> number = ParseNumber(part);
    if (!number) return Fail(fmt::format("--pa {}: \"{}\" is not a number", text, part));
    numbers.push_back(*number);
    if (numbers.size() > kMaxValues) {
      return Fail(fmt::format("--pa: more than {} values", kMaxValues));
    }
    begin = end + 1;
  }
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

}  // namespace trammel::app
