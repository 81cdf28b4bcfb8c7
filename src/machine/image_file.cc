#include "machine/image_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "machine/file_bytes.h"
#include "machine/jpeg_outline.h"
#include "machine/png_outline.h"

namespace trammel::machine {
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
  const auto outline = OutlineOfPng(bytes);
  if (!outline) return tl::unexpected(outline.error());
  return ImageHeader{ImageFormat::kPng, static_cast<int>(outline->width_px),
                     static_cast<int>(outline->height_px)};
}

Result<ImageHeader> JpegHeader(std::span<const std::uint8_t> bytes) {
  const auto outline = OutlineOf(bytes);
  if (!outline) return tl::unexpected(outline.error());
  return ImageHeader{ImageFormat::kJpeg, outline->width_px, outline->height_px};
}

int ReadMode(std::int64_t pixels, std::int64_t enough) {
  if (pixels <= enough) return cv::IMREAD_COLOR;
  if (pixels <= 4 * enough) return cv::IMREAD_REDUCED_COLOR_2;
  if (pixels <= 16 * enough) return cv::IMREAD_REDUCED_COLOR_4;
  return cv::IMREAD_REDUCED_COLOR_8;
}

/// Whether a decoder would have to do far more for it than such a picture should cost.
Result<void> CheckCostOf(std::span<const std::uint8_t> bytes, ImageFormat format) {
  if (format == ImageFormat::kPng) {
    const auto outline = OutlineOfPng(bytes);
    return outline ? CheckCost(*outline, bytes.size()) : tl::unexpected(outline.error());
  }
  const auto outline = OutlineOf(bytes);
  return outline ? CheckCost(*outline, bytes.size()) : tl::unexpected(outline.error());
}

Result<Frame> Decode(std::span<const std::uint8_t> bytes, const ImageHeader& header,
                     const ImageReadOptions& options) {
  std::vector<std::uint8_t> plain;
  if (header.format == ImageFormat::kPng && HasPackedRemarks(bytes)) {
    plain = WithoutRemarks(bytes);
    bytes = plain;
  }
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8U,
                    const_cast<std::uint8_t*>(bytes.data()));
  const std::int64_t pixels = std::int64_t{header.width_px} * header.height_px;
  const cv::Mat decoded = cv::imdecode(raw, ReadMode(pixels, options.reduce_above_px));
  if (decoded.empty() || decoded.type() != CV_8UC3) {
    return Fail(fmt::format("the decoder cannot read it although its header states {} x {} px",
                            header.width_px, header.height_px));
  }
  Frame frame(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) {
    std::copy_n(decoded.ptr<std::uint8_t>(y),
                std::size_t{3} * static_cast<std::size_t>(decoded.cols), frame.row(y));
  }
  return frame;
}

}  // namespace

// Decoders fill the missing part of a truncated file with grey and say nothing.
bool EndsEarly(std::span<const std::uint8_t> bytes, ImageFormat format) {
  if (format == ImageFormat::kPng) {
    return std::search(bytes.begin(), bytes.end(), kPngEnd.begin(), kPngEnd.end()) == bytes.end();
  }
  // The picture's end, not that of a thumbnail in the header: behind the first scan of the picture.
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
  return Fail("it is neither a JPEG nor a PNG; convert it to one of these");
}

Result<Frame> DecodeImage(std::span<const std::uint8_t> bytes, const ImageReadOptions& options) {
  const Result<ImageHeader> header = ReadImageHeader(bytes);
  if (!header) return tl::unexpected(header.error());
  const std::int64_t pixels = std::int64_t{header->width_px} * header->height_px;
  if (pixels > options.most_pixels) {
    return Fail(fmt::format(
        "it has {} x {} px = {} megapixels, more than the {} that are read; "
        "shrink it",
        header->width_px, header->height_px, pixels / 1'000'000, options.most_pixels / 1'000'000));
  }
  if (EndsEarly(bytes, header->format))
    return Fail("it ends before the picture does; copy it again");
  if (auto cost = CheckCostOf(bytes, header->format); !cost) return tl::unexpected(cost.error());
  try {
    return Decode(bytes, *header, options);
  } catch (const cv::Exception& exception) {
    return Fail(fmt::format("the decoder rejects it: {}", exception.err));
  } catch (const std::bad_alloc&) {
    return Fail(fmt::format("its {} x {} px do not fit into memory; shrink it", header->width_px,
                            header->height_px));
  }
}

Result<Frame> ReadImageFile(const std::filesystem::path& path, const ImageReadOptions& options) {
  const auto named = [&](const Error& error) {
    return tl::unexpected(
        Error{error.kind, fmt::format("photo {}: {}", path.string(), error.message)});
  };
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, options.most_bytes);
  if (!bytes) return named(bytes.error());
  Result<Frame> frame = DecodeImage(*bytes, options);
  if (!frame) return named(frame.error());
  return frame;
}

}  // namespace trammel::machine
