#include "pressure_advance/setup/mark_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "base/square.h"
#include "base/statistics.h"
#include "geometry/robust_line.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kSmallest_px = 32;
constexpr double kSearchWidth_px = 400;  // shrunk picture in which the square is searched
constexpr double kSurroundings = 0.2;    // of its width: reference beside a bead
constexpr double kMinClear = 6;          // bead over the shrunk picture's noise
constexpr double kMinSide = 0.06;        // relative to the picture's shorter side

MarkReading Fault(std::string why) {
  MarkReading reading;
  reading.fault = std::move(why);
  return reading;
}

// Square ring in the reduced picture.
struct Ring {
  cv::RotatedRect box;
  double weight = 0;  // area times contrast
  bool inside = true;
};

// Collects pieces of a mask that fill their hull by the same share as the shape's ring.
void CollectRings(const cv::Mat& mask, const cv::Mat& contrast, const MarkShape& shape,
                  std::vector<Ring>& rings) {
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const double ratio = shape.bead_mm / (shape.side_mm + shape.bead_mm);
  const double fills = 1 - (1 - 2 * ratio) * (1 - 2 * ratio);
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    const std::vector<cv::Point>& outline = outlines[i];
    const cv::Rect around = cv::boundingRect(outline);
    if (std::min(around.width, around.height) < kMinSide * std::min(mask.cols, mask.rows)) {
      continue;
    }
    std::vector<cv::Point> hull;
    cv::convexHull(outline, hull);
    const double hull_area = cv::contourArea(hull);
    const cv::RotatedRect box = cv::minAreaRect(hull);
    const double longer = std::max(box.size.width, box.size.height);
    const double shorter = std::min(box.size.width, box.size.height);
    constexpr double kSquare = 0.8, kFullHull = 0.85;
    if (shorter < kSquare * longer || hull_area < kFullHull * longer * shorter) continue;
    cv::Mat piece = cv::Mat::zeros(mask.size(), CV_8U);
    cv::drawContours(piece, outlines, static_cast<int>(i), 255, cv::FILLED);
    cv::bitwise_and(piece, mask, piece);
    const double filled = cv::countNonZero(piece) / std::max(1.0, hull_area);
    if (filled < 0.3 * fills || filled > 2.5 * fills) continue;  // broken, and blurred
    const bool inside =
        around.x > 0 && around.y > 0 && around.br().x < mask.cols && around.br().y < mask.rows;
    rings.push_back(
        {box, std::abs(cv::mean(contrast, piece)[0]) * cv::countNonZero(piece), inside});
  }
}

struct Found {
  std::optional<Ring> ring;
  double scale = 1;  // shrunk px per px
  double clear = 0;  // strongest contrast over noise
  bool darker = false;
};

Found FindRing(const cv::Mat& gray, const MarkShape& shape) {
  Found found;
  found.scale = std::min(1.0, kSearchWidth_px / std::max(gray.cols, gray.rows));
  cv::Mat small, smooth, around;
  cv::resize(gray, small, {}, found.scale, found.scale, cv::INTER_AREA);
  cv::GaussianBlur(small, smooth, {}, 1);
  const int window = 2 * static_cast<int>(kSurroundings * small.cols / 2) + 1;
  cv::blur(small, around, {window, window}, {-1, -1}, cv::BORDER_REFLECT);
  const cv::Mat contrast = smooth - around;
  std::vector<double> levels;
  for (int y = 0; y < contrast.rows; ++y) {
    const float* row = contrast.ptr<float>(y);
    levels.insert(levels.end(), row, row + contrast.cols);
  }
  const double noise = std::max(0.1, RobustStandardDeviation(levels));
  for (const bool darker : {true, false}) {
    const double strongest = darker ? -Quantile(levels, 0.005) : Quantile(levels, 0.995);
    found.clear = std::max(found.clear, strongest / noise);
    if (strongest < kMinClear * noise) continue;
    for (const double share : {0.5, 0.35}) {
      cv::Mat mask = darker ? contrast < -share * strongest : contrast > share * strongest;
      cv::morphologyEx(mask, mask, cv::MORPH_CLOSE,
                       cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
      std::vector<Ring> rings;
      CollectRings(mask, contrast, shape, rings);
      for (const Ring& ring : rings) {
        if (found.ring && found.ring->weight >= ring.weight) continue;
        found.ring = ring;
        found.darker = darker;
      }
    }
  }
  return found;
}

// Explains why a picture shows no mark.
MarkReading NothingThere(const cv::Mat& gray, double clear) {
  std::vector<double> levels;
  for (int y = 0; y < gray.rows; y += 4) {
    for (int x = 0; x < gray.cols; x += 4) levels.push_back(gray.at<float>(y, x));
  }
  constexpr double kDark = 6, kFull = 250;
  const double typical = Median(levels);
  MarkReading reading;
  reading.blind = typical < kDark || typical > kFull;
  if (typical < kDark) {
    reading.fault = fmt::format(
        "the picture is too dark to show the mark (typically {:.0f} of 255 grey levels): switch "
        "on a light ([scan] lights_on_gcode) or raise the camera's exposure",
        typical);
  } else if (typical > kFull) {
    reading.fault = fmt::format(
        "the picture is overexposed (typically {:.0f} of 255 grey levels): lower the camera's "
        "exposure",
        typical);
  } else {
    reading.fault = fmt::format(
        "no square mark is in the picture (typically {:.0f} grey levels, the clearest thing stands "
        "out {:.1f} times the noise)",
        typical, clear);
  }
  return reading;
}

using vision::PointPx;

constexpr int kSections = 40;
constexpr double kEnds = 0.15;       // of a side: rounded corners
constexpr double kHalfWindow = 1.5;  // beads to either side of the guess
constexpr int kPasses = 3;

double At(const vision::GrayImage& image, double x, double y) {
  const double fx = std::clamp(x, 0.0, image.width - 1.001);
  const double fy = std::clamp(y, 0.0, image.height - 1.001);
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  const double tx = fx - ix, ty = fy - iy;
  const float* upper = image.row(iy) + ix;
  const float* lower = image.row(iy + 1) + ix;
  return (1 - ty) * ((1 - tx) * upper[0] + tx * upper[1]) +
         ty * ((1 - tx) * lower[0] + tx * lower[1]);
}

// Side of the ring, with its sections' middles relative to the line between two corners.
struct Side {
  PointPx from, along, normal;  // unit vectors
  double length = 0;
  double offset = 0, slope = 0;  // of the centre line: distance along the normal by position
  double sigma = 0;              // at its middle
  double contrast = 0;
};

// Middle of the bead in one section, and the amount of bead there.
struct Section {
  double middle = 0, mass = 0;
};

Section Cut(const vision::GrayImage& image, const Side& side, double place, double half_px,
            double strip_px, bool darker) {
  const int steps = std::max(8, static_cast<int>(std::ceil(2 * half_px / 0.5)));
  std::vector<double> distance, level;
  for (int i = 0; i <= steps; ++i) {
    const double d = -half_px + 2 * half_px * i / steps;
    double sum = 0;
    int count = 0;
    for (double s = -strip_px / 2; s <= strip_px / 2; s += 1, ++count) {
      const double p = place + s;
      sum += At(image, side.from.x + p * side.along.x + d * side.normal.x,
                side.from.y + p * side.along.y + d * side.normal.y);
    }
    distance.push_back(d);
    level.push_back((darker ? -1 : 1) * sum / count);
  }
  // Subtracts the plate on both sides: a straight line between the means of the outer sixths.
  const std::size_t sixth = std::max<std::size_t>(1, level.size() / 6);
  const auto count = static_cast<double>(sixth);
  double low = 0, high = 0;
  for (std::size_t i = 0; i < sixth; ++i) {
    low += level[i] / count, high += level[level.size() - 1 - i] / count;
  }
  const double reach = half_px * (1 - count / static_cast<double>(level.size()));
  Section section;
  double moment = 0;
  for (std::size_t i = sixth; i < level.size() - sixth; ++i) {
    const double plate = 0.5 * (low + high) + 0.5 * (high - low) * distance[i] / reach;
    section.mass += level[i] - plate;
    moment += distance[i] * (level[i] - plate);
  }
  if (section.mass > 0) section.middle = moment / section.mass;
  return section;
}

// About where the centre lines cross, in order along the outline.
struct SquareGuess {
  std::array<PointPx, 4> corners;
  double bead_px = 0;
  bool darker = false;
};

bool PlaceSide(const vision::GrayImage& image, const SquareGuess& guess, Side& side) {
  const double step = (1 - 2 * kEnds) * side.length / kSections;
  std::vector<double> place, middle, mass;
  for (int i = 0; i < kSections; ++i) {
    const double p = kEnds * side.length + (i + 0.5) * step;
    const Section section =
        Cut(image, side, p, kHalfWindow * guess.bead_px, std::max(1.0, step - 1), guess.darker);
    place.push_back(p), middle.push_back(section.middle), mass.push_back(section.mass);
  }
  const double typical = Median(mass);
  if (!(typical > 0)) return false;
  std::vector<double> x, y, scratch;
  for (std::size_t i = 0; i < place.size(); ++i) {
    constexpr double kThin = 0.5, kThick = 1.6;
    if (mass[i] < kThin * typical || mass[i] > kThick * typical) continue;
    x.push_back(place[i] - side.length / 2), y.push_back(middle[i]);
  }
  if (2 * x.size() < kSections) return false;
  const auto robust = geometry::FitRobustLine(x, y, scratch);
  const double reach = std::max(0.3, 4 * 1.4826 * robust.median_residual);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::abs(y[i] - robust.at(x[i])) > reach) continue;
    n += 1, sx += x[i], sy += y[i], sxx += x[i] * x[i], sxy += x[i] * y[i];
  }
  const double spread = sxx - sx * sx / n;
  if (n < 8 || !(spread > 0)) return false;
  side.slope = (sxy - sx * sy / n) / spread;
  side.offset = (sy - side.slope * sx) / n;
  std::vector<double> left;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double off = y[i] - side.offset - side.slope * x[i];
    if (std::abs(off) <= reach) left.push_back(off);
  }
  // Neighbouring sections share the bead's own waviness: a quarter of them count.
  side.sigma = StandardDeviation(left) / std::sqrt(std::max(1.0, n / 4));
  side.contrast = typical / (2 * kHalfWindow * guess.bead_px / 0.5) * 2 * kHalfWindow;
  return true;
}

Side Between(const PointPx& from, const PointPx& to) {
  Side side;
  side.from = from;
  side.length = std::hypot(to.x - from.x, to.y - from.y);
  side.along = {(to.x - from.x) / side.length, (to.y - from.y) / side.length};
  side.normal = {-side.along.y, side.along.x};
  return side;
}

// Centre line as a point and a direction.
struct Line {
  PointPx point, along;
};

Line LineOf(const Side& side) {
  const double half = side.length / 2;
  const double cosine = 1 / std::hypot(1.0, side.slope), sine = side.slope * cosine;
  return {
      {side.from.x + half * side.along.x + side.offset * side.normal.x,
       side.from.y + half * side.along.y + side.offset * side.normal.y},
      {cosine * side.along.x + sine * side.normal.x, cosine * side.along.y + sine * side.normal.y}};
}

std::optional<PointPx> Cross(const Line& a, const Line& b) {
  const double turn = a.along.x * b.along.y - a.along.y * b.along.x;
  if (std::abs(turn) < 0.1) return std::nullopt;
  const double t =
      ((b.point.x - a.point.x) * b.along.y - (b.point.y - a.point.y) * b.along.x) / turn;
  return PointPx{a.point.x + t * a.along.x, a.point.y + t * a.along.y};
}

std::string NoSquare(const std::array<PointPx, 4>& corners) {
  double shortest = 1e9, longest = 0, skew = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Side side = Between(corners[i], corners[(i + 1) % 4]);
    const Side next = Between(corners[(i + 1) % 4], corners[(i + 2) % 4]);
    shortest = std::min(shortest, side.length), longest = std::max(longest, side.length);
    skew = std::max(skew, std::abs(side.along.x * next.along.x + side.along.y * next.along.y));
  }
  constexpr double kUnlike = 0.08, kSkew = 0.06;  // 5 % and 3 degrees beyond what is measured later
  if (longest - shortest <= kUnlike * longest && skew <= kSkew) return {};
  return fmt::format(
      "the mark is no square in the picture: its sides are {:.0f} to {:.0f} px long, its corners "
      "up to {:.1f} degrees from square; is the camera looking straight down, is the mark whole?",
      shortest, longest, std::asin(std::min(1.0, skew)) * 180 / std::numbers::pi);
}

// Sections across each side but for its ends give the bead's middle, a robust line through them the
// side. A fault where a side is not seen or the four make no square.
MarkReading PlaceSides(const vision::GrayImage& image, const SquareGuess& guess) {
  std::array<PointPx, 4> corners = guess.corners;
  std::array<Side, 4> sides;
  for (int pass = 0; pass < kPasses; ++pass) {
    std::array<Line, 4> lines;
    for (std::size_t i = 0; i < 4; ++i) {
      sides[i] = Between(corners[i], corners[(i + 1) % 4]);
      if (!(sides[i].length > 4 * guess.bead_px) || !PlaceSide(image, guess, sides[i])) {
        return Fault("a side of the mark is not seen whole: is it printed well, is it lit evenly?");
      }
      lines[i] = LineOf(sides[i]);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const auto corner = Cross(lines[(i + 3) % 4], lines[i]);
      if (!corner) return Fault("the sides found for the mark do not meet");
      corners[i] = *corner;
    }
  }
  MarkReading reading;
  reading.fault = NoSquare(corners);
  reading.darker = guess.darker;
  reading.corners = corners;
  if (!reading.fault.empty()) return reading;
  // Mean of the corners: half the scatter of the diagonals' intersection, with a bias of 0.01 mm at
  // 3 degrees of tilt.
  for (const PointPx& corner : corners) {
    reading.column_px += corner.x / 4;
    reading.row_px += corner.y / 4;
  }
  double variance = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    reading.side_px += Between(corners[i], corners[(i + 1) % 4]).length / 4;
    variance += Square(sides[i].sigma) / 4;
    reading.contrast += sides[i].contrast / 4;
  }
  reading.sigma_px = std::sqrt(variance / 2);  // two sides to either direction
  const Side side = Between(corners[0], corners[1]);
  double turn = std::atan2(side.along.y, side.along.x);
  const double quarter = std::numbers::pi / 2;
  reading.turn_rad = turn - quarter * std::round(turn / quarter);
  return reading;
}

}  // namespace

MarkReading ReadMark(const BgrView& frame, const MarkShape& shape) {
  if (frame.width < kSmallest_px || frame.height < kSmallest_px) {
    return Fault(fmt::format("a picture of {} x {} px is too small: at least {} x {} are needed",
                             frame.width, frame.height, kSmallest_px, kSmallest_px));
  }
  const cv::Mat bgr(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.data),
                    static_cast<std::size_t>(frame.stride));
  cv::Mat gray;
  cv::transform(bgr, gray, cv::Matx13f(1.0F / 3, 1.0F / 3, 1.0F / 3));
  gray.convertTo(gray, CV_32F);
  const Found found = FindRing(gray, shape);
  if (!found.ring) return NothingThere(gray, found.clear);
  const Ring& ring = *found.ring;
  if (!ring.inside) return Fault("the mark reaches out of the picture");
  cv::Point2f points[4];
  ring.box.points(points);
  const double outer = 0.5 * (ring.box.size.width + ring.box.size.height) / found.scale;
  const double bead_px = outer * shape.bead_mm / (shape.side_mm + shape.bead_mm);
  SquareGuess guess{{}, bead_px, found.darker};
  for (std::size_t i = 0; i < 4; ++i) {  // outer edge to centre line
    const double inward = 1 - bead_px / outer;
    const double x = ring.box.center.x + inward * (points[i].x - ring.box.center.x);
    const double y = ring.box.center.y + inward * (points[i].y - ring.box.center.y);
    guess.corners[i] = {(x + 0.5) / found.scale - 0.5, (y + 0.5) / found.scale - 0.5};
  }
  const vision::GrayImage image = [&] {
    vision::GrayImage copy(gray.cols, gray.rows);
    for (int y = 0; y < gray.rows; ++y) std::copy_n(gray.ptr<float>(y), gray.cols, copy.row(y));
    return copy;
  }();
  return PlaceSides(image, guess);
}

}  // namespace trammel::pressure_advance
