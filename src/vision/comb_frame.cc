#include "vision/comb_frame.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "base/statistics.h"

namespace trammel::vision {
namespace {

constexpr double kPlate = 0.25, kFilament = 0.75;  // of what lies along a line

// What lies beyond an outer line, as distances from it.
class Beyond {
 public:
  Beyond(const GrayImage& contrast, const GrayImage& seen, const LinePattern& pattern,
         bool beyond_last)
      : contrast_(contrast),
        seen_(seen),
        outer_(beyond_last ? pattern.rungs.back() : pattern.rungs.front()),
        away_(beyond_last ? 1 : -1),
        bead_px_(pattern.bead_px) {
    const double y = outer_(contrast.width / 2.0);
    left_px_ = pattern.left_inner(y);
    right_px_ = pattern.right_inner(y);
    LearnLevels(pattern, beyond_last);
  }

  // Share of filament along the columns x_from … x_to, in pieces of a bead
  // whose means count: a plate is grainy. Nothing where most is not shown.
  [[nodiscard]] std::optional<double> Filament(double x_from, double x_to, double d_from,
                                               double d_to) const {
    const int pieces = std::max(1, static_cast<int>((x_to - x_from) / bead_px_));
    int shown = 0, filament = 0;
    for (int piece = 0; piece < pieces; ++piece) {
      const double length = (x_to - x_from) / pieces;
      const double from = x_from + piece * length;
      std::vector<double> values;
      int all = 0;
      for (double d = d_from; d <= d_to; d += 1) {
        for (double x = from; x < from + length; x += 1, ++all) {
          Read(x, outer_(x) + away_ * d, values);
        }
      }
      if (values.empty() || static_cast<double>(values.size()) < kLeastShown * all) continue;
      ++shown;
      filament += Mean(values) > HalfAt(from + length / 2);
    }
    if (shown < kLeastShown * pieces) return std::nullopt;
    return static_cast<double>(filament) / shown;
  }

  [[nodiscard]] double left_px() const { return left_px_; }
  [[nodiscard]] double right_px() const { return right_px_; }

 private:
  static constexpr double kLeastShown = 0.8;
  static constexpr std::size_t kZones = 12;  // along the line: light is uneven

  void LearnLevels(const LinePattern& pattern, bool beyond_last) {
    const std::size_t last = pattern.rungs.size() - 1;
    const std::size_t lines = std::min<std::size_t>(4, last);
    for (std::size_t zone = 0; zone < kZones; ++zone) {
      std::vector<double> filament, plate;
      const double length = (right_px_ - left_px_) / kZones;
      for (double x = left_px_ + length * static_cast<double>(zone);
           x < left_px_ + length * static_cast<double>(zone + 1); x += 1) {
        for (std::size_t i = 0; i < lines; ++i) {
          Read(x, pattern.rungs[beyond_last ? last - i : i](x), filament);
        }
        // Of the plate beyond the line, where glare may make it brighter than
        // between the lines.
        for (double d = 0.45 * pattern.pitch_px; d <= 0.75 * pattern.pitch_px; d += 1) {
          Read(x, outer_(x) + away_ * d, plate);
        }
      }
      // A line may be torn for a good part.
      constexpr double kWhole = 0.65;
      half_.push_back(plate.empty() || filament.empty()
                          ? std::numeric_limits<double>::infinity()
                          : (Mean(plate) + Quantile(filament, kWhole)) / 2);
    }
  }

  void Read(double x, double y, std::vector<double>& values) const {
    const auto column = std::lround(x), row = std::lround(y);
    if (column < 0 || row < 0 || column >= contrast_.width || row >= contrast_.height) return;
    if (seen_.row(static_cast<int>(row))[column] <= 0.5F) return;
    values.push_back(contrast_.row(static_cast<int>(row))[column]);
  }

  [[nodiscard]] double HalfAt(double x) const {
    const double zone = (x - left_px_) / (right_px_ - left_px_) * kZones;
    return half_[static_cast<std::size_t>(std::clamp(zone, 0.0, kZones - 1.0))];
  }

  const GrayImage& contrast_;
  const GrayImage& seen_;
  const Curve& outer_;
  double away_, bead_px_;
  double left_px_ = 0, right_px_ = 0;
  std::vector<double> half_;  // between plate and filament, per zone
};

struct Bar {
  double begin_px = 0, end_px = 0;  // distances from the outer line
};

// Plate all along from beside the line on, then filament all along, then plate.
std::optional<Bar> FindBar(const Beyond& beyond, double pitch_px, double bead_px) {
  constexpr double kFirst = 0.6, kFarthest = 3.2;  // pitches
  constexpr double kBarEnds = 0.6;                 // glare may whiten a part of the plate beyond
  const double from = beyond.left_px() + 0.5 * bead_px, to = beyond.right_px() - 0.5 * bead_px;
  std::optional<double> begin;
  double between_px = 0;  // rows that are neither
  for (double d = kFirst * pitch_px; d < kFarthest * pitch_px; d += 1) {
    const auto share = beyond.Filament(from, to, d, d);
    if (!share) return std::nullopt;
    const bool neither = *share > kPlate && *share < kFilament;
    between_px = neither ? between_px + 1 : 0;
    if (between_px > 0.6 * bead_px)
      return std::nullopt;  // a torn line, or one that is not parallel
    if (!begin && *share >= kFilament) begin = d;
    if (begin && *share <= kBarEnds) {
      const double thick_px = d - *begin;
      if (thick_px < 0.4 * bead_px || thick_px > 2.5 * bead_px) return std::nullopt;
      return Bar{*begin, d};
    }
  }
  return std::nullopt;
}

}  // namespace

bool FrameCloses(const GrayImage& contrast, const GrayImage& seen, const LinePattern& pattern,
                 bool beyond_last) {
  if (pattern.rungs.size() < 3 || !pattern.left_seen || !pattern.right_seen) return false;
  const double bead_px = pattern.bead_px;
  const Beyond beyond(contrast, seen, pattern, beyond_last);
  if (!(beyond.right_px() - beyond.left_px() > 4 * bead_px)) return false;
  const auto bar = FindBar(beyond, pattern.pitch_px, bead_px);
  if (!bar) return false;
  bool ends = false;  // either rail; under glare the other may seem to go on, as
                      // the plate does
  for (const bool left : {true, false}) {
    const double inner = left ? beyond.left_px() : beyond.right_px();
    const double a = inner + (left ? -0.7 : 0.2) * bead_px;
    const double b = inner + (left ? -0.2 : 0.7) * bead_px;
    for (double d = 0.5 * pattern.pitch_px; d < bar->end_px - 0.5 * bead_px; d += 0.5 * bead_px) {
      if (beyond.Filament(a, b, d, d + 0.5 * bead_px).value_or(0) < kFilament) return false;
    }
    const double from = bar->end_px + 0.1 * bead_px, to = bar->end_px + 0.35 * bead_px;
    const auto on_rail = beyond.Filament(a, b, from, to);
    const double inwards = (left ? 1.5 : -1.5) * bead_px;
    const auto inside = beyond.Filament(a + inwards, b + inwards, from, to);
    if (!on_rail || !inside) continue;
    if (*on_rail > kPlate && *inside <= kPlate) return false;
    ends |= *on_rail <= kPlate;
  }
  return ends;
}

}  // namespace trammel::vision
