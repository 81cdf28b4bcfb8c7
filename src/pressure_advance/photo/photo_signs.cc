#include "pressure_advance/photo/photo_signs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

using vision::Curve;
using vision::GrayImage;
using vision::LinePattern;

// Thresholds in this file are of virtual photos, seeds 300000 to 300499.
constexpr double kLine_mm = 80;  // of all these tools; scale of what they print beside the lines

// Pattern with directions of its own: u along the lines from 0 to 1, d beyond an outer line.
class Plane {
 public:
  Plane(const GrayImage& contrast, const LinePattern& pattern)
      : contrast_(contrast), pattern_(pattern) {
    const double middle = contrast.height / 2.0;
    length_px_ = pattern.right_inner(middle) - pattern.left_inner(middle);
    if (!(length_px_ > 0)) return;  // bars that cross: nothing is seen
    std::vector<double> rises;
    for (std::size_t i = 0; i + 1 < pattern.rungs.size(); ++i) {
      if (pattern.steps[i] != 1) continue;
      std::vector<double> line, space;
      for (double u = 0.1; u < 0.9; u += 0.01) {
        const double x = X(u, middle);
        line.push_back(At(x, pattern.rungs[i](x)));
        space.push_back(At(x, SpaceY(i, x)));
      }
      rises.push_back(Median(line) - Median(space));
    }
    rise_ = rises.empty() ? 0 : Median(rises);
  }

  [[nodiscard]] double X(double u, double y) const {
    const double left = pattern_.left_inner(y);
    return left + u * (pattern_.right_inner(y) - left);
  }
  [[nodiscard]] double At(double x, double y) const {
    const auto column = std::clamp<long>(std::lround(x), 0, contrast_.width - 1);
    const auto row = std::clamp<long>(std::lround(y), 0, contrast_.height - 1);
    return contrast_.row(static_cast<int>(row))[column];
  }
  // Mean over a third of a bead: glints are smaller.
  [[nodiscard]] double Mean(double x, double y) const {
    const int reach = std::max(1, static_cast<int>(pattern_.bead_px / 6));
    double sum = 0;
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) sum += At(x + dx, y + dy);
    }
    return sum / ((2 * reach + 1) * (2 * reach + 1));
  }
  [[nodiscard]] bool Holds(double x, double y) const {
    return x >= 0 && y >= 0 && x <= contrast_.width - 1 && y <= contrast_.height - 1;
  }
  // Returns y in the middle of the space below a rung.
  [[nodiscard]] double SpaceY(std::size_t rung, double x) const {
    return (pattern_.rungs[rung](x) + pattern_.rungs[rung + 1](x)) / 2;
  }
  // Returns y beyond an outer line, by a distance in pitches.
  [[nodiscard]] double BeyondY(bool bottom, double x, double d) const {
    return bottom ? pattern_.rungs.back()(x) + d * pattern_.pitch_px
                  : pattern_.rungs.front()(x) - d * pattern_.pitch_px;
  }
  [[nodiscard]] double px_of(double mm) const { return mm / kLine_mm * length_px_; }
  [[nodiscard]] double length_px() const { return length_px_; }
  [[nodiscard]] double rise() const { return rise_; }
  [[nodiscard]] const LinePattern& pattern() const { return pattern_; }

 private:
  const GrayImage& contrast_;
  const LinePattern& pattern_;
  double length_px_ = 0;
  double rise_ = 0;  // contrast of the filament above the plate
};

// Highest narrow feature of a stretch of columns, above the plate beside it, over the filament's
// contrast.
double HighestAcross(const Plane& plane, bool bottom, double u_from, double u_to, double d_from,
                     double d_to) {
  std::vector<double> columns;
  const double y = plane.BeyondY(bottom, plane.X((u_from + u_to) / 2, 0), (d_from + d_to) / 2);
  for (double x = plane.X(u_from, y); x <= plane.X(u_to, y); x += 1) {
    double sum = 0;
    int count = 0;
    for (double d = d_from; d <= d_to; d += 0.05, ++count) {
      sum += plane.At(x, plane.BeyondY(bottom, x, d));
    }
    columns.push_back(sum / count);
  }
  const std::vector<double> means =
      vision::BoxMean(columns, std::max(1, static_cast<int>(plane.pattern().bead_px / 5)));
  if (means.empty()) return 0;
  return (*std::max_element(means.begin(), means.end()) - Median(columns)) / plane.rise();
}

// True if two marks lie beyond an outer line where the speed changes, and none between them.
bool HasMarks(const Plane& plane, bool bottom, double slow_before, double slow_after) {
  constexpr double kMark = 0.5, kNone = 0.3;  // over the filament's contrast
  constexpr double kReach = 0.07;             // a late start moves the marks
  // OrcaSlicer's begin 2 mm from the line, Marlin's 5 or 10.
  struct Distance {
    double from, to;
  };
  for (const auto& [from, to] : {Distance{0.8, 1.7}, Distance{1.3, 2.0}, Distance{2.5, 2.95}}) {
    const auto highest = [&, from = from, to = to](double u_from, double u_to) {
      return HighestAcross(plane, bottom, u_from, u_to, from, to);
    };
    const double rise = slow_before, fall = 1 - slow_after;
    if (highest(rise - kReach, rise + kReach) > kMark &&
        highest(fall - kReach, fall + kReach) > kMark &&
        highest(rise + kReach, fall - kReach) < kNone) {
      return true;
    }
  }
  return false;
}

// Bar along all lines beside their ends, by its distance outwards; it may lean.
struct Bar {
  double out_px = 0;
  double lean = 0;     // px outwards per px downwards
  double support = 0;  // share of the spaces between lines beside which it is seen
};

double OutOf(const Bar& bar, const Plane& plane, double y) {
  return bar.out_px + bar.lean * (y - plane.pattern().left_inner.centre);
}

// Finds the best place for a bar at one side.
Bar BarBeside(const Plane& plane, bool right) {
  const LinePattern& pattern = plane.pattern();
  constexpr double kFarthest_mm = 11, kFilled = 0.5, kMostLean = 0.08, kLeanStep = 0.01;
  const double outwards = right ? 1 : -1;
  const double step = std::max(1.0, pattern.bead_px / 4);
  const double x_end = plane.X(right, pattern.left_inner.centre);
  const auto outs = static_cast<std::size_t>(plane.px_of(kFarthest_mm) / step);
  std::vector<double> ys;
  std::vector<std::vector<char>> filled;  // per space, by distance
  for (std::size_t i = 0; i + 1 < pattern.rungs.size(); ++i) {
    const double y = plane.SpaceY(i, x_end), end = plane.X(right, y);
    const double plate = plane.Mean(end - outwards * plane.px_of(4), y);
    ys.push_back(y);
    filled.emplace_back();
    for (std::size_t k = 0; k < outs; ++k) {
      const double x = end + outwards * step * static_cast<double>(k);
      filled.back().push_back(plane.Holds(x, y) &&
                              plane.Mean(x, y) - plate > kFilled * plane.rise());
    }
  }
  // The most upright of the best, and the middle of a thick one.
  Bar best;
  for (int i = 0; i <= 2 * static_cast<int>(kMostLean / kLeanStep); ++i) {
    const double lean = (i % 2 == 0 ? 1 : -1) * ((i + 1) / 2) * kLeanStep;
    double last_best_px = 0;
    for (std::size_t k = 0; k < outs; ++k) {
      const Bar bar{step * static_cast<double>(k), lean, 0};
      double count = 0;
      for (std::size_t space = 0; space < ys.size(); ++space) {
        const auto at = std::lround(OutOf(bar, plane, ys[space]) / step);
        count += at >= 0 && at < std::ssize(filled[space]) &&
                 filled[space][static_cast<std::size_t>(at)] != 0;
      }
      const double support = count / static_cast<double>(ys.size());
      if (support > best.support) {
        best = {bar.out_px, lean, support};
        last_best_px = bar.out_px;
      } else if (support == best.support && lean == best.lean &&
                 bar.out_px < last_best_px + 1.5 * step) {
        best.out_px += step / 2;
        last_best_px = bar.out_px;
      }
    }
  }
  return best;
}

constexpr double kBar = 0.7, kNoBar = 0.35;  // support

// True if a bar goes on beyond an outer line by nearly the distance to a next one.
bool BarGoesOn(const Plane& plane, bool right, const Bar& bar, bool bottom) {
  constexpr double kFrom = 0.65, kTo = 0.9, kFilled = 0.5;
  const double outwards = right ? 1 : -1;
  double sum = 0;
  int count = 0;
  for (double d = kFrom; d <= kTo; d += 0.05, ++count) {
    const double y = plane.BeyondY(bottom, plane.X(right, plane.pattern().left_inner.centre), d);
    const double x = plane.X(right, y);
    sum += plane.Mean(x + outwards * OutOf(bar, plane, y), y) -
           plane.Mean(x - outwards * plane.px_of(4), y);
  }
  return sum / count > kFilled * plane.rise();
}

// Bars at the left and right.
using Bars = std::array<Bar, 2>;

// Returns whether the last line is at the bottom, where bars go on beyond it alone.
std::optional<bool> LastByBars(const Plane& plane, const Bars& bars) {
  std::optional<bool> last;
  for (const bool right : {false, true}) {
    const Bar& bar = bars[right];
    if (bar.support < kBar) continue;
    const bool above = BarGoesOn(plane, right, bar, false);
    const bool below = BarGoesOn(plane, right, bar, true);
    if (above == below) continue;
    if (last && *last != below) return std::nullopt;
    last = below;
  }
  return last;
}

// Share of filament in the place of numbers beside an end, at the height of a line.
double FilledBeside(const Plane& plane, bool right, std::size_t rung) {
  constexpr double kFrom_mm = 1.5, kTo_mm = 9.5, kHigh = 0.33, kFilled = 0.5;
  const LinePattern& pattern = plane.pattern();
  const double outwards = right ? 1 : -1;
  const double middle = pattern.rungs[rung](plane.X(right, pattern.left_inner.centre));
  double filled = 0, all = 0;
  for (double d = -kHigh; d <= kHigh; d += 0.06) {
    const double y = middle + d * pattern.pitch_px, end = plane.X(right, y);
    std::vector<double> row;
    for (double mm = kFrom_mm; mm < kTo_mm; mm += 0.2) {
      const double x = end + outwards * plane.px_of(mm);
      if (plane.Holds(x, y)) row.push_back(plane.Mean(x, y));
    }
    if (row.empty()) continue;
    // The space inside the ends, which a filled box outside does not change.
    const double space = plane.Mean(end - outwards * plane.px_of(4),
                                    middle + (d < 0 ? -0.5 : 0.5) * pattern.pitch_px);
    filled += static_cast<double>(std::ranges::count_if(
        row, [&](double value) { return value - space > kFilled * plane.rise(); }));
    all += static_cast<double>(row.size());
  }
  return all > 0 ? filled / all : 0;
}

// Filament beside the ends of the first, third, ... line from the top, and of the others.
struct Beside {
  double even = 0, odd = 0;

  // A box for numbers fills nearly all.
  [[nodiscard]] bool box() const { return even > 0.6 && odd > 0.6; }
  // Numbers stand beside every second line.
  [[nodiscard]] bool numbers() const {
    constexpr double kLeast = 0.02, kClear = 2.5;
    return !box() && std::max(even, odd) > kLeast &&
           std::max(even, odd) > kClear * std::min(even, odd);
  }
};

Beside LookBeside(const Plane& plane, bool right) {
  std::array<std::vector<double>, 2> shares;
  int place = 0;
  for (std::size_t i = 0; i < plane.pattern().rungs.size(); ++i) {
    shares[static_cast<std::size_t>(place % 2)].push_back(FilledBeside(plane, right, i));
    if (i < plane.pattern().steps.size()) place += plane.pattern().steps[i];
  }
  // Medians: a string or a reflection is beside few lines.
  const auto usual = [](const std::vector<double>& of) { return of.empty() ? 0 : Median(of); };
  return {usual(shares[0]), usual(shares[1])};
}

// Returns whether the ends are on the right: where a box or numbers are; a bar at only one side is
// where the lines begin.
std::optional<bool> EndAtRight(const Beside& left, const Beside& right, const Bars& bars) {
  if (left.box() != right.box()) return right.box();
  if (left.numbers() != right.numbers()) return right.numbers();
  for (const bool at_right : {false, true}) {
    if (bars[at_right].support > kBar && bars[!at_right].support < kNoBar) return !at_right;
  }
  return std::nullopt;
}

// Returns whether the last line is at the bottom, from numbers beside every second line from the
// first on, if the number of lines is even.
std::optional<bool> LastByNumbers(const LinePattern& pattern, const Beside& beside) {
  int places = 1;
  for (const int step : pattern.steps) places += step;
  if (!beside.numbers() || places % 2 != 0) return std::nullopt;
  return beside.even > beside.odd;
}

}  // namespace

PrintedSigns FindPrintedSigns(const GrayImage& contrast, const LinePattern& pattern,
                              double slow_before, double slow_after) {
  PrintedSigns signs;
  const Plane plane(contrast, pattern);
  if (!(plane.rise() > 0) || pattern.rungs.size() < 4) return signs;
  const bool above = HasMarks(plane, false, slow_before, slow_after);
  const bool below = HasMarks(plane, true, slow_before, slow_after);
  Bars bars{BarBeside(plane, false), BarBeside(plane, true)};
  const Beside left = LookBeside(plane, false), right = LookBeside(plane, true);
  signs.end_at_right = EndAtRight(left, right, bars);
  if (above != below) {
    signs.last_at_bottom = below;
  } else if (signs.end_at_right) {
    signs.last_at_bottom = LastByNumbers(pattern, *signs.end_at_right ? right : left);
  }
  if (!signs.last_at_bottom && !above && !below) {
    if (left.box()) bars[0] = {};
    if (right.box()) bars[1] = {};
    signs.last_at_bottom = LastByBars(plane, bars);
  }
  return signs;
}

}  // namespace trammel::pressure_advance
