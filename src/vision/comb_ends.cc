#include "vision/comb_ends.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::vision {
namespace {

// Place at which a line ceases to stand out, going outwards.
struct End {
  std::size_t line = 0;
  double x_px = 0, y_px = 0;
};

// Returns the line's brightness above the brighter of the two spaces beside it, for each column
// that is seen; smoothed along the line.
std::vector<double> AboveSpaces(const GrayImage& contrast, const CombLine& line, double pitch_px,
                                double bead_px) {
  constexpr double kCore = 0.2;                     // beads
  constexpr double kSpace = 0.42, kSpaceEnd = 0.5;  // pitches
  const auto mean = [&](int x, double from, double to) {
    double sum = 0;
    int count = 0;
    const double y = line.track(x);
    for (double off = from; off <= to || count == 0; off += 1, ++count) {
      const auto row = static_cast<int>(std::lround(y + off));
      sum += contrast.row(std::clamp(row, 0, contrast.height - 1))[x];
    }
    return sum / count;
  };
  std::vector<double> core, above, below;
  for (int x = line.seen.from_px; x <= line.seen.to_px; ++x) {
    core.push_back(mean(x, -kCore * bead_px, kCore * bead_px));
    above.push_back(mean(x, -kSpaceEnd * pitch_px, -kSpace * pitch_px));
    below.push_back(mean(x, kSpace * pitch_px, kSpaceEnd * pitch_px));
  }
  const int half = std::max(1, static_cast<int>(0.4 * bead_px));
  core = BoxMean(core, half);
  above = BoxMean(above, half);
  below = BoxMean(below, half);
  for (std::size_t i = 0; i < core.size(); ++i) core[i] -= std::max(above[i], below[i]);
  return core;
}

// Lists all places outwards of the line's middle at which a piece of it ends. False if the line
// stands out up to the photo's border.
bool EndsOf(const std::vector<double>& values, int direction, double bead_px,
            std::vector<double>& ends_px) {
  constexpr double kUsual = 0.7, kMost = 0.8;
  const int n = static_cast<int>(values.size());
  const int before = std::max(3, static_cast<int>(3 * bead_px));
  const int after = std::max(2, static_cast<int>(1.5 * bead_px));
  const double half = Quantile(values, kUsual) / 2;
  if (!(half > 0)) return true;
  std::vector<int> on_until(values.size() + 1, 0);
  for (int i = 0; i < n; ++i) on_until[i + 1] = on_until[i] + (values[i] > half);
  const auto share = [&](int from, int to) {
    return static_cast<double>(on_until[to] - on_until[from]) / (to - from);
  };
  for (int i = n / 2; i >= 0 && i < n; i += direction) {
    const int next = i + direction;
    if (next < 0 || next >= n || !(values[i] > half && values[next] <= half)) continue;
    const int in_from = direction > 0 ? i - before + 1 : i;
    const int out_from = direction > 0 ? next : next - after + 1;
    if (in_from < 0 || in_from + before > n || out_from < 0 || out_from + after > n) continue;
    if (share(in_from, in_from + before) < kMost) continue;
    if (share(out_from, out_from + after) > 1 - kMost) continue;
    ends_px.push_back(i + direction * (values[i] - half) / (values[i] - values[next]));
  }
  const int border = direction > 0 ? n - before : 0;
  return border >= 0 && border + before <= n && share(border, border + before) >= kMost;
}

// Returns the ends, at most one a line, on the straight line that most lines have one on.
std::vector<End> LargestRow(const std::vector<End>& ends, double near_px) {
  constexpr double kSteepest = 0.25;  // of the row from the columns' direction
  std::vector<End> best;
  for (std::size_t a = 0; a < ends.size(); ++a) {
    for (std::size_t b = a + 1; b < ends.size(); ++b) {
      if (ends[b].line < ends[a].line + 2) continue;
      const double slope = (ends[b].x_px - ends[a].x_px) / (ends[b].y_px - ends[a].y_px);
      if (!(std::abs(slope) < kSteepest)) continue;
      std::vector<End> row;
      for (const End& end : ends) {
        const double off = end.x_px - ends[a].x_px - slope * (end.y_px - ends[a].y_px);
        if (std::abs(off) > near_px) continue;
        if (row.empty() || row.back().line != end.line) row.push_back(end);
      }
      if (row.size() > best.size()) best = std::move(row);
    }
  }
  return best;
}

}  // namespace

CombEnds FindCombEnds(const GrayImage& contrast, std::span<const CombLine> lines, double pitch_px,
                      double bead_px, int direction) {
  TRAMMEL_CHECK(pitch_px > bead_px && bead_px > 0, "pitch {}, bead {}", pitch_px, bead_px);
  CombEnds found;
  found.ends_here.assign(lines.size(), false);
  std::vector<End> ends;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const CombLine& line = lines[i];
    if (line.seen.to_px - line.seen.from_px < 8 * bead_px) continue;
    std::vector<double> of_line;
    const bool leaves =
        EndsOf(AboveSpaces(contrast, line, pitch_px, bead_px), direction, bead_px, of_line);
    const bool at_border =
        direction < 0 ? line.seen.from_px > 0 : line.seen.to_px < contrast.width - 1;
    found.cut += leaves && at_border;
    for (const double offset : of_line) {
      const double x = line.seen.from_px + offset;
      ends.push_back({i, x, line.track(x)});
    }
  }
  // LargestRow's time grows with the third power: three breaks on each of 100 lines.
  constexpr std::size_t kMostEnds = 400;
  if (ends.size() > kMostEnds) return found;
  constexpr double kNear = 0.8;       // beads; of virtual photos, seeds 300000 to 300499
  constexpr double kMinShare = 0.55;  // breaks at a change of speed are on about half of the lines
  const std::vector<End> row = LargestRow(ends, kNear * bead_px);
  const double fewest = kMinShare * static_cast<double>(lines.size());
  if (row.size() < 3 || static_cast<double>(row.size()) < fewest) return found;
  std::vector<double> x_px, y_px;
  for (const End& end : row) {
    x_px.push_back(end.x_px);
    y_px.push_back(end.y_px);
  }
  const double centre = contrast.height / 2.0;
  const Curve curve = FitCurve(y_px, x_px, centre, centre);
  for (const End& end : ends) {
    if (std::abs(end.x_px - curve(end.y_px)) < 2 * kNear * bead_px)
      found.ends_here[end.line] = true;
  }
  found.x_px = curve;
  return found;
}

}  // namespace trammel::vision
