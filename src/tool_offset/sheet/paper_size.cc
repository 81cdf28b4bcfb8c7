#include "tool_offset/sheet/paper_size.h"

#include <algorithm>
#include <array>
#include <cctype>

namespace trammel::tool_offset {
namespace {

constexpr auto kPapers = std::to_array<PaperSize>({{"A5", 148, 210},
                                                   {"A4", 210, 297},
                                                   {"letter", 215.9, 279.4},
                                                   {"A3", 297, 420},
                                                   {"A2", 420, 594}});

bool IsSame(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

}  // namespace

std::span<const PaperSize> PaperSizes() { return kPapers; }

std::optional<PaperSize> FindPaper(std::string_view name) {
  for (const PaperSize& paper : kPapers) {
    if (IsSame(paper.name, name)) return paper;
  }
  return std::nullopt;
}

bool FitsPaper(const PaperSize& paper, double x_mm, double y_mm) {
  const auto [short_mm, long_mm] = std::minmax(x_mm, y_mm);
  return short_mm <= paper.short_mm - 2 * kPaperMargin_mm &&
         long_mm <= paper.long_mm - 2 * kPaperMargin_mm;
}

}  // namespace trammel::tool_offset
