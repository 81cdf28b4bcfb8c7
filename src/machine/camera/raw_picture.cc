#include "machine/camera/raw_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "base/check.h"
#include "image/jpeg_writer.h"
#include "image/png_writer.h"

namespace trammel::machine {
namespace {

constexpr std::int64_t kMaxPixels = 50'000'000;  // limit of DecodeFrame()
constexpr int kLongestSide_px = 65'500;          // JPEG's limit

struct ReadFormat {
  std::uint32_t code = 0;
  std::string_view name;
  int channels = 1;
  int to_bgr = kAsItIs;  ///< cv::ColorConversionCodes

  static constexpr int kAsItIs = -1;
};

// GenICam names a Bayer pattern by its first two pixels, OpenCV by the second and third pixel of
// the second row: the colours are swapped.
constexpr std::array<ReadFormat, 7> kFormats = {{
    {0x01080001, "Mono8", 1, ReadFormat::kAsItIs},
    {0x01080008, "BayerGR8", 1, cv::COLOR_BayerGB2BGR},
    {0x01080009, "BayerRG8", 1, cv::COLOR_BayerBG2BGR},
    {0x0108000A, "BayerGB8", 1, cv::COLOR_BayerGR2BGR},
    {0x0108000B, "BayerBG8", 1, cv::COLOR_BayerRG2BGR},
    {0x02180014, "RGB8", 3, cv::COLOR_RGB2BGR},
    {0x02180015, "BGR8", 3, ReadFormat::kAsItIs},
}};

const ReadFormat* FindFormat(std::uint32_t code) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(),
                                   [&](const ReadFormat& format) { return format.code == code; });
  return found == kFormats.end() ? nullptr : found;
}

Result<std::vector<std::uint8_t>> AsJpeg(const PageView& pixels, int quality) {
  std::vector<std::uint8_t> jpeg;
  TRY(image::EncodeJpeg(pixels, {.quality = quality, .dpi = {}}, jpeg));
  return jpeg;
}

}  // namespace

bool IsReadPixelFormat(std::uint32_t pixel_format) { return FindFormat(pixel_format) != nullptr; }

std::string ReadPixelFormats() {
  std::string names;
  for (const ReadFormat& format : kFormats) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format.name);
  }
  return names;
}

std::string PixelFormatName(std::uint32_t pixel_format) {
  const ReadFormat* format = FindFormat(pixel_format);
  return format != nullptr ? std::string(format->name) : fmt::format("0x{:08X}", pixel_format);
}

Result<std::vector<std::uint8_t>> ToPicture(const RawPicture& raw, int jpeg_quality) {
  TRAMMEL_CHECK(jpeg_quality >= 0 && jpeg_quality <= 100, "JPEG quality {}", jpeg_quality);
  const ReadFormat* format = FindFormat(raw.pixel_format);
  if (format == nullptr) {
    return Fail(fmt::format("pixel format {} is not read, but {}",
                            PixelFormatName(raw.pixel_format), ReadPixelFormats()),
                ErrorKind::kMachine);
  }
  const std::int64_t pixels = std::int64_t{raw.width_px} * raw.height_px;
  if (raw.width_px < 1 || raw.height_px < 1 || pixels > kMaxPixels ||
      std::max(raw.width_px, raw.height_px) > kLongestSide_px) {
    return Fail(fmt::format("a picture of {}x{} px; at most {} megapixels and {} px a side are "
                            "read: set a smaller region",
                            raw.width_px, raw.height_px, kMaxPixels / 1'000'000, kLongestSide_px),
                ErrorKind::kMachine);
  }
  const std::size_t row_bytes =
      static_cast<std::size_t>(raw.width_px) * static_cast<std::size_t>(format->channels);
  const std::size_t stride = row_bytes + raw.row_padding_bytes;
  const std::size_t needed = stride * static_cast<std::size_t>(raw.height_px - 1) + row_bytes;
  if (raw.row_padding_bytes > static_cast<std::size_t>(kMaxPixels) || raw.bytes.size() < needed) {
    return Fail(fmt::format("{} bytes for {}x{} px of {}, which need {}", raw.bytes.size(),
                            raw.width_px, raw.height_px, format->name, needed),
                ErrorKind::kMachine);
  }
  // OpenCV has no view of constant data; it is only read.
  const cv::Mat pixels_as_sent(raw.height_px, raw.width_px, CV_8UC(format->channels),
                               const_cast<std::uint8_t*>(raw.bytes.data()), stride);
  cv::Mat picture;  // not over the one that was sent: cvtColor() would write into its bytes
  if (format->to_bgr == ReadFormat::kAsItIs) {
    picture = pixels_as_sent;
  } else {
    cv::cvtColor(pixels_as_sent, picture, format->to_bgr);
  }
  const PageView page{picture.data, picture.cols, picture.rows, picture.channels(),
                      static_cast<std::ptrdiff_t>(picture.step)};
  auto encoded = jpeg_quality > 0 ? AsJpeg(page, jpeg_quality) : image::EncodePng(page);
  if (!encoded) return Fail(encoded.error().message, ErrorKind::kMachine);
  return encoded;
}

namespace {

// A scheduler may interrupt between the two readings. A steered clock drifts by at most 500 ppm
// (adjtimex), by twice that against another one.
constexpr double kApart_s = 0.005;
constexpr double kSteered = 1e-3;
// Longer than fetching all frames in a queue takes.
constexpr double kDoubtful_s = 2;

}  // namespace

std::optional<double> WallStamps::OnHostClock(double wall_s, double wall_now_s, double host_now_s) {
  const double offset_s = wall_now_s - host_now_s;
  const double allowed_s = kApart_s + kSteered * (host_now_s - compared_s_);
  if (offset_s_ && std::abs(offset_s - *offset_s_) > allowed_s) set_s_ = host_now_s;
  offset_s_ = offset_s;
  compared_s_ = host_now_s;
  if (set_s_ && host_now_s - *set_s_ < kDoubtful_s) return std::nullopt;
  if (!(wall_s > 0) || wall_s > wall_now_s) return std::nullopt;
  return wall_s - offset_s;
}

}  // namespace trammel::machine
