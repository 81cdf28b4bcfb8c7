#include "part_alignment/disc_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace trammel::part_alignment {
namespace {

/// Whether any |p[i + 1] - p[i - 1]|, i = 0 … 15, is at least `step`.
bool HasEdge(const std::uint8_t* p, int step) {
#ifdef __SSE2__
  const __m128i before = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p - 1));
  const __m128i after = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p + 1));
  const __m128i change = _mm_or_si128(_mm_subs_epu8(before, after), _mm_subs_epu8(after, before));
  const __m128i over = _mm_subs_epu8(change, _mm_set1_epi8(static_cast<char>(step - 1)));
  return _mm_movemask_epi8(_mm_cmpeq_epi8(over, _mm_setzero_si128())) != 0xffff;
#else
  for (int i = 0; i < 16; ++i) {
    if (std::abs(p[i + 1] - p[i - 1]) >= step) return true;
  }
  return false;
#endif
}

/// Columns of the steepest places, as 2 * column + (rising ? 1 : 0).
void EdgesOfRow(const std::uint8_t* row, int width, int step, std::vector<std::int32_t>& edges) {
  edges.clear();
  int steepest = 0;  // of the edge being crossed, signed; 0: none
  int place = 0;
  const auto finish = [&] {
    if (steepest != 0) edges.push_back(2 * place + (steepest > 0 ? 1 : 0));
    steepest = 0;
  };
  int x = 1;
  while (x < width - 1) {
    if (x + 17 <= width && !HasEdge(row + x, step)) {
      finish();
      x += 16;
      continue;
    }
    const int end = std::min(x + 16, width - 1);
    for (; x < end; ++x) {
      const int change = row[x + 1] - row[x - 1];
      if (std::abs(change) < step) {
        finish();
      } else if (steepest == 0 || (change > 0) != (steepest > 0)) {
        finish();
        steepest = change;
        place = x;
      } else if (std::abs(change) > std::abs(steepest)) {
        steepest = change;
        place = x;
      }
    }
  }
  finish();
}

/// Steps from (x, y) in a direction while the shade is the inside's; the number of whole steps that
/// stayed inside, or -1 beyond `most` steps or the picture.
int StepsInside(const PageView& picture, double x, double y, int dx, int dy, const Run& run,
                int most) {
  const int threshold = (run.inside + run.outside) / 2;
  const bool dark = run.inside < run.outside;
  const int column = static_cast<int>(x + 0.5);
  const int line = static_cast<int>(y + 0.5);
  // Steps until the picture ends.
  int room = most + 1;
  if (dx != 0) room = std::min(room, dx > 0 ? picture.width - 1 - column : column);
  if (dy != 0) room = std::min(room, dy > 0 ? picture.height - 1 - line : line);
  const std::uint8_t* p = picture.row(line) + column;
  const std::ptrdiff_t stride = dy * picture.stride + dx;
  for (int steps = 0; steps < room; ++steps) {
    p += stride;
    if ((*p < threshold) != dark) return steps;
  }
  return -1;
}

/// Middle and half length of the chord through (x, y); half < 0 where it has no end.
struct Chord {
  double shift = 0;  ///< of the middle from the start, in steps
  double half = -1;
};

Chord ChordThrough(const PageView& picture, double x, double y, int dx, int dy, const Run& run,
                   int most) {
  const int ahead = StepsInside(picture, x, y, dx, dy, run, most);
  if (ahead < 0) return {};
  const int behind = StepsInside(picture, x, y, -dx, -dy, run, most);
  if (behind < 0) return {};
  return {0.5 * (ahead - behind), 0.5 * (ahead + behind + 1)};
}

/// Distance from (x, y) along a direction at which the shade crosses the threshold.
double Crossing(const PageView& picture, double x, double y, double dx, double dy, const Run& run,
                double from, double most) {
  const double threshold = 0.5 * (run.inside + run.outside);
  const bool dark = run.inside < run.outside;
  double previous = 0;
  for (double at = from; at <= most; at += 1) {
    const double px = x + at * dx;
    const double py = y + at * dy;
    if (!(px >= 0 && py >= 0 && px <= picture.width - 1 && py <= picture.height - 1)) return -1;
    const double grey = Between(picture, px, py);
    if ((grey < threshold) != dark) {
      if (at == from) return -1;
      return at - (grey - threshold) / (grey - previous);
    }
    previous = grey;
  }
  return -1;
}

/// Solves the symmetric 5x5 system in place; false where it is singular.
bool Solve5(std::array<std::array<double, 6>, 5>& a) {
  for (int i = 0; i < 5; ++i) {
    int pivot = i;
    for (int k = i + 1; k < 5; ++k) {
      if (std::abs(a[k][i]) > std::abs(a[pivot][i])) pivot = k;
    }
    std::swap(a[i], a[pivot]);
    if (std::abs(a[i][i]) < 1e-9) return false;
    for (int k = 0; k < 5; ++k) {
      if (k == i) continue;
      const double factor = a[k][i] / a[i][i];
      for (int j = i; j < 6; ++j) a[k][j] -= factor * a[i][j];
    }
  }
  for (auto& row : a) row[5] /= row[&row - a.data()];
  return true;
}

/// The run's levels anew: within the middle, and half a radius beyond the edge. The row that found
/// the disc may have crossed it close to its rim.
std::optional<Run> WithLevels(const PageView& picture, const Run& run, const Middle& middle) {
  constexpr int kAround = 12;
  std::array<int, kAround> outside{};
  std::size_t count = 0;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.25) / kAround;
    const auto x = std::lround(middle.column_px + 1.5 * middle.half_width_px * std::cos(angle));
    const auto y = std::lround(middle.row_px + 1.5 * middle.half_height_px * std::sin(angle));
    if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) continue;
    outside[count++] = picture.row(static_cast<int>(y))[x];
  }
  if (count < kAround / 2) return std::nullopt;
  std::nth_element(outside.begin(), outside.begin() + count / 2, outside.begin() + count);
  Run levels = run;
  levels.outside = outside[count / 2];
  const auto x = static_cast<int>(std::lround(middle.column_px));
  const auto y = static_cast<int>(std::lround(middle.row_px));
  int sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += picture.row(y + dy)[x + dx];
  }
  levels.inside = (sum + 4) / 9;
  if ((levels.inside < levels.outside) != (run.inside < run.outside)) return std::nullopt;
  return levels;
}

}  // namespace

std::optional<DiscModel> EllipseThrough(const std::vector<Offset>& points, double scale) {
  // a x² + 2 b x y + c y² + d x + e y = 1
  std::array<std::array<double, 6>, 5> system{};
  for (const Offset& point : points) {
    const double x = point.x / scale;
    const double y = point.y / scale;
    const std::array<double, 6> terms{x * x, 2 * x * y, y * y, x, y, 1};
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < 6; ++j) system[i][j] += terms[i] * terms[j];
    }
  }
  if (!Solve5(system)) return std::nullopt;
  const double a = system[0][5];
  const double b = system[1][5];
  const double c = system[2][5];
  const double det = a * c - b * b;
  if (!(a > 0 && det > 0)) return std::nullopt;
  const double cx = -(c * system[3][5] - b * system[4][5]) / (2 * det);
  const double cy = -(a * system[4][5] - b * system[3][5]) / (2 * det);
  const double level = 1 + a * cx * cx + 2 * b * cx * cy + c * cy * cy;
  // W is the square root of the form: (A + sqrt(det) I) / sqrt(trace + 2 sqrt(det)).
  const double root = std::sqrt(det);
  const double norm = std::sqrt((a + c + 2 * root) * level) * scale;
  DiscModel disc;
  disc.column_px = cx * scale;
  disc.row_px = cy * scale;
  disc.wxx = (a + root) / norm;
  disc.wxy = b / norm;
  disc.wyy = (c + root) / norm;
  return disc;
}

double Between(const PageView& picture, double x, double y) {
  const int x0 = std::min(static_cast<int>(x), picture.width - 2);
  const int y0 = std::min(static_cast<int>(y), picture.height - 2);
  const double fx = x - x0;
  const double fy = y - y0;
  const std::uint8_t* above = picture.row(y0) + x0;
  const std::uint8_t* below = above + picture.stride;
  return (above[0] * (1 - fx) + above[1] * fx) * (1 - fy) +
         (below[0] * (1 - fx) + below[1] * fx) * fy;
}

void RunsOfRow(const PageView& picture, int row, const RunRules& rules,
               std::vector<std::int32_t>& edges, std::vector<Run>& runs) {
  runs.clear();
  const std::uint8_t* p = picture.row(row);
  EdgesOfRow(p, picture.width, rules.edge_step, edges);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    if (((edges[i] ^ edges[i - 1]) & 1) == 0) continue;
    Run run;
    run.row = row;
    run.first = edges[i - 1] / 2;
    run.last = edges[i] / 2;
    const int length = run.last - run.first;
    if (length < rules.min_px || length > rules.max_px) continue;
    const int aside = 2 + length / 6;
    if (run.first < aside || run.last + aside >= picture.width) continue;
    const int middle = (run.first + run.last) / 2;
    run.inside = (p[middle - 1] + p[middle] + p[middle + 1]) / 3;
    const int left = p[run.first - aside] - run.inside;
    const int right = p[run.last + aside] - run.inside;
    if ((left > 0) != (right > 0)) continue;
    const int less = std::min(std::abs(left), std::abs(right));
    if (less < rules.min_contrast / 2 || 5 * less < 2 * std::max(std::abs(left), std::abs(right))) {
      continue;
    }
    run.outside = run.inside + (left + right) / 2;
    runs.push_back(run);
  }
}

std::optional<Middle> WalkToMiddle(const PageView& picture, const Run& run, double max_radius_px) {
  const int most = static_cast<int>(2 * max_radius_px) + 2;
  Middle middle;
  middle.column_px = 0.5 * (run.first + run.last);
  middle.row_px = run.row;
  for (int round = 0; round < 2; ++round) {
    const Chord down = ChordThrough(picture, middle.column_px, middle.row_px, 0, 1, run, most);
    if (down.half < 0) return std::nullopt;
    middle.row_px = std::round(middle.row_px) + down.shift;
    middle.half_height_px = down.half;
    const Chord across = ChordThrough(picture, middle.column_px, middle.row_px, 1, 0, run, most);
    if (across.half < 0) return std::nullopt;
    middle.column_px = std::round(middle.column_px) + across.shift;
    middle.half_width_px = across.half;
  }
  const double longer = std::max(middle.half_width_px, middle.half_height_px);
  const double shorter = std::min(middle.half_width_px, middle.half_height_px);
  if (shorter < 0.4 * longer - 1) return std::nullopt;
  for (const int dy : {1, -1}) {
    const Chord chord = ChordThrough(picture, middle.column_px, middle.row_px, 1, dy, run, most);
    if (chord.half < 0 || std::abs(chord.shift) > 0.2 * chord.half + 1.5) return std::nullopt;
    if (chord.half * std::numbers::sqrt2 > 1.3 * longer + 2) return std::nullopt;
  }
  return middle;
}

std::optional<DiscModel> RoughDisc(const PageView& picture, const Run& found,
                                   const Middle& middle) {
  const std::optional<Run> levels = WithLevels(picture, found, middle);
  if (!levels) return std::nullopt;
  const Run& run = *levels;
  constexpr int kRays = 24;
  const double longer = std::max(middle.half_width_px, middle.half_height_px);
  const double shorter = std::min(middle.half_width_px, middle.half_height_px);
  std::vector<Offset> points;
  points.reserve(kRays);
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / kRays;
    const double dx = std::cos(angle);
    const double dy = std::sin(angle);
    const double at = Crossing(picture, middle.column_px, middle.row_px, dx, dy, run,
                               std::floor(0.7 * shorter), 1.5 * longer + 2);
    if (at > 0) points.push_back({at * dx, at * dy});
  }
  constexpr std::size_t kLeastPoints = 20;
  if (points.size() < kLeastPoints) return std::nullopt;
  auto disc = EllipseThrough(points, longer);
  if (!disc) return std::nullopt;
  double sum = 0;
  const double radius = MeanRadius(*disc);
  for (const Offset& point : points) {
    const double x = point.x - disc->column_px;
    const double y = point.y - disc->row_px;
    const double q = std::hypot(disc->wxx * x + disc->wxy * y, disc->wxy * x + disc->wyy * y);
    sum += (q - 1) * (q - 1);
  }
  const double rms_px = std::sqrt(sum / static_cast<double>(points.size())) * radius;
  if (rms_px > 0.25 + 0.03 * radius) return std::nullopt;
  disc->column_px += middle.column_px;
  disc->row_px += middle.row_px;
  disc->background = run.outside;
  disc->contrast = run.inside - run.outside;
  return disc;
}

}  // namespace trammel::part_alignment
