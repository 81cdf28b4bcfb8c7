#include "app/option_values.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <string>
#include <system_error>

namespace trammel::app {

std::string_view WithoutSpaces(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> Split(std::string_view text, char separator, std::size_t most) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= text.size() && parts.size() <= most;) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::optional<WholePair> ParseWholePair(std::string_view text) {
  const auto sides = Split(text, 'x', 2);
  if (sides.size() != 2) return std::nullopt;
  const auto first = ParseNumber<int>(sides[0]);
  const auto second = ParseNumber<int>(sides[1]);
  if (!first || !second) return std::nullopt;
  return WholePair{*first, *second};
}

Result<ToolShift> ParseToolShift(std::string_view option, std::string_view text, int max_tool) {
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
  good = good && tool >= 0 && tool <= max_tool && tool == static_cast<int>(tool) &&
         near(numbers[1]) && near(numbers[2]);
  if (good) return ToolShift{static_cast<int>(tool), numbers[1], numbers[2]};
  return Fail(
      fmt::format("{} {}: must be TOOL:X,Y, for example 1:0.2,-0.1, with tools 0 ... {} and mm",
                  option, text.substr(0, 40), max_tool));
}

CLI::Validator NumberIn(double low, double high) {
  return CLI::Validator(
      [low, high](const std::string& text) -> std::string {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return {};
        return fmt::format("{} is no number in {} … {}", text, low, high);
      },
      fmt::format("FLOAT in {} … {}", low, high));
}

CLI::Validator SeedNumber() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        std::uint64_t value = 0;
        const char* end = text.data() + text.size();
        const auto [rest, error] = std::from_chars(text.data(), end, value);
        if (error == std::errc() && rest == end) return {};
        return fmt::format("{} is no whole number in 0 … {}", text, UINT64_MAX);
      },
      "UINT");
}

}  // namespace trammel::app
