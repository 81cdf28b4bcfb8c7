#include "tool_offset/reading/box_candidates.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

#include "base/parallel.h"
#include "geometry/robust_line.h"

namespace trammel::tool_offset {
namespace {

constexpr int kLongSide = 1200;
/// Small pixels per side of a block whose median is the paper: 6 mm at 100 dpi. Several times wider
/// than a finger and its gap; ink covers less than half of it.
constexpr int kBlock = 24;

/// Computes block means; of large blocks every second row and pixel or fewer suffice.
void ShrinkRows(const PageView& page, int first, int last, SmallPage& small) {
  const int step = std::max(1, small.factor / 4);
  const std::size_t row_values =
      static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.channels);
  std::vector<std::uint32_t> sum(row_values);
  const int samples_across = (small.factor + step - 1) / step;
  const auto samples = static_cast<std::uint32_t>(samples_across * samples_across);
  for (int y = first; y < last; ++y) {
    std::fill(sum.begin(), sum.end(), 0);
    for (int dy = 0; dy < small.factor; dy += step) {
      const std::uint8_t* pixel = page.row(y * small.factor + dy);
      std::uint32_t* out = sum.data();
      for (int x = 0; x < small.width; ++x, out += small.channels) {
        for (int dx = 0; dx < small.factor; dx += step) {
          for (int c = 0; c < small.channels; ++c) out[c] += pixel[dx * small.channels + c];
        }
        pixel += static_cast<std::ptrdiff_t>(small.factor) * small.channels;
      }
    }
    std::uint8_t* out = small.pixels.data() + static_cast<std::size_t>(y) * row_values;
    for (std::size_t i = 0; i < row_values; ++i) {
      out[i] = static_cast<std::uint8_t>((sum[i] + samples / 2) / samples);
    }
  }
}

/// Computes medians of blocks, one value per block and channel.
std::vector<float> BlockMedians(const SmallPage& small, int columns, int rows) {
  std::vector<float> medians(static_cast<std::size_t>(columns * rows * small.channels));
  ParallelFor(rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      for (int c = 0; c < small.channels; ++c) {
        std::array<int, 256> histogram{};
        int count = 0;
        for (int y = row * kBlock; y < std::min((row + 1) * kBlock, small.height); ++y) {
          for (int x = column * kBlock; x < std::min((column + 1) * kBlock, small.width); ++x) {
            ++histogram[small.pixels[small.at(x, y) * static_cast<std::size_t>(small.channels) +
                                     static_cast<std::size_t>(c)]];
            ++count;
          }
        }
        int level = 0;
        for (int below = histogram[0]; 2 * below < count; below += histogram[++level]) {
        }
        medians[static_cast<std::size_t>((row * columns + column) * small.channels + c)] =
            static_cast<float>(level);
      }
    }
  });
  return medians;
}

/// Two blocks whose centres enclose a small pixel, and its position between them.
struct Between {
  int lower = 0;
  int upper = 0;
  float part = 0;
};

Between BetweenBlocks(int position, int blocks) {
  const float at = (static_cast<float>(position) + 0.5F) / kBlock - 0.5F;
  const int lower = std::clamp(static_cast<int>(std::floor(at)), 0, blocks - 1);
  const int upper = std::min(lower + 1, blocks - 1);
  return {lower, upper, std::clamp(at - static_cast<float>(lower), 0.0F, 1.0F)};
}

void CompareWithSurroundings(SmallPage& small) {
  const int columns = (small.width + kBlock - 1) / kBlock;
  const int rows = (small.height + kBlock - 1) / kBlock;
  const std::vector<float> medians = BlockMedians(small, columns, rows);
  const auto median = [&](int row, int column, int c) {
    return medians[static_cast<std::size_t>((row * columns + column) * small.channels + c)];
  };
  ParallelFor(small.height, [&](int y) {
    const Between v = BetweenBlocks(y, rows);
    for (int x = 0; x < small.width; ++x) {
      const Between u = BetweenBlocks(x, columns);
      float squares = 0;
      for (int c = 0; c < small.channels; ++c) {
        const float upper = median(v.lower, u.lower, c) +
                            u.part * (median(v.lower, u.upper, c) - median(v.lower, u.lower, c));
        const float lower = median(v.upper, u.lower, c) +
                            u.part * (median(v.upper, u.upper, c) - median(v.upper, u.lower, c));
        const float level = upper + v.part * (lower - upper);
        const std::size_t i =
            small.at(x, y) * static_cast<std::size_t>(small.channels) + static_cast<std::size_t>(c);
        small.background[i] = static_cast<std::uint8_t>(level + 0.5F);
        const float difference = static_cast<float>(small.pixels[i]) - level;
        squares += difference * difference;
      }
      small.strength[small.at(x, y)] = static_cast<std::uint8_t>(
          std::min(255.0F, std::sqrt(squares / static_cast<float>(small.channels)) + 0.5F));
    }
  });
}

}  // namespace

SmallPage Shrink(const PageView& page) {
  SmallPage small;
  small.factor = std::max(1, (std::max(page.width, page.height) + kLongSide / 2) / kLongSide);
  small.width = page.width / small.factor;
  small.height = page.height / small.factor;
  small.channels = page.channels;
  const std::size_t count =
      static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.height);
  small.pixels.resize(count * static_cast<std::size_t>(small.channels));
  small.background.resize(small.pixels.size());
  small.strength.resize(count);
  constexpr int kRowsAtOnce = 32;
  ParallelFor((small.height + kRowsAtOnce - 1) / kRowsAtOnce, [&](int part) {
    ShrinkRows(page, part * kRowsAtOnce, std::min((part + 1) * kRowsAtOnce, small.height), small);
  });
  CompareWithSurroundings(small);
  return small;
}

namespace {

/// Least inked part of a side: gaps of a broken line, and corners, are within the rest.
constexpr double kSupported = 0.8;

double Cross(PagePoint o, PagePoint a, PagePoint b) {
  return (a.x_px - o.x_px) * (b.y_px - o.y_px) - (a.y_px - o.y_px) * (b.x_px - o.x_px);
}

/// Computes the hull by Andrew's monotone chain.
std::vector<PagePoint> ConvexHull(std::vector<PagePoint> points) {
  std::sort(points.begin(), points.end(), [](PagePoint a, PagePoint b) {
    return a.x_px < b.x_px || (a.x_px == b.x_px && a.y_px < b.y_px);
  });
  std::vector<PagePoint> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const PagePoint& point : points) {
      while (hull.size() >= start + 2 && Cross(hull[hull.size() - 2], hull.back(), point) <= 0) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// Returns the rectangle of minimum area; one of its sides is along a side of the hull.
std::array<PagePoint, 4> SmallestRectangle(const std::vector<PagePoint>& hull) {
  std::array<PagePoint, 4> best{};
  double best_area = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const PagePoint side = hull[(i + 1) % hull.size()] - hull[i];
    const double length = Length(side);
    if (length < 1e-9) continue;
    const PagePoint along = (1 / length) * side;
    const PagePoint across{-along.y_px, along.x_px};
    double lo[2] = {1e300, 1e300};
    double hi[2] = {-1e300, -1e300};
    for (const PagePoint& point : hull) {
      const double s = point.x_px * along.x_px + point.y_px * along.y_px;
      const double t = point.x_px * across.x_px + point.y_px * across.y_px;
      lo[0] = std::min(lo[0], s), hi[0] = std::max(hi[0], s);
      lo[1] = std::min(lo[1], t), hi[1] = std::max(hi[1], t);
    }
    const double area = (hi[0] - lo[0]) * (hi[1] - lo[1]);
    if (area >= best_area) continue;
    best_area = area;
    best = {lo[0] * along + lo[1] * across, hi[0] * along + lo[1] * across,
            hi[0] * along + hi[1] * across, lo[0] * along + hi[1] * across};
  }
  return best;
}

using Pixel = std::array<int, 2>;

/// Returns the hull's own corners nearest to the rectangle's: a scanner whose axes differ in scale
/// makes a parallelogram of a rotated box.
std::array<PagePoint, 4> Corners(const std::vector<PagePoint>& hull) {
  const std::array<PagePoint, 4> rectangle = SmallestRectangle(hull);
  std::array<PagePoint, 4> corners{};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto distance = [&](PagePoint point) { return Length(point - rectangle[i]); };
    corners[i] = *std::min_element(hull.begin(), hull.end(), [&](PagePoint a, PagePoint b) {
      return distance(a) < distance(b);
    });
  }
  return corners;
}

/// Intersects straight lines through the outermost pixels on each side of the piece. Anything
/// beyond a side (a hair, lines of a tool far off) is far from the line through most of them.
/// @param rectangle  around the piece, roughly turned like it.
std::optional<std::array<PagePoint, 4>> CornersOfSides(const std::vector<Pixel>& piece,
                                                       const std::array<PagePoint, 4>& rectangle) {
  constexpr std::size_t kFewest = 20;
  const PagePoint origin = rectangle[0];
  const double length = Length(rectangle[1] - origin);
  const double width = Length(rectangle[3] - origin);
  if (length < kFewest || width < kFewest) return std::nullopt;
  const PagePoint along = (1 / length) * (rectangle[1] - origin);
  const PagePoint across = (1 / width) * (rectangle[3] - origin);
  // Lowest and highest pixel across for each column along, and vice versa.
  std::array<std::vector<std::array<double, 2>>, 2> extremes;
  extremes[0].assign(static_cast<std::size_t>(length) + 2, {1e9, -1e9});
  extremes[1].assign(static_cast<std::size_t>(width) + 2, {1e9, -1e9});
  for (const auto [x, y] : piece) {
    const PagePoint d = PagePoint{static_cast<double>(x), static_cast<double>(y)} - origin;
    const std::array<double, 2> at{d.x_px * along.x_px + d.y_px * along.y_px,
                                   d.x_px * across.x_px + d.y_px * across.y_px};
    for (std::size_t i = 0; i < 2; ++i) {
      const auto bin = static_cast<std::size_t>(std::max(0.0, at[i] + 0.5));
      if (bin >= extremes[i].size()) continue;
      auto& [low, high] = extremes[i][bin];
      low = std::min(low, at[1 - i]);
      high = std::max(high, at[1 - i]);
    }
  }
  // [direction][low or high]: the other coordinate over the bin.
  std::array<std::array<geometry::RobustLine, 2>, 2> line;
  std::vector<double> scratch;
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t end = 0; end < 2; ++end) {
      std::vector<double> bins;
      std::vector<double> edge;
      for (std::size_t bin = 0; bin < extremes[i].size(); ++bin) {
        if (extremes[i][bin][0] > extremes[i][bin][1]) continue;
        bins.push_back(static_cast<double>(bin));
        edge.push_back(extremes[i][bin][end]);
      }
      if (bins.size() < kFewest) return std::nullopt;
      line[i][end] = geometry::FitRobustLine(bins, edge, scratch);
    }
  }
  const auto corner = [&](std::size_t along_end, std::size_t across_end) {
    // across = a + b * along on a side along; along = c + d * across on a side across.
    const geometry::RobustLine& side = line[0][across_end];
    const geometry::RobustLine& end = line[1][along_end];
    const double s = (end.offset + end.slope * side.offset) / (1 - end.slope * side.slope);
    return origin + s * along + side.at(s) * across;
  };
  return std::array<PagePoint, 4>{corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
}

/// Labels the piece that contains the given pixel.
/// @param piece  receives its pixels; reused.
void Flood(const SmallPage& page, int threshold, Pixel seed, std::int32_t label,
           std::vector<std::int32_t>& labels, std::vector<Pixel>& piece) {
  piece.assign(1, seed);
  labels[page.at(seed[0], seed[1])] = label;
  for (std::size_t next = 0; next < piece.size(); ++next) {
    const auto [px, py] = piece[next];
    for (int y = std::max(0, py - 1); y <= std::min(page.height - 1, py + 1); ++y) {
      for (int x = std::max(0, px - 1); x <= std::min(page.width - 1, px + 1); ++x) {
        const std::size_t i = page.at(x, y);
        if (labels[i] != 0 || page.strength[i] < threshold) continue;
        labels[i] = label;
        piece.push_back({x, y});
      }
    }
  }
}

/// Returns the outermost pixels of each row, which suffice for the hull.
std::vector<PagePoint> Outline(const SmallPage& page, const std::vector<Pixel>& piece) {
  std::vector<std::array<int, 2>> extent(static_cast<std::size_t>(page.height), {page.width, -1});
  for (const auto [x, y] : piece) {
    auto& row = extent[static_cast<std::size_t>(y)];
    row = {std::min(row[0], x), std::max(row[1], x)};
  }
  std::vector<PagePoint> outline;
  for (int y = 0; y < page.height; ++y) {
    const auto [first, last] = extent[static_cast<std::size_t>(y)];
    if (first <= last) outline.push_back({static_cast<double>(first), static_cast<double>(y)});
    if (first < last) outline.push_back({static_cast<double>(last), static_cast<double>(y)});
  }
  return outline;
}

/// Returns the part of the line from a to b with a pixel of the piece next to it.
double Support(const SmallPage& page, const std::vector<std::int32_t>& labels, std::int32_t label,
               PagePoint a, PagePoint b) {
  constexpr int kReach = 3;  // small pixels to either side
  const double length = std::max(1e-9, Length(b - a));
  const PagePoint across{-(b - a).y_px / length, (b - a).x_px / length};
  const int steps = std::max(2, static_cast<int>(length));
  int found = 0;
  for (int i = 0; i < steps; ++i) {
    const PagePoint at = a + ((i + 0.5) / steps) * (b - a);
    for (int d = -kReach; d <= kReach; ++d) {
      const PagePoint point = at + static_cast<double>(d) * across;
      const int x = static_cast<int>(std::lround(point.x_px));
      const int y = static_cast<int>(std::lround(point.y_px));
      if (x < 0 || y < 0 || x >= page.width || y >= page.height) continue;
      if (labels[page.at(x, y)] != label) continue;
      ++found;
      break;
    }
  }
  return static_cast<double>(found) / steps;
}

void SupportSides(const SmallPage& page, const std::vector<std::int32_t>& labels,
                  std::int32_t label, BoxCandidate& candidate) {
  for (std::size_t i = 0; i < 4; ++i) {
    candidate.support[i] =
        Support(page, labels, label, candidate.corners[i], candidate.corners[(i + 1) % 4]);
  }
}

/// Dilates: every pixel takes the strength of its strongest neighbour, which joins pieces across a
/// pixel's gap.
SmallPage Widened(const SmallPage& page) {
  SmallPage wide = page;
  for (int y = 0; y < page.height; ++y) {
    for (int x = 0; x < page.width; ++x) {
      std::uint8_t most = 0;
      for (int ny = std::max(0, y - 1); ny <= std::min(page.height - 1, y + 1); ++ny) {
        for (int nx = std::max(0, x - 1); nx <= std::min(page.width - 1, x + 1); ++nx) {
          most = std::max(most, page.strength[page.at(nx, ny)]);
        }
      }
      wide.strength[wide.at(x, y)] = most;
    }
  }
  return wide;
}

}  // namespace

int BoxCandidate::sides() const {
  return static_cast<int>(std::count_if(support.begin(), support.end(),
                                        [](double part) { return part >= kSupported; }));
}

std::vector<BoxCandidate> FindBoxCandidates(const SmallPage& as_is, int threshold, bool widened) {
  const SmallPage wide = widened ? Widened(as_is) : SmallPage{};
  const SmallPage& page = widened ? wide : as_is;
  /// Minimum side of a box, as a share of the page's longer side.
  constexpr double kShortest = 0.12;
  constexpr double kThinnest = 10;  // small pixels
  const double shortest = kShortest * std::max(page.width, page.height);
  std::vector<std::int32_t> labels(page.strength.size(), 0);
  std::vector<BoxCandidate> candidates;
  std::vector<Pixel> piece;
  std::int32_t label = 0;
  for (int y = 0; y < page.height; ++y) {
    for (int x = 0; x < page.width; ++x) {
      if (labels[page.at(x, y)] != 0 || page.strength[page.at(x, y)] < threshold) continue;
      Flood(page, threshold, {x, y}, ++label, labels, piece);
      if (static_cast<double>(piece.size()) < shortest) continue;
      const std::vector<PagePoint> hull = ConvexHull(Outline(page, piece));
      if (hull.size() < 3) continue;
      BoxCandidate candidate;
      candidate.corners = Corners(hull);
      if (std::max(candidate.length(), candidate.width()) < shortest) continue;
      if (std::min(candidate.length(), candidate.width()) < kThinnest) continue;
      SupportSides(page, labels, label, candidate);
      if (candidate.sides() < 4) {
        BoxCandidate straight = candidate;
        if (const auto corners = CornersOfSides(piece, SmallestRectangle(hull))) {
          straight.corners = *corners;
          straight.straightened = true;
          SupportSides(page, labels, label, straight);
          if (straight.sides() > candidate.sides()) candidate = straight;
        }
      }
      candidates.push_back(candidate);
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const BoxCandidate& a, const BoxCandidate& b) {
    return a.length() * a.width() > b.length() * b.width();
  });
  return candidates;
}

bool Overlap(const BoxCandidate& a, const BoxCandidate& b) {
  const auto middle_within = [](const BoxCandidate& inner, const BoxCandidate& outer) {
    const PagePoint d =
        0.25 * (inner.corners[0] + inner.corners[1] + inner.corners[2] + inner.corners[3]) -
        outer.corners[0];
    const double length = std::max(1e-9, outer.length());
    const double width = std::max(1e-9, outer.width());
    const PagePoint along = (1 / length) * (outer.corners[1] - outer.corners[0]);
    const PagePoint across = (1 / width) * (outer.corners[3] - outer.corners[0]);
    const double s = d.x_px * along.x_px + d.y_px * along.y_px;
    const double t = d.x_px * across.x_px + d.y_px * across.y_px;
    return s > 0 && t > 0 && s < length && t < width;
  };
  return middle_within(a, b) || middle_within(b, a);
}

}  // namespace trammel::tool_offset
