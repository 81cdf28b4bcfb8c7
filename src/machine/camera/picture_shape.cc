#include "machine/camera/picture_shape.h"

#include <fmt/format.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <utility>

namespace trammel::machine {
namespace {

cv::Mat MatOf(Frame& frame) { return {frame.height, frame.width, CV_8UC3, frame.bgr.data()}; }

}  // namespace

Result<void> CheckPixels(int width_px, int height_px, const ImageReadOptions& options) {
  const std::int64_t pixels = std::int64_t{width_px} * height_px;
  if (pixels <= options.most_pixels) return {};
  return Fail(
      fmt::format("it has {} x {} px = {} megapixels, more than the {} that are read; "
                  "shrink it",
                  width_px, height_px, pixels / 1'000'000, options.most_pixels / 1'000'000));
}

Result<void> CheckPacking(int width_px, int height_px, std::size_t bytes) {
  constexpr std::uint64_t kMostPixelsPerByte = 1000;
  const auto pixels = static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  if (pixels <= kMostPixelsPerByte * bytes) return {};
  return Fail(fmt::format("it states {} x {} px, which its {} bytes cannot hold; copy it again",
                          width_px, height_px, bytes));
}

Frame TurnedByExif(Frame frame, int orientation) {
  if (orientation >= 5) {
    Frame transposed(frame.height, frame.width);
    cv::Mat to = MatOf(transposed);
    cv::transpose(MatOf(frame), to);
    frame = std::move(transposed);
  }
  const int mirrored = orientation % 4;
  const bool left_right = mirrored == 2 || mirrored == 3;  // 2, 3, 6, 7
  const bool up_down = mirrored == 3 || mirrored == 0;     // 3, 4, 7, 8
  cv::Mat pixels = MatOf(frame);
  if (left_right && up_down) {
    cv::flip(pixels, pixels, -1);
  } else if (left_right || up_down) {
    cv::flip(pixels, pixels, left_right ? 1 : 0);
  }
  return frame;
}

int ReductionOf(int width_px, int height_px, const ImageReadOptions& options) {
  const std::int64_t pixels = std::int64_t{width_px} * height_px;
  const std::int64_t enough = options.reduce_above_px;
  if (pixels <= enough) return 1;
  if (pixels <= 4 * enough) return 2;
  if (pixels <= 16 * enough) return 4;
  return 8;
}

}  // namespace trammel::machine
