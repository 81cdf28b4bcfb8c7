#include "vision/comb_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/statistics.h"
#include "vision/comb_ends.h"
#include "vision/line_pattern.h"

namespace trammel::vision {
namespace {

constexpr double kPlate = 0.25, kFilament = 0.75;  // filament's share along a line

// Contrast beyond an outer line, by distance from it.
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

  // Returns the share of filament along the columns x_from … x_to, from the means of pieces of a
  // bead's size, since a plate is grainy. Absent if most is not visible.
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
      if (values.empty() || static_cast<double>(values.size()) < kMinShown * all) continue;
      ++shown;
      filament += Mean(values) > HalfAt(from + length / 2);
    }
    if (shown < kMinShown * pieces) return std::nullopt;
    return static_cast<double>(filament) / shown;
  }

  [[nodiscard]] double left_px() const { return left_px_; }
  [[nodiscard]] double right_px() const { return right_px_; }

 private:
  static constexpr double kMinShown = 0.8;
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
        // Samples of the plate beyond the line, where glare may make it brighter than between the
        // lines.
        for (double d = 0.45 * pattern.pitch_px; d <= 0.75 * pattern.pitch_px; d += 1) {
          Read(x, outer_(x) + away_ * d, plate);
        }
      }
      // A large part of a line may be broken.
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

// Plate all along from beside the line on, then filament all along, then plate: how far from the
// line it ends, px.
std::optional<double> EndOfBar(const Beyond& beyond, double pitch_px, double bead_px) {
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
      return d;
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
  const auto bar_end_px = EndOfBar(beyond, pattern.pitch_px, bead_px);
  if (!bar_end_px) return false;
  bool ends = false;  // either rail; under glare the other may seem to go on, as
                      // the plate does
  for (const bool left : {true, false}) {
    const double inner = left ? beyond.left_px() : beyond.right_px();
    const double a = inner + (left ? -0.7 : 0.2) * bead_px;
    const double b = inner + (left ? -0.2 : 0.7) * bead_px;
    for (double d = 0.5 * pattern.pitch_px; d < *bar_end_px - 0.5 * bead_px; d += 0.5 * bead_px) {
      if (beyond.Filament(a, b, d, d + 0.5 * bead_px).value_or(0) < kFilament) return false;
    }
    const double from = *bar_end_px + 0.1 * bead_px, to = *bar_end_px + 0.35 * bead_px;
    const auto on_rail = beyond.Filament(a, b, from, to);
    const double inwards = (left ? 1.5 : -1.5) * bead_px;
    const auto inside = beyond.Filament(a + inwards, b + inwards, from, to);
    if (!on_rail || !inside) continue;
    if (*on_rail > kPlate && *inside <= kPlate) return false;
    ends |= *on_rail <= kPlate;
  }
  return ends;
}

namespace {

constexpr int kZones = 40;  // across the picture

bool IsSeen(const GrayImage& seen, double x, double y) {
  const int column = static_cast<int>(std::lround(x)), row = static_cast<int>(std::lround(y));
  return column >= 0 && row >= 0 && column < seen.width && row < seen.height &&
         seen.row(row)[column] > 0.5F;
}

// Trace of one place.
struct Rung {
  int place = 0;
  Curve track;
  Columns seen;                      // plate on both sides
  int found = 0;                     // zones in which something stands out
  int zones = 0;                     // zones seen
  double height = 0;                 // median
  double width_px = 0;               // median
  double left_px = 0, right_px = 0;  // outer zones in which something stands out
  double roughness_px = 0;           // median deviation from the track
};

// Returns the longest range of columns in which a track and the plate beside it are visible.
Columns SeenAlong(const GrayImage& seen, const Curve& track, double pitch_px) {
  Columns longest, stretch;
  const double reach = 0.6 * pitch_px;
  for (int x = 0; x < seen.width; ++x) {
    const double y = track(x);
    if (!IsSeen(seen, x, y - reach) || !IsSeen(seen, x, y + reach)) {
      stretch = {x + 1, x};
      continue;
    }
    stretch.to_px = x;
    if (stretch.to_px - stretch.from_px > longest.to_px - longest.from_px) longest = stretch;
  }
  return longest;
}

Rung TraceRung(const GrayImage& contrast, const GrayImage& seen, int place, double y_px,
               double pitch_px, double min_height) {
  constexpr double kOff = 0.28;  // pitches: what a lens bends
  Rung rung;
  rung.place = place;
  std::vector<double> x_px, y_found, heights, widths;
  for (int zone = 0; zone < kZones; ++zone) {
    const int x0 = contrast.width * zone / kZones, x1 = contrast.width * (zone + 1) / kZones;
    const double x = (x0 + x1 - 1) / 2.0;
    if (x1 <= x0 || !IsSeen(seen, x, y_px - 0.6 * pitch_px) ||
        !IsSeen(seen, x, y_px + 0.6 * pitch_px)) {
      continue;
    }
    ++rung.zones;
    const auto section = SectionOfRung(contrast, x0, x1, y_px, pitch_px);
    // A feature as wide as the pitch is a rail, not a line.
    if (!section || section->height < min_height || section->width_px > 0.7 * pitch_px ||
        std::abs(section->middle_px - y_px) > kOff * pitch_px) {
      continue;
    }
    x_px.push_back(x);
    y_found.push_back(section->middle_px);
    heights.push_back(section->height);
    widths.push_back(section->width_px);
  }
  rung.found = static_cast<int>(x_px.size());
  if (x_px.empty()) return rung;
  rung.track = FitCurve(x_px, y_found, contrast.width / 2.0, contrast.width / 2.0);
  std::vector<double> off;
  for (std::size_t i = 0; i < x_px.size(); ++i)
    off.push_back(std::abs(y_found[i] - rung.track(x_px[i])));
  rung.roughness_px = Median(off);
  rung.height = Median(heights);
  rung.width_px = Median(widths);
  rung.left_px = x_px.front();
  rung.right_px = x_px.back();
  rung.seen = SeenAlong(seen, rung.track, pitch_px);
  return rung;
}

// Typical values of the places that were found.
struct UsualRung {
  double height = 0, width_px = 0, share = 0;
};

// Rejects texture of the plate, which is lower, thinner, rougher, or broken more often.
bool IsLine(const Rung& rung, const UsualRung& usual, double pitch_px) {
  constexpr int kFewestZones = 4;
  constexpr double kMin = 0.35, kMinShare = 0.6, kRoughest = 0.07;
  return rung.found >= kFewestZones && rung.found >= kMinShare * usual.share * rung.zones &&
         rung.height > kMin * usual.height && rung.width_px > kMin * usual.width_px &&
         rung.roughness_px < kRoughest * pitch_px;
}

std::vector<Rung> TraceRungs(const GrayImage& contrast, const GrayImage& seen,
                             const CombPlaces& places) {
  std::vector<Rung> rungs;
  std::vector<double> heights, widths, shares;
  const auto y_of = [&](int place) { return places.first_y_px + place * places.pitch_px; };
  for (int place = 0; place < places.count; ++place) {
    const Rung rung = TraceRung(contrast, seen, place, y_of(place), places.pitch_px, 0);
    if (rung.found == 0) continue;
    heights.push_back(rung.height);
    widths.push_back(rung.width_px);
    shares.push_back(static_cast<double>(rung.found) / rung.zones);
  }
  if (heights.empty()) return {};
  const UsualRung usual{Median(heights), Median(widths), Median(shares)};
  constexpr int kBeyond = 2;
  for (int place = -kBeyond; place < places.count + kBeyond; ++place) {
    Rung rung = TraceRung(contrast, seen, place, y_of(place), places.pitch_px, 0.35 * usual.height);
    if (IsLine(rung, usual, places.pitch_px)) rungs.push_back(rung);
  }
  return rungs;
}

// Finds where, from inside the comb towards a side, the space between two lines is as bright as
// they are.
std::optional<double> RailEdge(const std::vector<double>& values, const Columns& seen, int from,
                               int direction, double half, double bead_px) {
  const int least = std::max(2, static_cast<int>(0.5 * bead_px));
  for (int x = from; seen.Hold(x + direction * least); x += direction) {
    const double a = values[static_cast<std::size_t>(x)];
    const double b = values[static_cast<std::size_t>(x + direction)];
    if (!(a <= half && b > half)) continue;
    bool follows = true;
    for (int k = 1; k <= least; ++k) {
      follows &= values[static_cast<std::size_t>(x + direction * k)] > half;
    }
    if (follows) return x + direction * (half - a) / (b - a);
  }
  return std::nullopt;
}

// Inner edge of a rail as seen between the lines.
struct Rail {
  std::vector<double> x_px, y_px;
  std::vector<double> unseen_from_px;  // where an edgeless space leaves the photo
};

struct Rails {
  Rail left, right;
};

Rails LookForRails(const GrayImage& contrast, const std::vector<Rung>& rungs, double pitch_px,
                   double height, double bead_px) {
  Rails rails;
  for (std::size_t i = 0; i + 1 < rungs.size(); ++i) {
    const Rung &above = rungs[i], &below = rungs[i + 1];
    if (below.place - above.place != 1) continue;
    const Columns seen{std::max(above.seen.from_px, below.seen.from_px),
                       std::min(above.seen.to_px, below.seen.to_px)};
    const int left = static_cast<int>(std::max(above.left_px, below.left_px));
    const int right = static_cast<int>(std::min(above.right_px, below.right_px));
    if (right - left < 4 || !seen.Hold(left) || !seen.Hold(right)) continue;
    const std::vector<double> values =
        BoxMean(BetweenRungs(contrast, above.track, below.track, pitch_px),
                std::max(1, static_cast<int>(bead_px / 6)));
    // Start well inside: the lines' ends may be hidden by the rail's fillets.
    const int inside = std::max(1, (right - left) / 4);
    for (const int direction : {-1, 1}) {
      Rail& rail = direction < 0 ? rails.left : rails.right;
      const int from = direction < 0 ? left + inside : right - inside;
      // Level of the half beside the rail: light is uneven along the lines.
      const int middle = (left + right) / 2;
      const double plate = direction < 0
                               ? Quantile({values.begin() + left, values.begin() + middle}, 0.4)
                               : Quantile({values.begin() + middle, values.begin() + right}, 0.4);
      const double half = plate + height / 2;
      const auto edge = RailEdge(values, seen, from, direction, half, bead_px);
      if (edge) {
        rail.x_px.push_back(*edge);
        rail.y_px.push_back((above.track(*edge) + below.track(*edge)) / 2);
      } else {
        rail.unseen_from_px.push_back(direction < 0 ? seen.from_px : seen.to_px);
      }
    }
  }
  return rails;
}

// Fits a straight line through most of a rail's edges; absent if they are not collinear, or if
// several spaces show plate on its far side.
std::optional<Curve> FitRail(const Rail& rail, int direction, double height_px, double pitch_px,
                             double bead_px) {
  constexpr std::size_t kFewest = 3;
  const std::size_t n = rail.x_px.size();
  if (n < kFewest) return std::nullopt;
  // Repeated medians: half of the edges may be wrong.
  std::vector<double> slopes;
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<double> of_one;
    for (std::size_t k = 0; k < n; ++k) {
      const double apart = rail.y_px[k] - rail.y_px[i];
      if (std::abs(apart) > 0.5 * pitch_px) {
        of_one.push_back((rail.x_px[k] - rail.x_px[i]) / apart);
      }
    }
    if (!of_one.empty()) slopes.push_back(Median(of_one));
  }
  if (slopes.empty()) return std::nullopt;
  const double slope = Median(slopes), centre = height_px / 2;
  std::vector<double> offsets;
  for (std::size_t i = 0; i < n; ++i) {
    offsets.push_back(rail.x_px[i] - slope * (rail.y_px[i] - centre));
  }
  const double offset = Median(offsets);
  std::vector<double> x_on, y_on;
  for (std::size_t i = 0; i < n; ++i) {
    if (std::abs(offsets[i] - offset) > 0.6 * bead_px) continue;
    x_on.push_back(rail.x_px[i]);
    y_on.push_back(rail.y_px[i]);
  }
  std::size_t passed = 0;  // spaces that reach beyond the rail and do not show it
  for (const double x : rail.unseen_from_px) passed += direction * (x - offset) > bead_px;
  if (x_on.size() < kFewest || x_on.size() < (n + passed) / 2) return std::nullopt;
  constexpr std::size_t kEnoughForBow = 8;
  if (x_on.size() >= kEnoughForBow) return FitCurve(y_on, x_on, centre, centre);
  return Curve{centre, centre, offset, slope * centre, 0};
}

// Returns the plate's level between two lines, of the half beside a rail: light is uneven along the
// lines.
double PlateBetween(const GrayImage& contrast, const Rung& above, const Rung& below,
                    double pitch_px, int direction) {
  const std::vector<double> values = BetweenRungs(contrast, above.track, below.track, pitch_px);
  auto left = static_cast<std::ptrdiff_t>(std::min(above.left_px, below.left_px));
  auto right = static_cast<std::ptrdiff_t>(std::max(above.right_px, below.right_px));
  const std::ptrdiff_t middle = (left + right) / 2;
  (direction > 0 ? left : right) = middle;
  return Median(std::vector<double>(values.begin() + left, values.begin() + right + 1));
}

// True if most lines reach a rail. The spaces between the lines do not: there the frame's bar is in
// between, and the apparent rail is the plate outside.
bool LinesReach(const GrayImage& contrast, const std::vector<Rung>& rungs, const Curve& inner,
                int direction, double pitch_px, double bead_px, double height) {
  int reaching = 0, looked_at = 0;
  for (std::size_t i = 0; i < rungs.size(); ++i) {
    const double rail = inner(rungs[i].track(inner(contrast.height / 2.0)));
    const double half =
        PlateBetween(contrast, rungs[i > 0 ? i - 1 : 1], rungs[i], pitch_px, direction) +
        height / 2;
    double sum = 0;
    int count = 0;
    for (double in = 0.2 * bead_px; in <= 0.9 * bead_px; in += 1) {
      const double x = rail - direction * in, y = rungs[i].track(x);
      if (!rungs[i].seen.Hold(x) || y < 0 || y > contrast.height - 1) continue;
      sum += contrast.row(static_cast<int>(std::lround(y)))[std::lround(x)];
      ++count;
    }
    if (count == 0) continue;
    ++looked_at;
    reaching += sum / count > half;
  }
  constexpr double kMinShare = 0.6;
  return looked_at > 0 && reaching >= kMinShare * looked_at;
}

// True if a rail continues beside a place; nothing if the photo does not show it.
std::optional<bool> RailGoesOn(const GrayImage& contrast, const GrayImage& seen, const Curve& inner,
                               int direction, double y_from, double y_to, double bead_px,
                               double half) {
  double sum = 0;
  int count = 0, places = 0;
  for (double y = std::min(y_from, y_to); y <= std::max(y_from, y_to); y += 1) {
    for (double out = 0.2 * bead_px; out <= 0.8 * bead_px; out += 1) {
      ++places;
      const double x = inner(y) + direction * out;
      if (!IsSeen(seen, x, y)) continue;
      sum += contrast.row(static_cast<int>(std::lround(y)))[std::lround(x)];
      ++count;
    }
  }
  if (count <= places / 2) return std::nullopt;
  return sum / count > half;
}

// Drops outer lines beyond which no rail continues: a bar of the frame and features outside of it.
// A bar mistaken for a line would shift the values of all.
// @returns how many of them may be lines: the photo does not show the rails there.
int DropBars(const GrayImage& contrast, const GrayImage& seen, const std::optional<Curve>& left,
             const std::optional<Curve>& right, double pitch_px, double bead_px, double height,
             std::vector<Rung>& rungs) {
  int doubtful = 0;
  for (const bool at_top : {true, false}) {
    while (rungs.size() >= 3) {
      const Rung& outer = at_top ? rungs.front() : rungs.back();
      const Rung& next = at_top ? rungs[1] : rungs[rungs.size() - 2];
      const double away = at_top ? -1 : 1;
      // Beyond a bar of the frame, at most two beads thick; rails may end soon beyond the last
      // line.
      const double from_px = std::min(0.45 * pitch_px, 1.5 * bead_px);
      const double to_px = std::min(0.7 * pitch_px, 2.5 * bead_px);
      bool goes_on = false, shown = false;
      for (const int direction : {-1, 1}) {
        const std::optional<Curve>& rail = direction < 0 ? left : right;
        if (!rail) continue;
        const double y = outer.track((*rail)(outer.track(contrast.width / 2.0)));
        const double half = PlateBetween(contrast, outer, next, pitch_px, direction) + height / 2;
        const auto on = RailGoesOn(contrast, seen, *rail, direction, y + away * from_px,
                                   y + away * to_px, bead_px, half);
        shown |= on.has_value();
        goes_on |= on.value_or(false);
      }
      if (goes_on) break;
      // Beyond an empty place it is a bar, or a line in excess by the count.
      doubtful += !shown && std::abs(outer.place - next.place) == 1;
      rungs.erase(at_top ? rungs.begin() : std::prev(rungs.end()));
    }
  }
  return doubtful;
}

// True if the photo ends so far before the next place beyond an outer line that a line there would
// not be traced.
bool CutBeside(const GrayImage& seen, const Rung& outer, double away_px) {
  int shown = 0, columns = 0;
  for (double x = outer.left_px; x <= outer.right_px; x += 1) {
    ++columns;
    shown += IsSeen(seen, x, outer.track(x) + away_px);
  }
  return 2 * shown < columns;
}

// Returns an invisible rail as the other one shifted to where the lines leave the photo.
Curve BesideLines(const Curve& other, const std::vector<Rung>& rungs, int direction) {
  double shift = 0;
  for (const Rung& rung : rungs) {
    const double end = direction < 0 ? rung.seen.from_px : rung.seen.to_px;
    shift = std::max(shift, direction * (end - other(rung.track(end))));
  }
  Curve curve = other;
  curve.c0 += direction * shift;
  return curve;
}

// Level and width that most lines have.
struct UsualLine {
  double height = 0, bead_px = 0;
};

UsualLine UsualOf(const std::vector<Rung>& rungs) {
  std::vector<double> heights, widths;
  for (const Rung& rung : rungs) {
    heights.push_back(rung.height);
    widths.push_back(rung.width_px);
  }
  return {Median(heights), Median(widths)};
}

void Describe(const GrayImage& seen, const std::vector<Rung>& rungs,
              const std::optional<Curve>& left, const std::optional<Curve>& right,
              LinePattern& pattern) {
  for (std::size_t i = 0; i < rungs.size(); ++i) {
    pattern.rungs.push_back(rungs[i].track);
    pattern.seen.push_back(rungs[i].seen);
    if (i > 0) pattern.steps.push_back(rungs[i].place - rungs[i - 1].place);
  }
  constexpr double kNextTraced = 1.6;  // pitches: a place and what is looked at beside it
  pattern.first_cut = CutBeside(seen, rungs.front(), -kNextTraced * pattern.pitch_px);
  pattern.last_cut = CutBeside(seen, rungs.back(), kNextTraced * pattern.pitch_px);
  pattern.left_seen = left.has_value();
  pattern.right_seen = right.has_value();
  pattern.left_inner = left ? *left : BesideLines(*right, rungs, -1);
  pattern.right_inner = right ? *right : BesideLines(*left, rungs, 1);
}

// Finds both ends of lines that no frame contains. Drops outer features that end where no line
// does: the plate's edge, a shadow, texture.
LinePattern WithFreeEnds(const GrayImage& contrast, const GrayImage& seen, std::vector<Rung> rungs,
                         LinePattern pattern) {
  std::vector<CombLine> lines;
  for (const Rung& rung : rungs) lines.push_back({rung.track, rung.seen});
  const CombEnds left = FindCombEnds(contrast, lines, pattern.pitch_px, pattern.bead_px, -1);
  const CombEnds right = FindCombEnds(contrast, lines, pattern.pitch_px, pattern.bead_px, 1);
  const auto leaves = [&](const CombEnds& ends) { return 2 * ends.cut > lines.size(); };
  if ((!left.x_px && !leaves(left)) || (!right.x_px && !leaves(right)) ||
      (!left.x_px && !right.x_px)) {
    pattern.problem = fmt::format("{} equally spaced lines are seen, but not where they {}",
                                  rungs.size(), left.x_px ? "end" : "begin");
    return pattern;
  }
  std::size_t first = 0, last = rungs.size();
  const auto ends = [&](std::size_t i) { return left.ends_here[i] || right.ends_here[i]; };
  while (first < last && !ends(first)) ++first;
  while (last > first && !ends(last - 1)) --last;
  if (last - first < 3) {
    pattern.problem =
        fmt::format("only {} of {} lines end side by side", last - first, rungs.size());
    return pattern;
  }
  std::size_t ended = 0;
  for (std::size_t i = first; i < last; ++i) {
    ended += (!left.x_px || left.ends_here[i]) && (!right.x_px || right.ends_here[i]);
  }
  pattern.ended = static_cast<double>(ended) / static_cast<double>(last - first);
  rungs.erase(rungs.begin() + static_cast<std::ptrdiff_t>(last), rungs.end());
  rungs.erase(rungs.begin(), rungs.begin() + static_cast<std::ptrdiff_t>(first));
  Describe(seen, rungs, left.x_px, right.x_px, pattern);
  return pattern;
}

}  // namespace

LinePattern TraceComb(const GrayImage& contrast, const GrayImage& seen, const CombPlaces& places,
                      bool framed) {
  TRAMMEL_CHECK(contrast.width == seen.width && contrast.height == seen.height &&
                    places.pitch_px > 0 && places.count >= 2 && contrast.width >= kZones,
                "{} x {} and {} x {}, {} places {} px apart", contrast.width, contrast.height,
                seen.width, seen.height, places.count, places.pitch_px);
  LinePattern pattern;
  std::vector<Rung> rungs = TraceRungs(contrast, seen, places);
  if (rungs.size() < 3) {
    pattern.problem = fmt::format("{} equally spaced lines can be traced", rungs.size());
    return pattern;
  }
  const auto [height, bead_px] = UsualOf(rungs);
  const double pitch_px = pattern.pitch_px = places.pitch_px;
  pattern.bead_px = bead_px;
  if (!framed) return WithFreeEnds(contrast, seen, std::move(rungs), std::move(pattern));
  const Rails rails = LookForRails(contrast, rungs, pitch_px, height, bead_px);
  auto left = FitRail(rails.left, -1, contrast.height, pitch_px, bead_px);
  auto right = FitRail(rails.right, 1, contrast.height, pitch_px, bead_px);
  if (left && !LinesReach(contrast, rungs, *left, -1, pitch_px, bead_px, height)) left.reset();
  if (right && !LinesReach(contrast, rungs, *right, 1, pitch_px, bead_px, height)) right.reset();
  if (!left && !right) {
    pattern.problem = fmt::format(
        "{} equally spaced lines are seen, but neither of the frame's bars across their ends",
        rungs.size());
    return pattern;
  }
  pattern.doubtful = DropBars(contrast, seen, left, right, pitch_px, bead_px, height, rungs);
  Describe(seen, rungs, left, right, pattern);
  pattern.first_closed = FrameCloses(contrast, seen, pattern, false);
  pattern.last_closed = FrameCloses(contrast, seen, pattern, true);
  return pattern;
}

}  // namespace trammel::vision
