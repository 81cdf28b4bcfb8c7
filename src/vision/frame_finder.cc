#include "vision/frame_finder.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "vision/local_contrast.h"
#include "vision/quad_fit.h"
#include "vision/rectify.h"

namespace trammel::vision {
namespace {

// What one look at the picture depends on.
struct Look {
  double smooth_px = 1;  // sigma before comparing with the surroundings
  double window = 0.1;   // of the longest side: the surroundings
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

// A convex outline as a frame, where the mask begins along all of its sides.
void TryOutline(const std::vector<cv::Point>& points, const GrayImage& mask,
                const FrameFinderOptions& options, std::vector<FoundFrame>& found) {
  const std::vector<PointPx> outline = ConvexOutline(points);
  const std::optional<Quad> around = QuadAround(outline);
  if (!around) return;
  const std::optional<RefinedQuad> refined = RefineQuad(mask, *around);
  if (!refined || refined->closed < options.least_closed ||
      Area_px2(refined->quad) < options.smallest_area * mask.width * mask.height ||
      !InsidePicture(refined->quad, mask.width, mask.height)) {
    return;
  }
  found.push_back({refined->quad, refined->closed, mask, 1});
}

// Frames among the connected pieces of one mask: by their own outline, and by the outline of the
// plate that they enclose, since glare, strings and other things may touch a frame from outside.
void CollectFrames(const cv::Mat& mask, const FrameFinderOptions& options,
                   std::vector<FoundFrame>& found) {
  std::vector<std::vector<cv::Point>> contours;
  std::vector<cv::Vec4i> family;  // next, previous, first child, parent
  cv::findContours(mask, contours, family, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE);
  const double picture = static_cast<double>(mask.cols) * mask.rows;
  constexpr double kLargeHole = 0.02;  // of the frame's smallest area: the rest are speckles
  GrayImage gray;
  for (std::size_t i = 0; i < contours.size(); ++i) {
    if (family[i][3] >= 0 ||
        cv::boundingRect(contours[i]).area() < options.smallest_area * picture) {
      continue;
    }
    if (gray.value.empty()) gray = ToGray(mask);
    TryOutline(contours[i], gray, options, found);
    std::vector<cv::Point> enclosed;
    for (int hole = family[i][2]; hole >= 0; hole = family[static_cast<std::size_t>(hole)][0]) {
      const std::vector<cv::Point>& edge = contours[static_cast<std::size_t>(hole)];
      if (cv::boundingRect(edge).area() < kLargeHole * options.smallest_area * picture) continue;
      enclosed.insert(enclosed.end(), edge.begin(), edge.end());
    }
    if (!enclosed.empty()) TryOutline(enclosed, gray, options, found);
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

// Closed frames before open ones; among these large ones before the holes inside them.
double Rank(const FoundFrame& frame) {
  return frame.closed * std::pow(Area_px2(frame.outer), 0.25);
}

// The best of each, best first.
std::vector<FoundFrame> Distinct(std::vector<FoundFrame> found, std::size_t most) {
  std::stable_sort(found.begin(), found.end(),
                   [](const FoundFrame& a, const FoundFrame& b) { return Rank(a) > Rank(b); });
  std::vector<FoundFrame> distinct;
  for (FoundFrame& frame : found) {
    if (distinct.size() == most) break;
    if (std::none_of(distinct.begin(), distinct.end(),
                     [&](const FoundFrame& other) { return Same(other.outer, frame.outer); })) {
      distinct.push_back(std::move(frame));
    }
  }
  return distinct;
}

}  // namespace

std::vector<FoundFrame> FindPrintedFrames(const BgrView& photo, const FrameFinderOptions& options) {
  TRAMMEL_CHECK(photo.width >= 16 && photo.height >= 16, "{} x {}", photo.width, photo.height);
  double scale = 1;
  Frame small = ShrinkToFit(photo, options.longest_side_px, 1e18, scale);
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
        CollectFrames(mask, options, found);
        found = Distinct(std::move(found), options.most_found);
      }
    }
  }
  for (FoundFrame& frame : found) {
    frame.filament_scale = scale;
    // Pixel centres have whole coordinates, so that a scale acts about (-0.5, -0.5).
    for (PointPx& p : frame.outer) p = {(p.x + 0.5) / scale - 0.5, (p.y + 0.5) / scale - 0.5};
  }
  return found;
}

}  // namespace trammel::vision
