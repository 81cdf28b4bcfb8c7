#include "vision/rectify.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace trammel::vision {
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

Frame ShrinkToFit(const BgrView& photo, int longest_px, double most_px, double& scale) {
  TRAMMEL_CHECK(photo.width >= 1 && photo.height >= 1, "{} x {}", photo.width, photo.height);
  scale = std::min({1.0, static_cast<double>(longest_px) / std::max(photo.width, photo.height),
                    std::sqrt(most_px / (static_cast<double>(photo.width) * photo.height))});
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
