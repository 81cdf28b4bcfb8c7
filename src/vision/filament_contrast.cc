#include "vision/filament_contrast.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "geometry/linear_systems.h"

namespace trammel::vision {
namespace {

bool IsGrey(const cv::Mat& bgr) {
  std::vector<cv::Mat> planes;
  cv::split(bgr, planes);
  return cv::norm(planes[0], planes[1], cv::NORM_INF) == 0 &&
         cv::norm(planes[1], planes[2], cv::NORM_INF) == 0;
}

}  // namespace

std::vector<cv::Mat> ColourChannels(const cv::Mat& bgr) {
  cv::Mat lab, grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  if (IsGrey(bgr)) return {grey};
  cv::cvtColor(bgr, lab, cv::COLOR_BGR2Lab);
  std::vector<cv::Mat> channels{grey, {}, {}, {}, {}};
  cv::extractChannel(bgr, channels[1], 0);
  cv::extractChannel(bgr, channels[2], 2);
  cv::extractChannel(lab, channels[3], 1);
  cv::extractChannel(lab, channels[4], 2);
  return channels;
}

cv::Mat LocalContrast(const cv::Mat& channel, double smooth_px, int window_px) {
  cv::Mat contrast, squares, spread;
  channel.convertTo(contrast, CV_32F);
  cv::GaussianBlur(contrast, contrast, {}, smooth_px);
  const cv::Size window(window_px, window_px);
  cv::blur(contrast, squares, window, {-1, -1}, cv::BORDER_REFLECT);
  for (int y = 0; y < contrast.rows; ++y) {
    float *difference = contrast.ptr<float>(y), *square = squares.ptr<float>(y);  // of the mean
    for (int x = 0; x < contrast.cols; ++x) {
      difference[x] -= square[x];
      square[x] = difference[x] * difference[x];
    }
  }
  cv::blur(squares, spread, window, {-1, -1}, cv::BORDER_REFLECT);
  constexpr float kGrain = 1;  // levels: below it there is nothing but rounding
  for (int y = 0; y < contrast.rows; ++y) {
    float* difference = contrast.ptr<float>(y);
    const float* variance = spread.ptr<float>(y);
    for (int x = 0; x < contrast.cols; ++x) {
      // At most a rounding below 0, which is the grain's as well.
      difference[x] /= std::sqrt(std::max(variance[x], kGrain));
    }
  }
  return contrast;
}

namespace {

// Returns the standard deviation of brightness about its local mean, in units of 1 / gain levels.
// Works in bands of rows that stay in the processor's cache, with the rows around them that count.
cv::Mat Spread(const cv::Mat& grey, double sigma_px, double gain) {
  constexpr int kBandRows = 64;
  const int reach = 2 * static_cast<int>(std::ceil(4 * sigma_px) + 1);  // OpenCV's kernels, twice
  cv::Mat levels(grey.size(), CV_8U);
  for (int begin = 0; begin < grey.rows; begin += kBandRows) {
    const int end = std::min(grey.rows, begin + kBandRows);
    const int from = std::max(0, begin - reach), to = std::min(grey.rows, end + reach);
    cv::Mat value, mean, spread;
    grey.rowRange(from, to).convertTo(value, CV_32F);
    cv::GaussianBlur(value, mean, {}, sigma_px);
    value -= mean;
    cv::GaussianBlur(value.mul(value), spread, {}, sigma_px);
    cv::sqrt(spread, spread);
    spread.rowRange(begin - from, end - from).convertTo(levels.rowRange(begin, end), CV_8U, gain);
  }
  return levels;
}

}  // namespace

bool IsGrey(const BgrView& picture) {
  constexpr int kRounding = 2;
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* p = picture.row(y);
    for (int x = 0; x < picture.width; ++x, p += 3) {
      if (std::abs(p[0] - p[1]) > kRounding || std::abs(p[2] - p[1]) > kRounding) return false;
    }
  }
  return true;
}

Frame WithTexture(const BgrView& picture) {
  const cv::Mat bgr(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.data),
                    static_cast<std::size_t>(picture.stride));
  cv::Mat grey;
  cv::extractChannel(bgr, grey, 1);
  // A plate's grain is finer in a smaller picture; below that, it is only noise.
  const double sigma_px = std::max(0.7, std::max(picture.width, picture.height) / 1920.0);
  constexpr double kFineGain = 10, kCoarseGain = 8;  // spreads of 25 and 32 levels are white
  const cv::Mat planes[] = {grey, Spread(grey, sigma_px, kFineGain),
                            Spread(grey, 2 * sigma_px, kCoarseGain)};
  Frame textured(picture.width, picture.height);
  cv::Mat target(textured.height, textured.width, CV_8UC3, textured.bgr.data());
  cv::merge(planes, 3, target);
  return textured;
}

void DropTexture(Frame& picture) {
  for (int y = 0; y < picture.height; ++y) {
    std::uint8_t* p = picture.row(y);
    for (int x = 0; x < picture.width; ++x, p += 3) p[1] = p[2] = p[0];
  }
}

namespace {

struct ClassSums {
  double count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

  void Add(const Eigen::Vector3d& colour) {
    count += 1;
    sum += colour;
    squares += colour * colour.transpose();
  }
  [[nodiscard]] Eigen::Vector3d Mean() const { return sum / count; }
  [[nodiscard]] Eigen::Matrix3d Covariance() const {
    return squares / count - Mean() * Mean().transpose();
  }
};

}  // namespace

std::optional<ColourWeights> FindContrast(const BgrView& picture, const GrayImage& filament,
                                          int surroundings_px) {
  TRAMMEL_CHECK(picture.width == filament.width && picture.height == filament.height,
                "{} x {} and {} x {}", picture.width, picture.height, filament.width,
                filament.height);
  const cv::Mat bgr(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.data),
                    static_cast<std::size_t>(picture.stride));
  cv::Mat surroundings;
  cv::blur(bgr, surroundings, {surroundings_px, surroundings_px}, {-1, -1}, cv::BORDER_REFLECT);
  ClassSums on, off;
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const cv::Vec3b& p = bgr.at<cv::Vec3b>(y, x);
      const cv::Vec3b& q = surroundings.at<cv::Vec3b>(y, x);
      const float share = filament.row(y)[x];
      if (share > 0.1F && share < 0.9F) continue;  // edge pixel
      (share > 0.5F ? on : off)
          .Add({double(p[0]) - q[0], double(p[1]) - q[1], double(p[2]) - q[2]});
    }
  }
  const double fewest = 0.05 * bgr.rows * bgr.cols;
  if (on.count < fewest || off.count < fewest) return std::nullopt;
  const Eigen::Vector3d difference = on.Mean() - off.Mean();
  constexpr double kRounding = 1.0 / 12;  // variance of whole levels
  constexpr double kRidge = 0.05;  // JPEG halves the resolution of colour: do not rely on it alone
  Eigen::Matrix3d spread = on.Covariance() + off.Covariance();
  spread += (kRidge * spread.trace() + kRounding) * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d direction = geometry::SolveSymmetric(spread, difference);
  const double contrast = direction.dot(difference);
  constexpr double kMinLevels = 1.0;
  if (!(difference.norm() > kMinLevels) || !(contrast > 0)) return std::nullopt;
  const Eigen::Vector3d weights = 100 / contrast * direction;
  return ColourWeights{weights(0), weights(1), weights(2)};
}

GrayImage Mix(const BgrView& picture, const ColourWeights& weights) {
  GrayImage mixed(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* from = picture.row(y);
    float* to = mixed.row(y);
    for (int x = 0; x < picture.width; ++x, from += 3) {
      to[x] =
          static_cast<float>(weights[0] * from[0] + weights[1] * from[1] + weights[2] * from[2]);
    }
  }
  return mixed;
}

}  // namespace trammel::vision
