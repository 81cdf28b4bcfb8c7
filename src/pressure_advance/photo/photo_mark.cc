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

// Share of the columns x from … to that is filament over the distances from … to, as brightness
// between that of the plate and that of the lines: blur and thin strokes change no such mean.
double FilamentShare(const GrayImage& contrast, const Curve& rung, double outwards,
                     const Stretch& columns, const Stretch& away, const Levels& levels) {
  constexpr double kMost = 1.25;
  double sum = 0;
  int count = 0;
  for (double out = away.from_px; out <= away.to_px; out += 1) {
    for (double x = columns.from_px; x <= columns.to_px; x += 1) {
      const double y = rung(x) + outwards * out;
      if (y < 0 || y > contrast.height - 1) continue;
      ++count;
      sum +=
          std::min(kMost, (At(contrast, x, y) - levels.plate) / (2 * (levels.half - levels.plate)));
    }
  }
  return count > 0 ? sum / count : 0;
}

// How deep the frame's corner is filled before its bar, at one end of an outer line.
struct Corner {
  const GrayImage* contrast;
  const Curve* rung;
  double outwards = 1, bead_px = 0, bar_px = 0;  // the bar's distance from the line
  Stretch here, other;                           // columns at this end and at the line's other one
  Levels levels;
};

// Strokes of a starved printer lie apart: what counts is a bead's mean, and plate at the other end.
double FilledDepth_px(const Corner& corner) {
  constexpr double kFilled = 0.2, kPlate = 0.12;  // of what filament is above the plate
  const double half_px = 0.6 * corner.bead_px;
  const auto share = [&](const Stretch& columns, double away) {
    return FilamentShare(*corner.contrast, *corner.rung, corner.outwards, columns,
                         {away - half_px, away + half_px}, corner.levels);
  };
  double filled_px = corner.bar_px;
  for (double away = corner.bar_px - 0.75 * corner.bead_px; away > 1.2 * corner.bead_px;
       away -= 1) {
    if (share(corner.here, away) < kFilled || share(corner.other, away) > kPlate) break;
    filled_px = away;
  }
  return corner.bar_px - filled_px;
}

// Whether all of a stretch is filled: a blob or a string is not.
bool FilledAlong(const Corner& corner, double depth_px) {
  constexpr int kPieces = 5;
  constexpr double kLeast = 0.12;
  const Stretch away{corner.bar_px - depth_px, corner.bar_px - 0.15 * corner.bead_px};
  const double piece_px = (corner.here.to_px - corner.here.from_px) / kPieces;
  for (int i = 0; i < kPieces; ++i) {
    const double from = corner.here.from_px + i * piece_px;
    if (FilamentShare(*corner.contrast, *corner.rung, corner.outwards, {from, from + piece_px},
                      away, corner.levels) < kLeast) {
      return false;
    }
  }
  return true;
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
    if (!(levels.half > levels.plate)) continue;
    // The bar, where either end shows plate before it.
    const double bar_px = std::max(*begins[0], *begins[1]);
    for (std::size_t end = 0; end < 2; ++end) {
      const bool alike = std::abs(*begins[end] - bar_px) < 0.7 * pattern.bead_px;
      const Corner corner{
          &contrast, &rung,         outwards, pattern.bead_px, alike ? *begins[end] : bar_px,
          ends[end], ends[1 - end], levels};
      const double depth_px = FilledDepth_px(corner);
      if (depth_px < kDeep * pattern.bead_px || !FilledAlong(corner, depth_px)) continue;
      marked.push_back({bottom, end == 1});
    }
  }
  if (marked.size() != 1) return std::nullopt;
  return marked.front();
}

}  // namespace trammel::pressure_advance
