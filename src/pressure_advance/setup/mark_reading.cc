#include "pressure_advance/setup/mark_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/setup/mark_sides.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kSmallest_px = 32;
constexpr double kSearchWidth_px = 400;  // of the shrunk picture in which the square is sought
constexpr double kSurroundings = 0.2;    // of its width: what a bead is compared with
constexpr double kLeastClear = 6;        // bead over the shrunk picture's noise
constexpr double kLeastSide = 0.06;      // of the picture's shorter side

MarkReading Fault(std::string why) {
  MarkReading reading;
  reading.fault = std::move(why);
  return reading;
}

// A square ring in the shrunk picture.
struct Ring {
  cv::RotatedRect box;
  double weight = 0;  // area times contrast
  bool inside = true;
};

// Pieces of a mask that fill their hull as the ring of the shape does.
void CollectRings(const cv::Mat& mask, const cv::Mat& contrast, const MarkShape& shape,
                  std::vector<Ring>& rings) {
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const double ratio = shape.bead_mm / (shape.side_mm + shape.bead_mm);
  const double fills = 1 - (1 - 2 * ratio) * (1 - 2 * ratio);
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    const std::vector<cv::Point>& outline = outlines[i];
    const cv::Rect around = cv::boundingRect(outline);
    if (std::min(around.width, around.height) < kLeastSide * std::min(mask.cols, mask.rows)) {
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
    if (strongest < kLeastClear * noise) continue;
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

// Why a picture without a mark shows none.
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
  for (std::size_t i = 0; i < 4; ++i) {  // from the outer edge to the centre line
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
