#include "pressure_advance/photo/other_patterns.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "pressure_advance/photo/photo_search.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {
namespace {

constexpr std::size_t kFewestPatternLines = 5;  // fewer are a frame's or a neighbour's

PhotoLines LinesOfAnyTool(PhotoSearch& photo) {
  PhotoOptions options;
  options.framed = false;
  options.pressure_advance_s.resize(kUsualLines);
  return FindPhotoLines(photo, options);
}

}  // namespace

std::size_t OtherPattern::count() const {
  return chevrons ? static_cast<std::size_t>(chevrons->count) : lines.line_pattern.rungs.size();
}

Frame WithoutPattern(const BgrView& photo, std::span<const vision::PointPx> outline) {
  constexpr double kGrow = 1.15;  // of the outline about its middle: labels are 14 mm long
  constexpr double kFar_px = 1e5;
  vision::PointPx middle;
  for (const vision::PointPx& p : outline) {
    middle.x += p.x / static_cast<double>(outline.size());
    middle.y += p.y / static_cast<double>(outline.size());
  }
  const auto grown = [&](double from, double to) {
    return static_cast<int>(std::clamp(from + kGrow * (to - from), -kFar_px, kFar_px));
  };
  std::vector<cv::Point> corners;
  for (const vision::PointPx& p : outline) {
    corners.emplace_back(grown(middle.x, p.x), grown(middle.y, p.y));
  }
  double scale = 1;
  Frame rest = vision::ShrinkToFit(photo, std::max(photo.width, photo.height), 1e18, scale);
  cv::Mat bgr(rest.height, rest.width, CV_8UC3, rest.bgr.data());
  cv::Mat mask(bgr.size(), CV_8U, cv::Scalar(0)), around;
  cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255));
  const int ring_px = std::max(rest.width, rest.height) / 100 + 1;
  cv::dilate(mask, around, cv::Mat::ones(2 * ring_px + 1, 2 * ring_px + 1, CV_8U));
  bgr.setTo(cv::mean(bgr, around - mask), mask);
  return rest;
}

std::optional<OtherPattern> FindOtherPattern(const BgrView& photo,
                                             std::span<const vision::PointPx> outline) {
  constexpr int kLongest_px = 2000;
  double scale = 1;
  const Frame small = vision::ShrinkToFit(photo, kLongest_px, 1e18, scale);
  const double shift = (1 / scale - 1) / 2;  // pixel centres have whole coordinates
  std::vector<vision::PointPx> reduced;
  for (const vision::PointPx& p : outline) {
    reduced.push_back({(p.x - shift) * scale, (p.y - shift) * scale});
  }
  PhotoSearch rest(outline.empty() ? small : WithoutPattern(small.view(), reduced));
  OtherPattern other;
  other.chevrons = vision::FindChevrons(rest.picture().view(), rest.Combs());
  if (other.chevrons) {
    other.chevrons->photo_from_plane = vision::Product(
        {{1 / scale, 0, shift, 0, 1 / scale, shift, 0, 0, 1}}, other.chevrons->photo_from_plane);
    return other;
  }
  other.lines = LinesOfAnyTool(rest);
  if (!other.lines.problem.empty() || other.count() < kFewestPatternLines) return std::nullopt;
  for (vision::PointPx& p : other.lines.corners) p = {p.x / scale + shift, p.y / scale + shift};
  return other;
}

std::size_t CountOfOtherKind(PhotoSearch& photo, PatternForm expected) {
  if (expected == PatternForm::kLines) {
    const auto chevrons = vision::FindChevrons(photo.picture().view(), photo.Combs());
    return chevrons ? static_cast<std::size_t>(chevrons->count) : 0;
  }
  const PhotoLines lines = LinesOfAnyTool(photo);
  const std::size_t count = lines.problem.empty() ? lines.line_pattern.rungs.size() : 0;
  return count < kFewestPatternLines ? 0 : count;
}

bool InTwoGroups(const vision::LinePattern& lines) {
  constexpr int kRoom = 4;  // places
  for (std::size_t i = 0; i < lines.steps.size(); ++i) {
    if (lines.steps[i] >= kRoom && i + 1 >= kFewestPatternLines &&
        lines.rungs.size() - i - 1 >= kFewestPatternLines) {
      return true;
    }
  }
  return false;
}

}  // namespace trammel::pressure_advance
