#include "pressure_advance/photo/photo_mark.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

using vision::Curve;
using vision::GrayImage;
using vision::LinePattern;

// A stretch of columns at one end of the lines.
struct Stretch {
  double from_px = 0, to_px = 0;
};

double At(const GrayImage& image, double x, double y) {
  return image.row(static_cast<int>(std::lround(y)))[std::lround(x)];
}

// Contrast of filament and of plate about an outer line, from its middle half.
struct Levels {
  double plate = 0, half = 0;
};

Levels LevelsOf(const GrayImage& contrast, const Curve& rung, double outwards, double pitch_px,
                const Stretch& line) {
  std::vector<double> filament, plate;
  for (double x = line.from_px; x <= line.to_px; x += 1) {
    const double y = rung(x), beside = y + outwards * 0.5 * pitch_px;
    if (std::min(y, beside) < 0 || std::max(y, beside) > contrast.height - 1) continue;
    filament.push_back(At(contrast, x, y));
    plate.push_back(At(contrast, x, beside));
  }
  if (filament.empty()) return {};
  const double low = Median(plate);
  return {low, (low + Median(filament)) / 2};
}

// How far from an outer line, going outwards, most of a stretch is filament and stays so for a
// bead; nothing where the picture ends before half of the plate that is looked at.
std::optional<double> FilamentBegins_px(const GrayImage& contrast, const Curve& rung,
                                        double outwards, const LinePattern& pattern,
                                        const Stretch& stretch, double half) {
  constexpr double kFarthest = 2.4;  // pitches
  const double deep_px = std::max(2.0, 0.7 * pattern.bead_px);
  double begun_px = 0, run_px = 0;
  for (double away = 0.9 * pattern.bead_px; away < kFarthest * pattern.pitch_px; away += 1) {
    int above = 0, count = 0;
    for (double x = stretch.from_px; x <= stretch.to_px; x += 1) {
      const double y = rung(x) + outwards * away;
      if (y < 0 || y > contrast.height - 1) continue;
      ++count;
      above += At(contrast, x, y) > half;
    }
    if (2 * count < stretch.to_px - stretch.from_px) return std::nullopt;
    if (2 * above <= count) {
      run_px = 0;
      continue;
    }
    if (run_px == 0) begun_px = away;
    run_px += 1;
    if (run_px >= deep_px) return begun_px;
  }
  return kFarthest * pattern.pitch_px;
}

// Share of a stretch that is filament between two distances from an outer line.
double FilamentShare(const GrayImage& contrast, const Curve& rung, double outwards,
                     const Stretch& stretch, double from_px, double to_px, double half) {
  int above = 0, count = 0;
  for (double away = from_px; away < to_px; away += 1) {
    for (double x = stretch.from_px; x <= stretch.to_px; x += 1) {
      const double y = rung(x) + outwards * away;
      if (y < 0 || y > contrast.height - 1) continue;
      ++count;
      above += At(contrast, x, y) > half;
    }
  }
  return count > 0 ? static_cast<double>(above) / count : 0;
}

}  // namespace

std::optional<MarkedCorner> FindMark(const GrayImage& contrast, const LinePattern& pattern) {
  constexpr double kLength = 0.1;  // of the lines
  constexpr double kDeep = 1.5;    // beads
  if (!pattern.problem.empty() || pattern.rungs.size() < 2) return std::nullopt;
  std::vector<MarkedCorner> marked;
  for (const bool bottom : {false, true}) {
    const Curve& rung = bottom ? pattern.rungs.back() : pattern.rungs.front();
    const double outwards = bottom ? 1 : -1;
    const double middle_y = rung(contrast.width / 2.0);
    const double left = pattern.left_inner(middle_y), right = pattern.right_inner(middle_y);
    const double length = right - left, inside = 0.4 * pattern.bead_px;
    if (!(left >= 0 && right <= contrast.width - 1 && length > 4 * pattern.bead_px)) continue;
    const Levels levels = LevelsOf(contrast, rung, outwards, pattern.pitch_px,
                                   {left + 0.25 * length, right - 0.25 * length});
    const std::array<Stretch, 2> ends{Stretch{left + inside, left + kLength * length},
                                      Stretch{right - kLength * length, right - inside}};
    std::array<std::optional<double>, 2> begins;
    for (std::size_t end = 0; end < 2; ++end) {
      begins[end] = FilamentBegins_px(contrast, rung, outwards, pattern, ends[end], levels.half);
    }
    if (!begins[0] || !begins[1]) continue;
    const double sooner_px = *begins[1] - *begins[0];
    if (std::abs(sooner_px) <= kDeep * pattern.bead_px) continue;
    const std::size_t full = sooner_px > 0 ? 0 : 1;
    const auto share = [&](std::size_t end) {
      return FilamentShare(contrast, rung, outwards, ends[end], *begins[full], *begins[1 - full],
                           levels.half);
    };
    constexpr double kFull = 0.8, kEmpty = 0.2;
    if (share(full) >= kFull && share(1 - full) <= kEmpty) marked.push_back({bottom, full == 1});
  }
  if (marked.size() != 1) return std::nullopt;
  return marked.front();
}

}  // namespace trammel::pressure_advance
