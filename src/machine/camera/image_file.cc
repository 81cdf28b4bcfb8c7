#include "machine/camera/image_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file_kind.h"
#include "image/jpeg_outline.h"
#include "image/jpeg_reader.h"
#include "image/png_reader.h"
#include "machine/net/file_bytes.h"

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
  constexpr std::uint64_t kMaxPixelsPerByte = 1000;
  const auto pixels = static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  if (pixels <= kMaxPixelsPerByte * bytes) return {};
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

namespace {

constexpr std::array<std::uint8_t, 8> kPngSignature = {0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A};
constexpr std::array<std::uint8_t, 12> kPngEnd = {0,   0,   0,    0,    'I',  'E',
                                                  'N', 'D', 0xAE, 0x42, 0x60, 0x82};

std::uint32_t BigEndian(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | bytes[at + i];
  return value;
}

bool StartsWith(std::span<const std::uint8_t> bytes, std::span<const std::uint8_t> start) {
  return bytes.size() >= start.size() && std::equal(start.begin(), start.end(), bytes.begin());
}

Result<ImageHeader> PngHeader(std::span<const std::uint8_t> bytes) {
  const auto outline = TRY(image::OutlineOfPng(bytes));
  return ImageHeader{ImageFormat::kPng, static_cast<int>(outline.width_px),
                     static_cast<int>(outline.height_px)};
}

Result<ImageHeader> JpegHeader(std::span<const std::uint8_t> bytes) {
  const auto outline = TRY(image::OutlineOf(bytes));
  return ImageHeader{ImageFormat::kJpeg, outline.width_px, outline.height_px};
}

/// Checks that decoding is not far more expensive than such a picture justifies.
Result<void> CheckCostOf(std::span<const std::uint8_t> bytes, ImageFormat format) {
  if (format == ImageFormat::kPng) {
    const auto outline = image::OutlineOfPng(bytes);
    return outline ? CheckCost(*outline, bytes.size()) : tl::unexpected(outline.error());
  }
  const auto outline = image::OutlineOf(bytes);
  return outline ? CheckCost(*outline, bytes.size()) : tl::unexpected(outline.error());
}

cv::Mat PixelsOf(Frame& frame) { return {frame.height, frame.width, CV_8UC3, frame.bgr.data()}; }

Result<Frame> DecodeJpeg(std::span<const std::uint8_t> bytes, int reduction, bool turn) {
  // Cameras write extra bytes between the picture and its end, of which decoders warn.
  auto jpeg = TRY(image::JpegReader::Open(bytes, image::JpegDamage::kFillIn));
  TRY(jpeg.Start(image::JpegPixels::kBgr, reduction));
  Frame frame(jpeg.row_px(), jpeg.rows());
  for (int y = 0; y < frame.height; ++y) TRY(jpeg.ReadRow(frame.row(y)));
  return turn ? TurnedByExif(std::move(frame), jpeg.header().orientation) : frame;
}

Result<Frame> DecodePng(std::span<const std::uint8_t> bytes, int reduction, bool turn) {
  auto png = TRY(image::PngReader::Open(bytes, image::PngPixels::kBgr8));
  Frame frame(png.header().width_px, png.header().height_px);
  for (int pass = 0; pass < png.passes(); ++pass) {
    for (int y = 0; y < frame.height; ++y) TRY(png.ReadRow(frame.row(y)));
  }
  TRY(png.Finish());
  if (reduction > 1) {
    Frame reduced(std::max(frame.width / reduction, 1), std::max(frame.height / reduction, 1));
    cv::Mat to = PixelsOf(reduced);
    cv::resize(PixelsOf(frame), to, to.size(), 0, 0, cv::INTER_LINEAR_EXACT);
    frame = std::move(reduced);
  }
  return turn ? TurnedByExif(std::move(frame), png.orientation()) : frame;
}

Result<Frame> Decode(std::span<const std::uint8_t> bytes, const ImageHeader& header,
                     const ImageReadOptions& options) {
  const int reduction = ReductionOf(header.width_px, header.height_px, options);
  auto frame = header.format == ImageFormat::kPng
                   ? DecodePng(bytes, reduction, options.turn_by_exif)
                   : DecodeJpeg(bytes, reduction, options.turn_by_exif);
  if (!frame) return Fail(frame.error().message + "; copy it again");
  return frame;
}

}  // namespace

// True if the file is truncated; decoders silently fill the missing part with grey.
bool EndsEarly(std::span<const std::uint8_t> bytes, ImageFormat format) {
  if (format == ImageFormat::kPng) {
    return std::search(bytes.begin(), bytes.end(), kPngEnd.begin(), kPngEnd.end()) == bytes.end();
  }
  // Finds the end of the picture itself, not of a thumbnail in the header: after the picture's
  // first scan.
  std::size_t at = 2;
  while (at + 4 <= bytes.size() && bytes[at] == 0xFF && bytes[at + 1] != 0xDA) {
    const bool bare = bytes[at + 1] == 0xFF || bytes[at + 1] == 0x01 ||
                      (bytes[at + 1] >= 0xD0 && bytes[at + 1] <= 0xD8);
    at += bare ? (bytes[at + 1] == 0xFF ? 1 : 2) : 2 + BigEndian(bytes, at + 2, 2);
  }
  constexpr std::array<std::uint8_t, 2> kEnd = {0xFF, 0xD9};
  return at >= bytes.size() || std::search(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                                           bytes.end(), kEnd.begin(), kEnd.end()) == bytes.end();
}

Result<ImageHeader> ReadImageHeader(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 3> kJpegStart = {0xFF, 0xD8, 0xFF};
  if (bytes.empty()) return Fail("it is empty");
  if (StartsWith(bytes, kPngSignature)) return PngHeader(bytes);
  if (StartsWith(bytes, kJpegStart)) return JpegHeader(bytes);
  const auto kind = KindByContent({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const std::string_view foreign = kind ? kind->name : std::string_view();
  return Fail(fmt::format("it is {}{} a JPEG nor a PNG; convert it to one of these", foreign,
                          foreign.empty() ? "neither" : ", neither"));
}

Result<Frame> DecodeImage(std::span<const std::uint8_t> bytes, const ImageReadOptions& options) {
  const ImageHeader header = TRY(ReadImageHeader(bytes));
  TRY(CheckPixels(header.width_px, header.height_px, options));
  if (EndsEarly(bytes, header.format))
    return Fail("it ends before the picture does; copy it again");
  TRY(CheckCostOf(bytes, header.format));
  try {
    return Decode(bytes, header, options);
  } catch (const cv::Exception& exception) {
    return Fail(fmt::format("the decoder rejects it: {}", exception.err));
  } catch (const std::bad_alloc&) {
    return Fail(fmt::format("its {} x {} px do not fit into memory; shrink it", header.width_px,
                            header.height_px));
  }
}

Result<Frame> ReadImageFile(const std::filesystem::path& path, const ImageReadOptions& options) {
  const auto named = [&](const Error& error) {
    return tl::unexpected(
        Error{error.kind, fmt::format("photo {}: {}", path.string(), error.message)});
  };
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, options.max_bytes);
  if (!bytes) return named(bytes.error());
  Result<Frame> frame = DecodeImage(*bytes, options);
  if (!frame) return named(frame.error());
  return frame;
}

}  // namespace trammel::machine
