#include "vision/quad_fit.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"

namespace trammel::vision {
namespace {

std::optional<PointPx> Intersection(const PointPx& a, const PointPx& b, const PointPx& c,
                                    const PointPx& d) {
  const double dx1 = b.x - a.x, dy1 = b.y - a.y, dx2 = d.x - c.x, dy2 = d.y - c.y;
  const double cross = dx1 * dy2 - dy1 * dx2;
  if (std::abs(cross) < 1e-9 * (std::hypot(dx1, dy1) * std::hypot(dx2, dy2) + 1e-12)) {
    return std::nullopt;
  }
  const double t = ((c.x - a.x) * dy2 - (c.y - a.y) * dx2) / cross;
  return PointPx{a.x + t * dx1, a.y + t * dy1};
}

double TriangleArea(const PointPx& a, const PointPx& b, const PointPx& c) {
  return std::abs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
}

// A side in its own frame: along from corner to corner, outward positive.
struct Side {
  PointPx origin;
  double along_x = 0, along_y = 0, out_x = 0, out_y = 0, length = 0;

  [[nodiscard]] PointPx At(double along, double out) const {
    return {origin.x + along * along_x + out * out_x, origin.y + along * along_y + out * out_y};
  }
};

Side MakeSide(const PointPx& a, const PointPx& b, const PointPx& inside) {
  Side side;
  side.origin = a;
  side.length = Distance_px(a, b);
  side.along_x = (b.x - a.x) / side.length;
  side.along_y = (b.y - a.y) / side.length;
  side.out_x = side.along_y;
  side.out_y = -side.along_x;
  if ((inside.x - a.x) * side.out_x + (inside.y - a.y) * side.out_y > 0) {
    side.out_x = -side.out_x;
    side.out_y = -side.out_y;
  }
  return side;
}

bool Set(const GrayImage& mask, const PointPx& p) {
  if (!(p.x > -0.5 && p.y > -0.5)) return false;
  const int x = static_cast<int>(p.x + 0.5);
  const int y = static_cast<int>(p.y + 0.5);
  return x < mask.width && y < mask.height && mask.row(y)[x] > 0.5F;
}

struct Hit {
  double along = 0;
  double out = 0;
};

// For places along the side, the begin of the mask that is nearest to the side. A begin needs two
// set pixels behind it, so that speckles do not count.
std::vector<Hit> Hits(const GrayImage& mask, const Side& side, double reach, int places) {
  std::vector<Hit> hits;
  for (int i = 0; i < places; ++i) {
    // Corners are round: the outermost parts of a side say nothing of its line.
    const double along = side.length * (0.05 + 0.9 * i / (places - 1));
    double best = 2 * reach;
    bool outside = false;
    for (double out = reach; out >= -reach; out -= 0.5) {
      const bool inside = Set(mask, side.At(along, out));
      const bool begins = outside && inside && std::abs(out) < std::abs(best) &&
                          Set(mask, side.At(along, out - 1)) && Set(mask, side.At(along, out - 2));
      if (begins) best = out;
      outside = !inside;
    }
    if (std::abs(best) <= reach) hits.push_back({along, best});
  }
  return hits;
}

struct LineFit {
  double offset = 0;  // out = offset + slope * along
  double slope = 0;
};

// Theil-Sen: half of the hits may be wrong.
LineFit FitLine(const std::vector<Hit>& hits) {
  std::vector<double> slopes;
  const std::size_t n = hits.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + n / 4; j < n; j += 3) {
      const double apart = hits[j].along - hits[i].along;
      if (apart > 0) slopes.push_back((hits[j].out - hits[i].out) / apart);
    }
  }
  LineFit fit;
  if (!slopes.empty()) fit.slope = Median(slopes);
  std::vector<double> offsets;
  for (const Hit& hit : hits) offsets.push_back(hit.out - fit.slope * hit.along);
  fit.offset = Median(offsets);
  return fit;
}

}  // namespace

std::optional<Quad> QuadAround(std::vector<PointPx> polygon) {
  while (polygon.size() > 4) {
    const std::size_t n = polygon.size();
    double least = 1e300;
    std::size_t drop = n;
    PointPx corner;
    for (std::size_t i = 0; i < n; ++i) {
      const PointPx& a = polygon[(i + n - 1) % n];
      const PointPx& b = polygon[i];
      const PointPx& c = polygon[(i + 1) % n];
      const PointPx& d = polygon[(i + 2) % n];
      const std::optional<PointPx> meet = Intersection(a, b, d, c);
      if (!meet) continue;
      // They must meet beyond the dropped side b-c, not behind their own begins.
      const double beyond = (meet->x - a.x) * (b.x - a.x) + (meet->y - a.y) * (b.y - a.y);
      const double side = (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y);
      if (beyond < side) continue;
      const double area = TriangleArea(b, *meet, c);
      if (area < least) {
        least = area;
        drop = i;
        corner = *meet;
      }
    }
    if (drop == n) return std::nullopt;
    polygon[drop] = corner;
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>((drop + 1) % n));
  }
  if (polygon.size() != 4) return std::nullopt;
  Quad quad{polygon[0], polygon[1], polygon[2], polygon[3]};
  double twice = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    twice += quad[i].x * quad[(i + 1) % 4].y - quad[(i + 1) % 4].x * quad[i].y;
  }
  if (twice < 0) std::swap(quad[1], quad[3]);
  if (!IsConvex(quad)) return std::nullopt;
  return quad;
}

std::optional<RefinedQuad> RefineQuad(const GrayImage& mask, const Quad& start) {
  constexpr int kPlaces = 120;
  constexpr int kFewestHits = 30;
  constexpr double kTolerance = 0.012;  // of the quad's size: a lens bows sides by about 1 %
  RefinedQuad refined{start, 0};
  for (const double reach_share : {0.06, 0.03, 0.02}) {
    const double size = std::sqrt(Area_px2(refined.quad));
    const PointPx inside{
        (refined.quad[0].x + refined.quad[1].x + refined.quad[2].x + refined.quad[3].x) / 4,
        (refined.quad[0].y + refined.quad[1].y + refined.quad[2].y + refined.quad[3].y) / 4};
    std::array<std::array<PointPx, 2>, 4> lines;
    refined.closed = 1;
    for (std::size_t i = 0; i < 4; ++i) {
      const PointPx& a = refined.quad[i];
      const PointPx& b = refined.quad[(i + 1) % 4];
      if (Distance_px(a, b) < 10) return std::nullopt;
      const Side side = MakeSide(a, b, inside);
      const std::vector<Hit> hits = Hits(mask, side, std::max(3.0, reach_share * size), kPlaces);
      if (hits.size() < kFewestHits) return std::nullopt;
      const LineFit fit = FitLine(hits);
      int near = 0;
      for (const Hit& hit : hits) {
        near += std::abs(hit.out - fit.offset - fit.slope * hit.along) <
                std::max(2.0, kTolerance * size);
      }
      refined.closed = std::min(refined.closed, static_cast<double>(near) / kPlaces);
      lines[i] = {side.At(0, fit.offset),
                  side.At(side.length, fit.offset + fit.slope * side.length)};
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const std::array<PointPx, 2>& before = lines[(i + 3) % 4];
      const std::optional<PointPx> corner =
          Intersection(before[0], before[1], lines[i][0], lines[i][1]);
      if (!corner) return std::nullopt;
      refined.quad[i] = *corner;
    }
    if (!IsConvex(refined.quad)) return std::nullopt;
  }
  return refined;
}

}  // namespace trammel::vision
