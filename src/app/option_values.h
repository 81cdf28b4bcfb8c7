// Values of options: checked ranges, lists, names.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/result.h"

namespace trammel::app {

/// Returns the text without the spaces at both ends.
[[nodiscard]] std::string_view WithoutSpaces(std::string_view text);

/// Parses the whole text as one finite number; absent otherwise.
template <class Number>
[[nodiscard]] std::optional<Number> ParseNumber(std::string_view text) {
  Number value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, code] = std::from_chars(text.data(), last, value);
  if (code != std::errc{} || end != last || !std::isfinite(static_cast<double>(value))) return {};
  return value;
}

/// Splits at each separator, into at most `most` + 1 parts.
[[nodiscard]] std::vector<std::string_view> Split(std::string_view text, char separator,
                                                  std::size_t most);

struct WholePair {
  int first = 0;
  int second = 0;
};

/// Parses `9x3` or `1280x720`; absent if the text is not two whole numbers with an x between.
[[nodiscard]] std::optional<WholePair> ParseWholePair(std::string_view text);

struct ToolShift {
  int tool = 0;
  double x_mm = 0;
  double y_mm = 0;
};

/// Parses `TOOL:X,Y`, for example 1:0.2,-0.1: tools 0 ... most_tool, X and Y within +-1000 mm.
/// @param option  begins the error message.
[[nodiscard]] Result<ToolShift> ParseToolShift(std::string_view option, std::string_view text,
                                               int max_tool);

// Bounds for numbers on the command line.

/// Accepts numbers in low … high and rejects NaN, which CLI::Range accepts.
[[nodiscard]] CLI::Validator NumberIn(double low, double high);

/// Accepts whole numbers from 0 to 2^64 - 1; CLI11 alone would turn -1 into the largest.
[[nodiscard]] CLI::Validator SeedNumber();

}  // namespace trammel::app
