#include "support/test_pictures.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

namespace trammel::test {

std::string JpegOf(const Frame& frame, int quality) {
  const cv::Mat pixels(frame.height, frame.width, CV_8UC3,
                       const_cast<std::uint8_t*>(frame.bgr.data()));
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", pixels, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return {bytes.begin(), bytes.end()};
}

Frame TestPicture(int width, int height, int phase) {
  Frame frame(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        frame.row(y)[3 * x + c] =
            static_cast<std::uint8_t>(40 + (x + 3 * phase) % 64 * 2 + y % 32 + 10 * c);
      }
    }
  }
  return frame;
}

}  // namespace trammel::test
