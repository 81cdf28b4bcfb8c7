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

/// The text less its spaces at both ends.
[[nodiscard]] std::string_view WithoutSpaces(std::string_view text);

/// The whole text as one number; nothing where it is not, or not finite.
template <class Number>
[[nodiscard]] std::optional<Number> ParseNumber(std::string_view text) {
  Number value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, code] = std::from_chars(text.data(), last, value);
  if (code != std::errc{} || end != last || !std::isfinite(static_cast<double>(value))) return {};
  return value;
}

/// Cut at each separator; at most one more than `most` parts.
[[nodiscard]] std::vector<std::string_view> Split(std::string_view text, char separator,
                                                  std::size_t most);

struct WholePair {
  int first = 0;
  int second = 0;
};

/// Reads `9x3` or `1280x720`; nothing where the text is not two whole numbers with an x between.
[[nodiscard]] std::optional<WholePair> ParseWholePair(std::string_view text);

struct ToolShift {
  int tool = 0;
  double x_mm = 0;
  double y_mm = 0;
};

/// Reads `TOOL:X,Y`, for example 1:0.2,-0.1: tools 0 ... most_tool, X and Y within +-1000 mm.
/// @param option  begins the message of the error.
[[nodiscard]] Result<ToolShift> ParseToolShift(std::string_view option, std::string_view text,
                                               int most_tool);

// Bounds for numbers on the command line.

/// Refuses what does not lie in low … high, NaN included, which CLI::Range lets pass.
[[nodiscard]] CLI::Validator NumberIn(double low, double high);

/// Refuses what is no whole number from 0 to 2^64 - 1: CLI11 turns -1 into the largest.
[[nodiscard]] CLI::Validator SeedNumber();

}  // namespace trammel::app
