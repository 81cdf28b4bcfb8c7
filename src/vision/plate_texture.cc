#include "vision/plate_texture.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace trammel::vision {
namespace {

// Standard deviation of brightness about its local mean, in units of 1 / gain levels.
cv::Mat Spread(const cv::Mat& grey, double sigma_px, double gain) {
  cv::Mat value, mean, spread, levels;
  grey.convertTo(value, CV_32F);
  cv::GaussianBlur(value, mean, {}, sigma_px);
  value -= mean;
  cv::GaussianBlur(value.mul(value), spread, {}, sigma_px);
  cv::sqrt(spread, spread);
  spread.convertTo(levels, CV_8U, gain);
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
  // A plate's grain is seen finer in a smaller picture; below that, it is but noise.
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

}  // namespace trammel::vision
