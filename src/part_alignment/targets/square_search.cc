#include "part_alignment/targets/square_search.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

namespace trammel::part_alignment {
namespace {

constexpr int kRight = 0;
constexpr int kDown = 1;
constexpr int kLeft = 2;
constexpr int kUp = 3;

/// A place on an outline: the pixel `column`, `row` is dark, its neighbour on one side is not.
struct Seed {
  int column = 0;
  int row = 0;
  bool bright_on_left = false;
  int threshold = 0;
};

/// A corner of pixels: (x, y) is the upper left one of pixel (x, y).
struct Vertex {
  int x = 0;
  int y = 0;
};

class Search {
 public:
  Search(const PageView& picture, const SquareRules& rules, OutlineWorkspace& workspace)
      : picture_(picture), rules_(rules), w_(workspace) {
    w_.traced.assign(
        static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height), 0);
    // A side of an outline takes at most sqrt(2) steps a pixel, and leans back by perspective.
    most_steps_ = static_cast<std::size_t>(6 * rules.max_side_px) + 16;
  }

  std::vector<DarkOutline> Run() {
    // A square standing on its corner is crossed by rows all over its diagonal.
    const int step = std::max(2, static_cast<int>(rules_.min_side_px / 3));
    for (int row = step / 2; row < picture_.height; row += step) ScanRow(row);
    return std::move(found_);
  }

 private:
  void ScanRow(int row) {
    // An edge blurred with 2 px has a slope of a tenth of its contrast over two pixels.
    const int least_step = std::max(4, rules_.min_contrast / 5);
    const std::uint8_t* p = picture_.row(row);
    int steepest = 0;
    int place = 0;
    for (int x = 1; x < picture_.width - 1; ++x) {
      const int change = p[x + 1] - p[x - 1];
      const bool goes_on =
          std::abs(change) >= least_step && (steepest == 0 || (change > 0) == (steepest > 0));
      if (goes_on) {
        if (std::abs(change) > std::abs(steepest)) {
          steepest = change;
          place = x;
        }
        continue;
      }
      if (steepest != 0) StartAt(row, place, steepest < 0);
      steepest = std::abs(change) >= least_step ? change : 0;
      place = x;
    }
    if (steepest != 0) StartAt(row, place, steepest < 0);
  }

  /// The column, up to some steps aside, from which on the shade no longer grows brighter or
  /// darker.
  [[nodiscard]] int Plateau(const std::uint8_t* p, int x, int direction, bool brighter) const {
    constexpr int kReach = 8;
    constexpr int kNoise = 2;
    for (int steps = 0; steps < kReach; ++steps) {
      const int next = x + direction;
      if (next < 0 || next >= picture_.width) break;
      const int gain = brighter ? p[next] - p[x] : p[x] - p[next];
      if (gain < -kNoise || (gain <= 0 && steps > 2)) break;
      x = next;
    }
    return x;
  }

  void StartAt(int row, int place, bool bright_on_left) {
    const std::uint8_t* p = picture_.row(row);
    const int towards_bright = bright_on_left ? -1 : 1;
    const int bright = Plateau(p, place, towards_bright, true);
    const int dark = Plateau(p, place, -towards_bright, false);
    if (p[bright] - p[dark] < rules_.min_contrast) return;
    Seed seed{dark, row, bright_on_left, (p[bright] + p[dark] + 1) / 2};
    while (seed.column != bright && p[seed.column + towards_bright] < seed.threshold) {
      seed.column += towards_bright;
    }
    constexpr int kAlike = 12;  // grey levels: another threshold finds the same outline
    const int before = TracedAt(seed.column, row);
    if (before != 0 && std::abs(before - seed.threshold) <= kAlike) return;
    if (const auto area = Trace(seed)) Judge(*area, seed.threshold);
  }

  std::uint8_t& TracedAt(int column, int row) {
    return w_.traced[static_cast<std::size_t>(row) * static_cast<std::size_t>(picture_.width) +
                     static_cast<std::size_t>(column)];
  }

  [[nodiscard]] bool IsDark(int x, int y, int threshold) {
    if (x < 0 || y < 0 || x >= picture_.width || y >= picture_.height) {
      at_border_ = true;
      return false;
    }
    return picture_.row(y)[x] < threshold;
  }

  /// Goes around the dark pixels, which lie on the right hand, to the seed again. Pixels that touch
  /// at corners only are not joined.
  /// @returns The area, > 0 unless a bright thing within something dark was gone around; absent
  ///          where the way is too long.
  std::optional<double> Trace(const Seed& seed) {
    at_border_ = false;
    w_.outline.clear();
    Vertex at =
        seed.bright_on_left ? Vertex{seed.column, seed.row + 1} : Vertex{seed.column + 1, seed.row};
    int direction = seed.bright_on_left ? kUp : kDown;
    const Vertex start = at;
    const int start_direction = direction;
    double twice_area = 0;
    for (std::size_t steps = 0; steps < most_steps_; ++steps) {
      const Vertex from = at;
      Step(direction, seed.threshold, at);
      twice_area += static_cast<double>(from.x) * at.y - static_cast<double>(at.x) * from.y;
      w_.outline.push_back(static_cast<std::int16_t>(at.x));
      w_.outline.push_back(static_cast<std::int16_t>(at.y));
      Turn(at, seed.threshold, direction);
      if (at.x == start.x && at.y == start.y && direction == start_direction) {
        return 0.5 * twice_area;
      }
    }
    return std::nullopt;
  }

  void Step(int direction, int threshold, Vertex& at) {
    const auto mark = static_cast<std::uint8_t>(threshold);
    switch (direction) {
      case kRight:
        ++at.x;
        break;
      case kDown:
        TracedAt(at.x - 1, at.y) = mark;
        ++at.y;
        break;
      case kLeft:
        --at.x;
        break;
      default:
        --at.y;
        TracedAt(at.x, at.y) = mark;
        break;
    }
  }

  void Turn(const Vertex& at, int threshold, int& direction) {
    // The pixels ahead on the left and on the right hand, from the vertex.
    constexpr std::array<Vertex, 4> kAheadLeft = {{{0, -1}, {0, 0}, {-1, 0}, {-1, -1}}};
    constexpr std::array<Vertex, 4> kAheadRight = {{{0, 0}, {-1, 0}, {-1, -1}, {0, -1}}};
    const auto d = static_cast<std::size_t>(direction);
    if (!IsDark(at.x + kAheadRight[d].x, at.y + kAheadRight[d].y, threshold)) {
      direction = (direction + 1) & 3;
    } else if (IsDark(at.x + kAheadLeft[d].x, at.y + kAheadLeft[d].y, threshold)) {
      direction = (direction + 3) & 3;
    }
  }

  [[nodiscard]] std::size_t count() const { return w_.outline.size() / 2; }
  [[nodiscard]] ImagePoint PointAt(std::size_t i) const {
    return {w_.outline[2 * i] - 0.5, w_.outline[2 * i + 1] - 0.5};
  }

  void Judge(double area, int threshold) {
    constexpr double kThinnest = 0.3;  // a square seen at 70 degrees
    const double least = rules_.min_side_px;
    if (area < kThinnest * least * least) return;
    DarkOutline thing;
    if (!at_border_) {
      if (const auto corners = FourCorners(area)) {
        thing.kind = DarkOutline::Kind::kQuad;
        thing.corners = *corners;
        found_.push_back(thing);
        return;
      }
    }
    ImagePoint low = PointAt(0);
    ImagePoint high = low;
    for (std::size_t i = 1; i < count(); ++i) {
      const ImagePoint p = PointAt(i);
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    const double width = high.x - low.x;
    const double height = high.y - low.y;
    if (std::min(width, height) < least || area < kThinnest * width * height) return;
    if (!HasBothShades(low, high, threshold)) return;
    thing.kind = at_border_ ? DarkOutline::Kind::kCutOff : DarkOutline::Kind::kOther;
    thing.corners = {low, {high.x, low.y}, high, {low.x, high.y}};
    found_.push_back(thing);
  }

  /// Within the middle of the box.
  [[nodiscard]] bool HasBothShades(const ImagePoint& low, const ImagePoint& high,
                                   int threshold) const {
    constexpr int kGrid = 12;
    int bright = 0;
    for (int i = 0; i < kGrid; ++i) {
      for (int k = 0; k < kGrid; ++k) {
        const double x = low.x + (high.x - low.x) * (0.2 + 0.6 * i / (kGrid - 1));
        const double y = low.y + (high.y - low.y) * (0.2 + 0.6 * k / (kGrid - 1));
        const int column = std::clamp(static_cast<int>(x), 0, picture_.width - 1);
        const int row = std::clamp(static_cast<int>(y), 0, picture_.height - 1);
        bright += picture_.row(row)[column] >= threshold ? 1 : 0;
      }
    }
    constexpr int kLeast = kGrid * kGrid / 8;
    return bright >= kLeast && bright <= kGrid * kGrid - kLeast;
  }

  /// The outline's point farthest from the line through a and b, on the side that `sign` says.
  [[nodiscard]] std::size_t Farthest(const ImagePoint& a, const ImagePoint& b, double sign) const {
    std::size_t best = 0;
    double most = -1e30;
    for (std::size_t i = 0; i < count(); ++i) {
      const ImagePoint p = PointAt(i);
      const double off = sign * ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x));
      if (off > most) {
        most = off;
        best = i;
      }
    }
    return best;
  }
  [[nodiscard]] std::size_t FarthestFrom(const ImagePoint& a) const {
    std::size_t best = 0;
    double most = -1;
    for (std::size_t i = 0; i < count(); ++i) {
      const ImagePoint p = PointAt(i);
      const double off = (p.x - a.x) * (p.x - a.x) + (p.y - a.y) * (p.y - a.y);
      if (off > most) {
        most = off;
        best = i;
      }
    }
    return best;
  }

  struct Side {
    ImagePoint middle;
    ImagePoint along;  ///< unit vector
    double rms_px = 0;
  };

  /// The line nearest to the outline from one corner on to the next, but for their surroundings.
  [[nodiscard]] Side SideBetween(std::size_t from, std::size_t to) const {
    const std::size_t n = count();
    const std::size_t length = (to + n - from) % n;
    const std::size_t skip = std::max<std::size_t>(1, length / 8);
    double sum_x = 0, sum_y = 0, xx = 0, xy = 0, yy = 0, used = 0;
    const ImagePoint origin = PointAt(from);
    for (std::size_t k = skip; k + skip <= length; ++k) {
      const ImagePoint p = PointAt((from + k) % n);
      const double x = p.x - origin.x;
      const double y = p.y - origin.y;
      sum_x += x, sum_y += y, xx += x * x, xy += x * y, yy += y * y, ++used;
    }
    used = std::max(used, 1.0);
    const double mx = sum_x / used;
    const double my = sum_y / used;
    xx = xx / used - mx * mx, xy = xy / used - mx * my, yy = yy / used - my * my;
    const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
    const double least = 0.5 * (xx + yy) - std::hypot(0.5 * (xx - yy), xy);
    return {{origin.x + mx, origin.y + my},
            {std::cos(angle), std::sin(angle)},
            std::sqrt(std::max(least, 0.0))};
  }

  [[nodiscard]] std::optional<std::array<ImagePoint, 4>> FourCorners(double area) const {
    ImagePoint mean;
    for (std::size_t i = 0; i < count(); ++i) {
      mean.x += PointAt(i).x / static_cast<double>(count());
      mean.y += PointAt(i).y / static_cast<double>(count());
    }
    const std::size_t first = FarthestFrom(mean);
    const std::size_t third = FarthestFrom(PointAt(first));
    std::array<std::size_t, 4> at = {first, Farthest(PointAt(first), PointAt(third), -1), third,
                                     Farthest(PointAt(first), PointAt(third), 1)};
    // The outline runs clockwise: so must they.
    const std::size_t n = count();
    for (std::size_t i = 1; i < 4; ++i) at[i] = (at[i] + n - first) % n;
    at[0] = 0;
    if (!(at[1] > 0 && at[1] < at[2] && at[2] < at[3])) return std::nullopt;
    for (std::size_t& i : at) i = (i + first) % n;
    std::array<Side, 4> sides;
    for (std::size_t k = 0; k < 4; ++k) sides[k] = SideBetween(at[k], at[(k + 1) % 4]);
    std::array<ImagePoint, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) {
      const Side& a = sides[(k + 3) % 4];
      const Side& b = sides[k];
      const double sine = a.along.x * b.along.y - a.along.y * b.along.x;
      constexpr double kLeastSine = 0.25;  // 15 degrees
      if (std::abs(sine) < kLeastSine) return std::nullopt;
      const double t =
          ((b.middle.x - a.middle.x) * b.along.y - (b.middle.y - a.middle.y) * b.along.x) / sine;
      corners[k] = {a.middle.x + t * a.along.x, a.middle.y + t * a.along.y};
    }
    if (!IsAQuad(corners, sides, area)) return std::nullopt;
    return corners;
  }

  [[nodiscard]] bool IsAQuad(const std::array<ImagePoint, 4>& c, const std::array<Side, 4>& sides,
                             double area) const {
    double twice_area = 0;
    double shortest = 1e30;
    double longest = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const ImagePoint& a = c[k];
      const ImagePoint& b = c[(k + 1) % 4];
      const ImagePoint& d = c[(k + 2) % 4];
      if ((b.x - a.x) * (d.y - b.y) - (b.y - a.y) * (d.x - b.x) <= 0) return false;  // not convex
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      // Steps of pixels alone scatter by 0.3 px.
      if (!(sides[k].rms_px < 0.6 + 0.01 * length)) return false;
      twice_area += a.x * b.y - b.x * a.y;
      shortest = std::min(shortest, length);
      longest = std::max(longest, length);
    }
    constexpr double kMostUnlike = 4;
    return std::abs(0.5 * twice_area - area) < 0.08 * area + longest &&
           longest <= rules_.max_side_px && longest < kMostUnlike * shortest;
  }

  const PageView& picture_;
  const SquareRules& rules_;
  OutlineWorkspace& w_;
  std::size_t most_steps_ = 0;
  bool at_border_ = false;
  std::vector<DarkOutline> found_;
};

}  // namespace

std::vector<DarkOutline> FindDarkOutlines(const PageView& picture, const SquareRules& rules,
                                          OutlineWorkspace& workspace) {
  return Search(picture, rules, workspace).Run();
}

}  // namespace trammel::part_alignment
