#include "machine/video/video_budget.h"

#include <fmt/format.h>

#include "image/jpeg_outline.h"

namespace trammel::machine {

namespace {

tl::unexpected<Error> Beyond(std::string what) {
  return Fail(std::move(what), ErrorKind::kMeasurement);
}

}  // namespace

Result<void> VideoBudget::AddFrame(int width_px, int height_px, double stored_pixels) {
  if (frames_ == limits_.max_frames) {
    return Beyond(
        fmt::format("more than {} frames; record one sweep per file", limits_.max_frames));
  }
  pixels_ += stored_pixels;
  if (pixels_ > limits_.max_pixels_in_all) {
    return Beyond(
        fmt::format("its first {} frames have more than {:.0f} megapixels in all; record "
                    "one sweep per file, or with smaller frames",
                    frames_ + 1, limits_.max_pixels_in_all / 1e6));
  }
  if (width_px < 1 || height_px < 1 || width_px > limits_.max_width_px ||
      height_px > limits_.max_height_px ||
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) >
          limits_.max_pixels) {
    return Beyond(fmt::format("frame {} has {}x{} px; at most {}x{} and {} in all are read",
                              frames_ + 1, width_px, height_px, limits_.max_width_px,
                              limits_.max_height_px, limits_.max_pixels));
  }
  if (frames_ > 0 && (width_px != width_px_ || height_px != height_px_)) {
    return Beyond(
        fmt::format("frame {} has {}x{} px, those before it {}x{}; record the line again "
                    "with one camera mode",
                    frames_ + 1, width_px, height_px, width_px_, height_px_));
  }
  width_px_ = width_px;
  height_px_ = height_px;
  ++frames_;
  return {};
}

Result<void> VideoBudget::AddTime(std::chrono::steady_clock::duration time) {
  decoding_ += time;
  if (decoding_ <= std::chrono::duration<double>(limits_.max_decoding_s)) return {};
  return Beyond(
      fmt::format("decoding the first {} frames took over {:g} s; record one sweep per file",
                  frames_ + 1, limits_.max_decoding_s));
}

Result<void> CheckMjpegFrame(std::span<const std::uint8_t> jpeg, std::size_t most_pixels) {
  const auto outline = TRY(image::OutlineOf(jpeg));
  if (static_cast<double>(outline.width_px) * outline.height_px >
      static_cast<double>(most_pixels)) {
    return Fail(fmt::format("it has {}x{} px; at most {} megapixels are read", outline.width_px,
                            outline.height_px, most_pixels / 1'000'000));
  }
  return CheckCost(outline, jpeg.size());
}

}  // namespace trammel::machine
