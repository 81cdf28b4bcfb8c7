#include "vision/image.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "geometry/linear_systems.h"

namespace trammel::vision {
namespace {

double Cross(const PointPx& a, const PointPx& b, const PointPx& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Returns twice the smallest triangle of three corners, over the quad's squared size.
double Flatness(const Quad& quad) {
  double smallest = 1e300;
  double longest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    smallest = std::min(smallest, std::abs(Cross(quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4])));
    longest = std::max(longest, Distance_px(quad[i], quad[(i + 1) % 4]));
  }
  return longest > 0 ? smallest / (longest * longest) : 0;
}

}  // namespace

PointPx Homography::operator()(const PointPx& p) const {
  const double w = m[6] * p.x + m[7] * p.y + m[8];
  return {(m[0] * p.x + m[1] * p.y + m[2]) / w, (m[3] * p.x + m[4] * p.y + m[5]) / w};
}

Homography Product(const Homography& a, const Homography& b) {
  Homography c;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      double sum = 0;
      for (int i = 0; i < 3; ++i) sum += a.m[3 * row + i] * b.m[3 * i + column];
      c.m[3 * row + column] = sum;
    }
  }
  return c;
}

std::optional<Homography> TargetFromSource(const Quad& target, const Quad& source) {
  constexpr double kFlattest = 1e-6;
  if (!(Flatness(target) > kFlattest) || !(Flatness(source) > kFlattest)) return std::nullopt;
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const PointPx& s = source[static_cast<std::size_t>(i)];
    const PointPx& t = target[static_cast<std::size_t>(i)];
    a.row(2 * i) << s.x, s.y, 1, 0, 0, 0, -s.x * t.x, -s.y * t.x;
    a.row(2 * i + 1) << 0, 0, 0, s.x, s.y, 1, -s.x * t.y, -s.y * t.y;
    b(2 * i) = t.x;
    b(2 * i + 1) = t.y;
  }
  const Eigen::Matrix<double, 8, 1> h = geometry::SolveSquare(a, b);
  if (!h.allFinite()) return std::nullopt;
  Homography homography;
  for (int i = 0; i < 8; ++i) homography.m[static_cast<std::size_t>(i)] = h(i);
  return homography;
}

bool IsConvex(const Quad& quad) {
  int left = 0;
  int right = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double turn = Cross(quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]);
    left += turn > 0;
    right += turn < 0;
  }
  return left == 4 || right == 4;
}

double Area_px2(const Quad& quad) {
  double twice = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const PointPx& a = quad[i];
    const PointPx& b = quad[(i + 1) % 4];
    twice += a.x * b.y - b.x * a.y;
  }
  return std::abs(twice) / 2;
}

double Distance_px(const PointPx& a, const PointPx& b) { return std::hypot(a.x - b.x, a.y - b.y); }

namespace {

constexpr int kLongestSide_px = 16384;  // warpPerspective keeps places in 16-bit numbers

cv::Matx33d Matrix(const Homography& homography) { return cv::Matx33d(homography.m.data()); }

void CheckSizes(int width, int height, int source_width, int source_height) {
  TRAMMEL_CHECK(std::min({width, height, source_width, source_height}) >= 1 &&
                    std::max({width, height, source_width, source_height}) <= kLongestSide_px,
                "{} x {} from {} x {}", width, height, source_width, source_height);
}

cv::Mat Wrap(const BgrView& view) {
  // OpenCV has no read-only view; nothing here writes through it.
  return {view.height, view.width, CV_8UC3, const_cast<std::uint8_t*>(view.data),
          static_cast<std::size_t>(view.stride)};
}

}  // namespace

Frame Rectify(const BgrView& photo, const Homography& photo_from_rectified, int width_px,
              int height_px) {
  CheckSizes(width_px, height_px, photo.width, photo.height);
  Frame result(width_px, height_px);
  cv::Mat target(height_px, width_px, CV_8UC3, result.bgr.data());
  cv::warpPerspective(Wrap(photo), target, Matrix(photo_from_rectified), target.size(),
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return result;
}

GrayImage Rectify(const GrayImage& image, const Homography& image_from_rectified, int width_px,
                  int height_px) {
  CheckSizes(width_px, height_px, image.width, image.height);
  GrayImage result(width_px, height_px);
  const cv::Mat source(image.height, image.width, CV_32F, const_cast<float*>(image.value.data()));
  cv::Mat target(height_px, width_px, CV_32F, result.value.data());
  cv::warpPerspective(source, target, Matrix(image_from_rectified), target.size(),
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_CONSTANT);
  return result;
}

Frame ShrinkToFit(const BgrView& photo, int longest_px, double max_px, double& scale) {
  TRAMMEL_CHECK(photo.width >= 1 && photo.height >= 1, "{} x {}", photo.width, photo.height);
  scale = std::min({1.0, static_cast<double>(longest_px) / std::max(photo.width, photo.height),
                    std::sqrt(max_px / (static_cast<double>(photo.width) * photo.height))});
  Frame result(std::max(1, static_cast<int>(photo.width * scale)),
               std::max(1, static_cast<int>(photo.height * scale)));
  cv::Mat target(result.height, result.width, CV_8UC3, result.bgr.data());
  if (scale < 1) {
    cv::resize(Wrap(photo), target, target.size(), 0, 0, cv::INTER_AREA);
  } else {
    Wrap(photo).copyTo(target);
  }
  return result;
}

}  // namespace trammel::vision
