#include "part_alignment/targets/quieten.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

namespace trammel::part_alignment {

double PixelNoise(const PageView& picture) {
  std::array<int, 256> histogram{};
  int count = 0;
  const int step = std::max(1, picture.height / 16);
  for (int y = step / 2; y < picture.height; y += step) {
    const std::uint8_t* row = picture.row(y);
    for (int x = 1; x < picture.width - 1; x += 4) {
      ++histogram[static_cast<std::size_t>(std::abs(row[x + 1] - row[x - 1]))];
      ++count;
    }
  }
  std::size_t median = 0;
  int below = 0;
  while (2 * (below + histogram[median]) < count) below += histogram[median++];
  if (median == 0) return 0;
  // Position of the median within its grey level's width.
  const double share = (0.5 * count - below) / histogram[median];
  constexpr double kSigmaOfMedian = 1.4826;
  constexpr double kPixelOfDifference = 0.7071;
  return kPixelOfDifference * kSigmaOfMedian * (static_cast<double>(median) - 0.5 + share);
}

PageView Quieten(const PageView& picture, std::vector<std::uint8_t>& samples) {
  samples.resize(static_cast<std::size_t>(picture.width) *
                 static_cast<std::size_t>(picture.height));
  // OpenCV's pictures have no constant pixels; it reads this one.
  const cv::Mat from(picture.height, picture.width, CV_8UC1,
                     const_cast<std::uint8_t*>(picture.data),
                     static_cast<std::size_t>(picture.stride));
  cv::Mat to(picture.height, picture.width, CV_8UC1, samples.data());
  cv::GaussianBlur(from, to, {3, 3}, 0);  // OpenCV's kernel of 3 without a sigma is binomial
  PageView quiet = picture;
  quiet.data = samples.data();
  quiet.stride = picture.width;
  return quiet;
}

}  // namespace trammel::part_alignment
