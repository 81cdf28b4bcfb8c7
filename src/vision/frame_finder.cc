#include "vision/frame_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "base/statistics.h"
#include "vision/filament_contrast.h"
#include "vision/image.h"

namespace trammel::vision {
namespace {

constexpr int kLongestSearched_px = 1000;  // of the shrunk picture that is searched
constexpr double kSmallestArea = 0.02;     // of the picture that a frame encloses
constexpr double kMinClosed = 0.7;         // share of each side that must be seen as filament
constexpr std::size_t kMaxFound = 10;

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

// Side in its own frame: along from corner to corner, outward positive.
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

// Finds, for places along the side, the start of the mask nearest to it. A start needs two set
// pixels behind it, so that speckles do not count.
std::vector<Hit> Hits(const GrayImage& mask, const Side& side, double reach, int places) {
  std::vector<Hit> hits;
  for (int i = 0; i < places; ++i) {
    // Corners are round: the outermost parts of a side are not on its line.
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

// The quadrilateral round a convex polygon in order of at least four corners, found by dropping the
// side whose neighbours close over it with the least extra area until four are left. Clockwise as
// seen; nothing where the polygon has too few sides that can be dropped.
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
      // They must meet beyond the dropped side b-c, not behind their own beginnings.
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

struct RefinedQuad {
  Quad quad;
  double closed = 0;  // share of the worst side with an outline within tolerance
};

// Moves each side of a quadrilateral onto the outline of a mask: the places where, coming from
// outside, the mask begins, fitted by a straight line that ignores outliers.
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

// Parameters of one search in the picture.
struct Look {
  double smooth_px = 1;  // sigma before comparing with the surroundings
  double window = 0.1;   // of the longest side: extent of the surroundings
  int open_px = 0;       // thinner things are cut off
};

std::vector<PointPx> ConvexOutline(const std::vector<cv::Point>& contour) {
  std::vector<cv::Point> hull, simple;
  cv::convexHull(contour, hull);
  cv::approxPolyDP(hull, simple, 0.004 * cv::arcLength(hull, true), true);
  std::vector<PointPx> outline;
  for (const cv::Point& p : simple) outline.push_back({double(p.x), double(p.y)});
  return outline;
}

GrayImage ToGray(const cv::Mat& mask) {
  GrayImage image(mask.cols, mask.rows);
  cv::Mat target(mask.rows, mask.cols, CV_32F, image.value.data());
  mask.convertTo(target, CV_32F, 1.0 / 255);
  return image;
}

bool InsidePicture(const Quad& quad, int width, int height) {
  return std::all_of(quad.begin(), quad.end(), [&](const PointPx& p) {
    return p.x > 1 && p.y > 1 && p.x < width - 2 && p.y < height - 2;
  });
}

// Adds a convex outline as a frame, if the mask begins along all of its sides.
void TryOutline(const std::vector<cv::Point>& points, const GrayImage& mask,
                std::vector<FoundFrame>& found) {
  const std::vector<PointPx> outline = ConvexOutline(points);
  const std::optional<Quad> around = QuadAround(outline);
  if (!around) return;
  const std::optional<RefinedQuad> refined = RefineQuad(mask, *around);
  if (!refined || refined->closed < kMinClosed ||
      Area_px2(refined->quad) < kSmallestArea * mask.width * mask.height ||
      !InsidePicture(refined->quad, mask.width, mask.height)) {
    return;
  }
  found.push_back({refined->quad, refined->closed, mask, 1});
}

// Collects frames among the connected pieces of one mask: by their own outline, and by that of the
// enclosed plate, since glare or strings may touch a frame from outside.
void CollectFrames(const cv::Mat& mask, std::vector<FoundFrame>& found) {
  std::vector<std::vector<cv::Point>> contours;
  std::vector<cv::Vec4i> family;  // next, previous, first child, parent
  cv::findContours(mask, contours, family, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE);
  const double picture = static_cast<double>(mask.cols) * mask.rows;
  constexpr double kLargeHole = 0.02;  // of the frame's smallest area: smaller ones are speckles
  GrayImage gray;
  for (std::size_t i = 0; i < contours.size(); ++i) {
    if (family[i][3] >= 0 || cv::boundingRect(contours[i]).area() < kSmallestArea * picture) {
      continue;
    }
    if (gray.value.empty()) gray = ToGray(mask);
    TryOutline(contours[i], gray, found);
    std::vector<cv::Point> enclosed;
    for (int hole = family[i][2]; hole >= 0; hole = family[static_cast<std::size_t>(hole)][0]) {
      const std::vector<cv::Point>& edge = contours[static_cast<std::size_t>(hole)];
      if (cv::boundingRect(edge).area() < kLargeHole * kSmallestArea * picture) continue;
      enclosed.insert(enclosed.end(), edge.begin(), edge.end());
    }
    if (!enclosed.empty()) TryOutline(enclosed, gray, found);
  }
}

bool Same(const Quad& a, const Quad& b) {
  const double near = 0.02 * std::sqrt(Area_px2(a));
  for (std::size_t turn = 0; turn < 4; ++turn) {
    bool same = true;
    for (std::size_t i = 0; i < 4; ++i) same &= Distance_px(a[i], b[(i + turn) % 4]) < near;
    if (same) return true;
  }
  return false;
}

// Ranks closed frames before open ones, and among these large ones before the holes inside them.
double Rank(const FoundFrame& frame) {
  return frame.closed * std::pow(Area_px2(frame.outer), 0.25);
}

// Returns the best of each, best first.
std::vector<FoundFrame> Distinct(std::vector<FoundFrame> found) {
  std::stable_sort(found.begin(), found.end(),
                   [](const FoundFrame& a, const FoundFrame& b) { return Rank(a) > Rank(b); });
  std::vector<FoundFrame> distinct;
  for (FoundFrame& frame : found) {
    if (distinct.size() == kMaxFound) break;
    if (std::none_of(distinct.begin(), distinct.end(),
                     [&](const FoundFrame& other) { return Same(other.outer, frame.outer); })) {
      distinct.push_back(std::move(frame));
    }
  }
  return distinct;
}

}  // namespace

std::vector<FoundFrame> FindPrintedFrames(const BgrView& photo) {
  TRAMMEL_CHECK(photo.width >= 16 && photo.height >= 16, "{} x {}", photo.width, photo.height);
  double scale = 1;
  Frame small = ShrinkToFit(photo, kLongestSearched_px, 1e18, scale);
  const cv::Mat bgr(small.height, small.width, CV_8UC3, small.bgr.data());
  const int longest = std::max(small.width, small.height);
  const std::vector<cv::Mat> channels = ColourChannels(bgr);
  std::vector<FoundFrame> found;
  for (const cv::Mat& channel : channels) {
    for (const Look& look : {Look{1.0, 0.06, 3}, Look{1.0, 0.12, 5}, Look{2.0, 0.12, 5},
                             Look{2.0, 0.25, 5}, Look{3.0, 0.12, 7}, Look{0.7, 0.06, 0}}) {
      const int window = static_cast<int>(look.window * longest) | 1;
      const cv::Mat contrast = LocalContrast(channel, look.smooth_px, window);
      for (const bool lighter : {true, false}) {
        cv::Mat mask =
            lighter ? cv::Mat(contrast > kFilamentBegins) : cv::Mat(contrast < -kFilamentBegins);
        if (look.open_px > 0) {
          cv::morphologyEx(
              mask, mask, cv::MORPH_OPEN,
              cv::getStructuringElement(cv::MORPH_ELLIPSE, {look.open_px, look.open_px}));
        }
        CollectFrames(mask, found);
        found = Distinct(std::move(found));
      }
    }
  }
  for (FoundFrame& frame : found) {
    frame.filament_scale = scale;
    // Pixel centres have whole coordinates, so that scaling is about (-0.5, -0.5).
    for (PointPx& p : frame.outer) p = {(p.x + 0.5) / scale - 0.5, (p.y + 0.5) / scale - 0.5};
  }
  return found;
}

}  // namespace trammel::vision
