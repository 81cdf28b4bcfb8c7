// Sheets of paper that people print on.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace trammel::tool_offset {

struct PaperSize {
  std::string_view name;
  double short_mm = 0;
  double long_mm = 0;
};

/// Smallest first.
[[nodiscard]] std::span<const PaperSize> PaperSizes();

/// By its name, in capitals or not. Nothing for another name.
[[nodiscard]] std::optional<PaperSize> FindPaper(std::string_view name);

/// White on each side of the print: for the tape, and what a scanner does not see.
inline constexpr double kPaperMargin_mm = 5;

/// Whether a print that takes so much of the bed's x and y fits, lying or standing.
[[nodiscard]] bool FitsPaper(const PaperSize& paper, double x_mm, double y_mm);

}  // namespace trammel::tool_offset
