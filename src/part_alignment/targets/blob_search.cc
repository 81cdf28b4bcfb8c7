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

constexpr int kWindow_px = 41;    ///< of the mean: a disc's gap and the half of its edge fit in
constexpr int kShrunk = 4;        ///< times, a picture in which large discs are looked for
constexpr double kLarge_px = 30;  ///< radius from which on a shrunk picture shows a disc

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
  std::vector<Blob> blobs;
  const Radii all{rules.min_radius_px - 0.5, 1.1 * rules.max_radius_px + kFoot_px};
  AddBlobs(soft, all, std::max(kLeastStep, std::ceil(kSigmas * noise) - 1), rules, blobs);
  const bool fits = std::min(picture.width, picture.height) > 2 * kLarge_px;
  if (rules.max_radius_px > kLarge_px && fits) {
    cv::Mat shrunk;
    cv::resize(soft, shrunk, {}, 1.0 / kShrunk, 1.0 / kShrunk, cv::INTER_AREA);
    const std::size_t before = blobs.size();
    AddBlobs(shrunk, {kLarge_px / kShrunk, all.most / kShrunk}, kLeastStep, rules, blobs);
    for (std::size_t i = before; i < blobs.size(); ++i) {
      Middle& of = blobs[i].middle;
      of.column_px = kShrunk * (of.column_px + 0.5) - 0.5;
      of.row_px = kShrunk * (of.row_px + 0.5) - 0.5;
      of.xx *= kShrunk;
      of.xy *= kShrunk;
      of.yy *= kShrunk;
    }
  }
  std::stable_sort(blobs.begin(), blobs.end(), [](const Blob& a, const Blob& b) {
    return RadiusOf(a.middle) > RadiusOf(b.middle);
  });
  return blobs;
}

}  // namespace trammel::part_alignment
