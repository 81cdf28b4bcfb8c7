#include "vision/local_contrast.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

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
  cv::Mat value, smooth, mean, spread;
  channel.convertTo(value, CV_32F);
  cv::GaussianBlur(value, smooth, {}, smooth_px);
  const cv::Size window(window_px, window_px);
  cv::blur(smooth, mean, window, {-1, -1}, cv::BORDER_REFLECT);
  const cv::Mat difference = smooth - mean;
  cv::blur(difference.mul(difference), spread, window, {-1, -1}, cv::BORDER_REFLECT);
  cv::sqrt(spread, spread);
  constexpr double kGrain = 1.0;  // levels: below it there is nothing but rounding
  return difference / cv::max(spread, kGrain);
}

}  // namespace trammel::vision
