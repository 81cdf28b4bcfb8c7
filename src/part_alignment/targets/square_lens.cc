#include "part_alignment/targets/square_lens.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace trammel::part_alignment {
namespace {

/// A line in the plane without distortion, at distance 1 before the camera.
struct IdealLine {
  ImagePoint at;
  ImagePoint along;
};

struct IdealPoint {
  ImagePoint at;
  double side = 1;  ///< of the camera's origin, as the sign of w
};

std::optional<IdealPoint> Ideal(const Camera& camera, const ImagePoint& pixel) {
  const auto observation = LineOfSight(camera, {pixel.x, pixel.y});
  if (!observation) return std::nullopt;
  return IdealPoint{{observation->x() / observation->z(), observation->y() / observation->z()},
                    observation->z() > 0 ? 1.0 : -1.0};
}

std::optional<ImagePoint> Seen(const Camera& camera, const ImagePoint& ideal, double side) {
  const auto pixel = Project(camera, {side * ideal.x, side * ideal.y, side});
  if (!pixel) return std::nullopt;
  return ImagePoint{pixel->x(), pixel->y()};
}

ImagePoint PointBetween(const ImagePoint& a, const ImagePoint& b, double share) {
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
}

/// The line nearest to what the lens makes of a straight line in the picture. Both are fits by
/// least squares over the same stretch, so that this is the line nearest to the edge.
std::optional<IdealLine> StraightenedEdge(const Camera& camera, const ImagePoint& from,
                                          const ImagePoint& to) {
  constexpr int kPoints = 9;
  constexpr double kFitted = 0.94;  // of an edge; its ends are left out
  std::array<ImagePoint, kPoints> points;
  ImagePoint mean;
  for (int i = 0; i < kPoints; ++i) {
    const double share = 0.5 + kFitted * (i + 0.5 - 0.5 * kPoints) / kPoints;
    const auto ideal = Ideal(camera, PointBetween(from, to, share));
    if (!ideal) return std::nullopt;
    points[static_cast<std::size_t>(i)] = ideal->at;
    mean.x += ideal->at.x / kPoints;
    mean.y += ideal->at.y / kPoints;
  }
  double xx = 0, xy = 0, yy = 0;
  for (const ImagePoint& p : points) {
    xx += (p.x - mean.x) * (p.x - mean.x);
    xy += (p.x - mean.x) * (p.y - mean.y);
    yy += (p.y - mean.y) * (p.y - mean.y);
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  return IdealLine{mean, {std::cos(angle), std::sin(angle)}};
}

ImagePoint Crossing(const IdealLine& a, const IdealLine& b) {
  const double sine = a.along.x * b.along.y - a.along.y * b.along.x;
  const double t = ((b.at.x - a.at.x) * b.along.y - (b.at.y - a.at.y) * b.along.x) / sine;
  return {a.at.x + t * a.along.x, a.at.y + t * a.along.y};
}

/// By how much the lens bends an edge away from the middle of the square.
std::optional<double> LensBow(const Camera& camera, const ImagePoint& from, const ImagePoint& to,
                              const ImagePoint& centre, double side) {
  const auto a = Seen(camera, from, side);
  const auto b = Seen(camera, to, side);
  const auto middle = Seen(camera, PointBetween(from, to, 0.5), side);
  if (!a || !b || !middle) return std::nullopt;
  const auto off = [&](const ImagePoint& p) {
    const ImagePoint span{b->x - a->x, b->y - a->y};
    return ((p.x - a->x) * span.y - (p.y - a->y) * span.x) / std::hypot(span.x, span.y);
  };
  return off(centre) > 0 ? -off(*middle) : off(*middle);
}

}  // namespace

std::optional<StraightenedSquare> Straighten(const Camera& camera, const SquareShape& shape) {
  const auto middle = Ideal(camera, CrossingOfDiagonals(shape.corners));
  if (!middle) return std::nullopt;
  std::array<IdealLine, 4> edges;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto edge = StraightenedEdge(camera, shape.corners[k], shape.corners[(k + 1) % 4]);
    if (!edge) return std::nullopt;
    edges[k] = *edge;
  }
  std::array<ImagePoint, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) corners[k] = Crossing(edges[(k + 3) % 4], edges[k]);
  const auto centre = Seen(camera, CrossingOfDiagonals(corners), middle->side);
  if (!centre) return std::nullopt;
  StraightenedSquare straight{*centre, 0};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto bow = LensBow(camera, corners[k], corners[(k + 1) % 4], *centre, middle->side);
    if (!bow) return std::nullopt;
    const double left = shape.bows_px[k] - *bow;
    if (std::abs(left) > std::abs(straight.bow_px)) straight.bow_px = left;
  }
  return straight;
}

}  // namespace trammel::part_alignment
