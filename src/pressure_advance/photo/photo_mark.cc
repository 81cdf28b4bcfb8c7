#include "pressure_advance/photo/photo_mark.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "vision/comb_pattern.h"
#include "vision/filament_contrast.h"
#include "vision/image.h"

namespace trammel::pressure_advance {
namespace {

using vision::Curve;
using vision::GrayImage;
using vision::LinePattern;

// Range of columns at one end of the lines.
struct Stretch {
  double from_px = 0, to_px = 0;
};

double At(const GrayImage& image, double x, double y) {
  return image.row(static_cast<int>(std::lround(y)))[std::lround(x)];
}

// Contrast of the plate beside an outer line, a parabola along it due to light and lens, and the
// filament's contrast above it.
struct Levels {
  double middle_px = 0, scale_px = 1;
  Eigen::Vector3d plate = Eigen::Vector3d::Zero();
  double rise = 0;

  [[nodiscard]] Eigen::Vector3d Powers(double x) const {
    const double at = (x - middle_px) / scale_px;
    return {1, at, at * at};
  }
  [[nodiscard]] double PlateAt(double x) const { return plate.dot(Powers(x)); }
  [[nodiscard]] double HalfAt(double x) const { return PlateAt(x) + rise / 2; }
};

// Fits the plate's parabola, without outliers from a first one: a swollen line, a string.
void FitPlate(std::span<const std::pair<double, double>> beside, Levels& levels) {
  for (const bool again : {false, true}) {
    Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const auto& [x, value] : beside) {
      if (again && value > levels.HalfAt(x)) continue;
      normal += levels.Powers(x) * levels.Powers(x).transpose();
      right += value * levels.Powers(x);
    }
    levels.plate = normal.ldlt().solve(right);
  }
}

Levels LevelsOf(const GrayImage& contrast, const Curve& rung, double outwards, double pitch_px,
                const Stretch& line) {
  std::vector<double> filament, plate;
  std::vector<std::pair<double, double>> beside;
  for (double x = line.from_px; x <= line.to_px; x += 1) {
    const double y = rung(x), away = y + outwards * 0.5 * pitch_px;
    if (std::min(y, away) < 0 || std::max(y, away) > contrast.height - 1) continue;
    filament.push_back(At(contrast, x, y));
    plate.push_back(At(contrast, x, away));
    beside.emplace_back(x, plate.back());
  }
  Levels levels;
  if (filament.empty()) return levels;
  levels.middle_px = (line.from_px + line.to_px) / 2;
  levels.scale_px = std::max(1.0, (line.to_px - line.from_px) / 2);
  levels.rise = Median(filament) - Median(plate);
  levels.plate[0] = Median(plate);
  FitPlate(beside, levels);
  return levels;
}

// Finds the distance outwards from an outer line at which most of a stretch is filament for a
// bead's depth. Nothing if the picture ends before half of the examined plate.
std::optional<double> FilamentBegins_px(const GrayImage& contrast, const Curve& rung,
                                        double outwards, const LinePattern& pattern,
                                        const Stretch& stretch, const Levels& levels) {
  constexpr double kFarthest = 2.4;  // pitches
  const double deep_px = std::max(2.0, 0.7 * pattern.bead_px);
  double begun_px = 0, run_px = 0;
  for (double away = 0.9 * pattern.bead_px; away < kFarthest * pattern.pitch_px; away += 1) {
    int above = 0, count = 0;
    for (double x = stretch.from_px; x <= stretch.to_px; x += 1) {
      const double y = rung(x) + outwards * away;
      if (y < 0 || y > contrast.height - 1) continue;
      ++count;
      above += At(contrast, x, y) > levels.HalfAt(x);
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

// Returns the share of filament in the columns x from … to over the distances from … to, as
// brightness between those of plate and lines: blur and thin strokes do not change such a mean.
double FilamentShare(const GrayImage& contrast, const Curve& rung, double outwards,
                     const Stretch& columns, const Stretch& away, const Levels& levels) {
  constexpr double kMax = 1.25;
  double sum = 0;
  int count = 0;
  for (double out = away.from_px; out <= away.to_px; out += 1) {
    for (double x = columns.from_px; x <= columns.to_px; x += 1) {
      const double y = rung(x) + outwards * out;
      if (y < 0 || y > contrast.height - 1) continue;
      ++count;
      sum += std::min(kMax, (At(contrast, x, y) - levels.PlateAt(x)) / levels.rise);
    }
  }
  return count > 0 ? sum / count : 0;
}

// Computes the scatter of the plate's shares from its texture and the picture's noise, between the
// middles of an outer line and its bar. Windows are `window_px` long and one and a fifth of a bead
// deep.
double PlateScatter(const GrayImage& contrast, const Curve& rung, double outwards,
                    const LinePattern& pattern, const Stretch& middle, double window_px,
                    double bar_px, const Levels& levels) {
  // Uses differences of neighbours: a falloff of light along the line is no texture.
  double squares = 0;
  int count = 0;
  const double half_px = 0.6 * pattern.bead_px;
  for (double away = 1.3 * pattern.bead_px; away < bar_px - 1.3 * pattern.bead_px;
       away += half_px) {
    std::optional<double> last;
    for (double x = middle.from_px; x + window_px <= middle.to_px; x += window_px) {
      const double share = FilamentShare(contrast, rung, outwards, {x, x + window_px},
                                         {away - half_px, away + half_px}, levels);
      if (last) {
        squares += (share - *last) * (share - *last) / 2;
        ++count;
      }
      last = share;
    }
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

// Corner of the frame at one end of an outer line, for the filled depth before its bar.
struct Corner {
  const GrayImage* contrast;
  const Curve* rung;
  double outwards = 1, bead_px = 0, bar_px = 0;  // the bar's distance from the line
  Stretch here, other;                           // columns at this end and at the line's other one
  Stretch next;                                  // columns that lie just beyond a mark's
  Levels levels;
  double scatter = 0;  // plate's scatter: PlateScatter
};

// Strokes of a starved printer are separate: a bead's mean counts, with plate at the other end.
double FilledDepth_px(const Corner& corner) {
  constexpr double kPlate = 0.12;  // of the contrast between filament and plate
  constexpr double kEdge = 0.6;    // light falls off slowly, a mark ends
  // On a coarse plate only a fully printed mark counts.
  constexpr double kCoarse = 0.05, kFull = 0.6;
  const double filled = corner.scatter > kCoarse ? kFull : std::max(0.2, 0.08 + 4 * corner.scatter);
  const double half_px = 0.6 * corner.bead_px;
  const auto share = [&](const Stretch& columns, double away) {
    return FilamentShare(*corner.contrast, *corner.rung, corner.outwards, columns,
                         {away - half_px, away + half_px}, corner.levels);
  };
  double filled_px = corner.bar_px;
  for (double away = corner.bar_px - 0.75 * corner.bead_px; away > 1.2 * corner.bead_px;
       away -= 1) {
    const double here = share(corner.here, away);
    if (here < filled || share(corner.other, away) > kPlate) break;
    if (here - share(corner.next, away) < kEdge * filled) break;
    filled_px = away;
  }
  return corner.bar_px - filled_px;
}

// True if all of a stretch is filled: a blob or a string is not.
bool FilledAlong(const Corner& corner, double depth_px) {
  constexpr int kPieces = 5;
  const double least = std::max(0.12, 3 * corner.scatter);
  const Stretch away{corner.bar_px - depth_px, corner.bar_px - 0.15 * corner.bead_px};
  const double piece_px = (corner.here.to_px - corner.here.from_px) / kPieces;
  for (int i = 0; i < kPieces; ++i) {
    const double from = corner.here.from_px + i * piece_px;
    if (FilamentShare(*corner.contrast, *corner.rung, corner.outwards, {from, from + piece_px},
                      away, corner.levels) < least) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::optional<MarkedCorner> FindMark(const GrayImage& contrast, const LinePattern& pattern) {
  constexpr double kLength = 0.1;  // in line lengths
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
                                   {left + kLength * length, right - kLength * length});
    const std::array<Stretch, 2> ends{Stretch{left + inside, left + kLength * length},
                                      Stretch{right - kLength * length, right - inside}};
    const std::array<Stretch, 2> next{
        Stretch{left + 2 * kLength * length, left + 3 * kLength * length},
        Stretch{right - 3 * kLength * length, right - 2 * kLength * length}};
    std::array<std::optional<double>, 2> begins;
    for (std::size_t end = 0; end < 2; ++end) {
      begins[end] = FilamentBegins_px(contrast, rung, outwards, pattern, ends[end], levels);
    }
    if (!begins[0] || !begins[1]) continue;
    if (!(levels.rise > 0)) continue;
    // Position of the bar, if either end shows plate before it.
    const double bar_px = std::max(*begins[0], *begins[1]);
    const double scatter =
        PlateScatter(contrast, rung, outwards, pattern, {left + 0.2 * length, right - 0.2 * length},
                     kLength * length - inside, bar_px, levels);
    for (std::size_t end = 0; end < 2; ++end) {
      const bool alike = std::abs(*begins[end] - bar_px) < 0.7 * pattern.bead_px;
      const Corner corner{
          &contrast, &rung,         outwards,  pattern.bead_px, alike ? *begins[end] : bar_px,
          ends[end], ends[1 - end], next[end], levels,          scatter};
      const double depth_px = FilledDepth_px(corner);
      if (depth_px < kDeep * pattern.bead_px || !FilledAlong(corner, depth_px)) continue;
      marked.push_back({bottom, end == 1});
    }
  }
  if (marked.size() != 1) return std::nullopt;
  return marked.front();
}

namespace {

// Returns 1 where a rectified picture shows the photo.
vision::GrayImage SeenPart(const BgrView& photo, const vision::Homography& photo_from_view,
                           int width_px, int height_px) {
  vision::GrayImage seen(width_px, height_px);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const vision::PointPx p = photo_from_view({double(x), double(y)});
      const bool inside = p.x >= 0 && p.y >= 0 && p.x <= photo.width - 1 && p.y <= photo.height - 1;
      seen.row(y)[x] = inside ? 1.0F : 0.0F;
    }
  }
  return seen;
}

// Returns 1 on the lines' cores, 0 in the middle of the spaces between them, one half where it may
// be either: the lines' positions are known, while brighter or darker pixels there need not be
// filament.
vision::GrayImage LinesAndSpaces(const vision::GrayImage& seen, const vision::CombPlaces& places) {
  constexpr double kCore = 0.15, kSpace = 0.38;  // pitches from the nearest place
  vision::GrayImage mask(seen.width, seen.height);
  std::fill(mask.value.begin(), mask.value.end(), 0.5F);
  const double lines_px = seen.width / (1 + 2 * vision::kBesideComb);
  const int from = static_cast<int>(vision::kBesideComb * lines_px),
            to = static_cast<int>((1 + vision::kBesideComb) * lines_px);
  for (int y = 0; y < seen.height; ++y) {
    const double place = (y - places.first_y_px) / places.pitch_px;
    if (place < -0.5 || place > places.count - 0.5) continue;
    const double off = std::abs(place - std::round(place));
    if (off > kCore && off < kSpace) continue;
    for (int x = from; x < to; ++x) {
      if (seen.row(y)[x] > 0.5F) mask.row(y)[x] = off <= kCore ? 1.0F : 0.0F;
    }
  }
  return mask;
}

}  // namespace

std::optional<CombView> LookAtComb(const BgrView& photo, const vision::FoundComb& comb,
                                   double longest_px, bool framed) {
  using vision::Distance_px;
  const vision::Quad& corners = comb.corners;
  double width = std::max(Distance_px(corners[0], corners[1]), Distance_px(corners[3], corners[2]));
  double height =
      std::max(Distance_px(corners[1], corners[2]), Distance_px(corners[0], corners[3]));
  const double shrink = std::min(1.0, longest_px / std::max(width, height));
  width *= shrink;
  height *= shrink;
  constexpr double kSmallest_px = 60;
  if (std::min(width, height) < kSmallest_px) return std::nullopt;
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  const vision::Quad target{{{0, 0}, {w - 1.0, 0}, {w - 1.0, h - 1.0}, {0, h - 1.0}}};
  const auto photo_from_view = vision::TargetFromSource(corners, target);
  if (!photo_from_view) return std::nullopt;
  CombView view;
  view.corners = corners;
  view.picture = vision::Rectify(photo, *photo_from_view, w, h);
  const vision::GrayImage seen = SeenPart(photo, *photo_from_view, w, h);
  vision::CombPlaces places;
  places.count = comb.places;
  places.pitch_px = (h - 1) / (comb.places - 1 + 2 * vision::kAroundComb);
  places.first_y_px = vision::kAroundComb * places.pitch_px;
  const int surroundings = std::max(5, static_cast<int>(2 * places.pitch_px)) | 1;
  const auto weights =
      vision::FindContrast(view.picture.view(), LinesAndSpaces(seen, places), surroundings);
  if (!weights) return std::nullopt;
  view.contrast = vision::Mix(view.picture.view(), *weights);
  view.line_pattern = vision::TraceComb(view.contrast, seen, places, framed);
  return view;
}

}  // namespace trammel::pressure_advance
