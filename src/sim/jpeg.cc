#include "sim/jpeg.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/check.h"

namespace trammel::sim {

void EncodeJpeg(const BgrView& view, int quality, std::vector<std::uint8_t>& jpeg) {
  TRAMMEL_CHECK(view.width > 0 && view.height > 0 && quality >= 1 && quality <= 100,
                "{} x {} px at quality {}", view.width, view.height, quality);
  // OpenCV takes no read-only pixels; imencode does not write to them.
  const cv::Mat image(view.height, view.width, CV_8UC3, const_cast<std::uint8_t*>(view.data),
                      static_cast<std::size_t>(view.stride));
  const bool encoded = cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
  TRAMMEL_CHECK(encoded, "OpenCV encodes no JPEG of {} x {} px", view.width, view.height);
}

}  // namespace trammel::sim
