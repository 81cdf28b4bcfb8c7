#include "part_alignment/targets/blob_search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "part_alignment/targets/quieten.h"

namespace trammel::part_alignment {
namespace {

constexpr int kWindow_px = 15;  ///< of the mean: small enough to see the gap about a small disc

/// The radii that are looked for, px of the picture that is searched.
struct Radii {
  double least = 0;
  double most = 0;
};

double RadiusOf(const Middle& of) { return std::sqrt(of.xx * of.yy - of.xy * of.xy); }

/// The ellipse with the moments of what an outline goes around; absent where that is no ellipse.
std::optional<Middle> EllipseOf(const std::vector<cv::Point>& outline, const Radii& radii) {
  constexpr double kPi = std::numbers::pi;
  constexpr double kLeastRatio = 0.25;  // of the axes
  constexpr double kLeastFilled = 0.9;  // area by that of the ellipse of the same moments
  const double area = cv::contourArea(outline);
  if (area < 0.5 * kPi * radii.least * radii.least * kLeastRatio ||
      area > kPi * radii.most * radii.most) {
    return std::nullopt;
  }
  const cv::Moments moments = cv::moments(outline);
  const double a = moments.mu20 / moments.m00;
  const double b = moments.mu11 / moments.m00;
  const double c = moments.mu02 / moments.m00;
  const double det = a * c - b * b;
  if (!(det > 0)) return std::nullopt;
  const double root = std::sqrt(det);
  if (area < kLeastFilled * 4 * kPi * root) return std::nullopt;
  const double mean = 0.5 * (a + c);
  const double spread = std::hypot(0.5 * (a - c), b);
  if (mean - spread < kLeastRatio * kLeastRatio * (mean + spread)) return std::nullopt;
  // An ellipse's variance along an axis is a quarter of the axis' square. The outline goes through
  // the middles of its pixels, half a pixel within.
  const double norm = 0.5 * std::sqrt(a + c + 2 * root);
  const double wider = 1 + 0.5 / (2 * std::sqrt(root));
  Middle middle;
  middle.column_px = moments.m10 / moments.m00;
  middle.row_px = moments.m01 / moments.m00;
  middle.xx = wider * (a + root) / norm;
  middle.xy = wider * b / norm;
  middle.yy = wider * (c + root) / norm;
  const double radius = RadiusOf(middle);
  if (radius < radii.least || radius > radii.most) return std::nullopt;
  return middle;
}

/// @param least_step  grey levels of difference from the mean around.
void AddBlobs(const cv::Mat& picture, const Radii& radii, double least_step, const BlobRules& rules,
              std::vector<Blob>& blobs) {
  cv::Mat around;
  cv::boxFilter(picture, around, CV_8U, {kWindow_px, kWindow_px}, {-1, -1}, true,
                cv::BORDER_REPLICATE);
  cv::Mat differs;
  for (const bool dark : {true, false}) {
    if (!(dark ? rules.dark : rules.bright)) continue;
    cv::subtract(dark ? around : picture, dark ? picture : around, differs);
    cv::threshold(differs, differs, least_step, 255, cv::THRESH_BINARY);
    std::vector<std::vector<cv::Point>> outlines;
    std::vector<cv::Vec4i> levels;
    cv::findContours(differs, outlines, levels, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE);
    for (std::size_t i = 0; i < outlines.size(); ++i) {
      constexpr int kParent = 3;
      if (levels[i][kParent] >= 0 || outlines[i].size() < 4) continue;  // of a hole, or noise
      if (const auto middle = EllipseOf(outlines[i], radii)) blobs.push_back({*middle, dark});
    }
  }
}

}  // namespace

std::vector<Blob> FindBlobs(const PageView& picture, const BlobRules& rules) {
  constexpr double kLeastStep = 2;  // grey levels
  constexpr double kSigmas = 3.2;
  constexpr double kBlurred = 0.273;  // what binomial weights of 5 x 5 pixels leave of noise
  constexpr double kFoot_px = 2;      // how far beyond its edge a small disc's outline may lie
  // OpenCV's pictures have no constant pixels; it reads this one.
  cv::Mat soft(picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.data),
               static_cast<std::size_t>(picture.stride));
  double noise = kQuietNoise * rules.noise;
  if (rules.noise > kNoisy) {
    cv::Mat softer;
    cv::GaussianBlur(soft, softer, {3, 3}, 0);
    soft = softer;
    noise = kBlurred * rules.noise;
  }
  const double step = std::max(kLeastStep, std::ceil(kSigmas * noise));
  const double most = 1.1 * rules.max_radius_px + kFoot_px;
  constexpr double kSpan = 2.8;  // of radii that one scale shows; the next one's are twice as large
  Radii radii{rules.min_radius_px - 0.5, kSpan * rules.min_radius_px};
  std::vector<Blob> blobs;
  for (double scale = 1; radii.least * scale < most; scale *= 2) {
    const std::size_t before = blobs.size();
    AddBlobs(soft, {radii.least, std::min(radii.most, most / scale)}, step, rules, blobs);
    for (std::size_t i = before; i < blobs.size(); ++i) {
      Middle& of = blobs[i].middle;
      of.column_px = scale * (of.column_px + 0.5) - 0.5;
      of.row_px = scale * (of.row_px + 0.5) - 0.5;
      of.xx *= scale;
      of.xy *= scale;
      of.yy *= scale;
    }
    if (std::min(soft.cols, soft.rows) < 2 * kWindow_px) break;
    const cv::Size size(soft.cols / 2, soft.rows / 2);
    cv::Mat half;
    cv::resize(soft({0, 0, 2 * size.width, 2 * size.height}), half, size, 0, 0, cv::INTER_AREA);
    soft = half;
    radii.least = rules.min_radius_px;
  }
  std::stable_sort(blobs.begin(), blobs.end(), [](const Blob& a, const Blob& b) {
    return RadiusOf(a.middle) > RadiusOf(b.middle);
  });
  return blobs;
}

}  // namespace trammel::part_alignment
