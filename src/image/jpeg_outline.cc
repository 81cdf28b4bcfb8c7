#include "image/jpeg_outline.h"

#include <fmt/format.h>

#include <cstring>
#include <optional>

namespace trammel::image {
namespace {

constexpr std::uint8_t kEndOfImage = 0xD9;
constexpr std::uint8_t kStartOfScan = 0xDA;

bool IsBare(std::uint8_t marker) {  // marker without length
  return marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7);
}

bool IsStartOfFrame(std::uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

bool IsProgressive(std::uint8_t marker) {
  return marker == 0xC2 || marker == 0xC6 || marker == 0xCA || marker == 0xCE;
}

class Markers {
 public:
  explicit Markers(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// Returns the next marker with a meaning of its own; absent at the end of the bytes. Skips other
  /// bytes, as decoders do; with `strict` they end the walk instead.
  std::optional<std::uint8_t> Next(bool strict) {
    while (at_ + 1 < bytes_.size()) {
      if (bytes_[at_] != 0xFF) {
        if (strict) return std::nullopt;
        const void* next = std::memchr(bytes_.data() + at_, 0xFF, bytes_.size() - at_);
        if (next == nullptr) return std::nullopt;
        at_ = static_cast<std::size_t>(static_cast<const std::uint8_t*>(next) - bytes_.data());
        continue;
      }
      const std::uint8_t marker = bytes_[at_ + 1];
      if (marker == 0xFF) {  // padding
        ++at_;
        continue;
      }
      if (marker == 0 && strict) return std::nullopt;
      at_ += 2;
      if (marker != 0 && !IsBare(marker)) return marker;
    }
    return std::nullopt;
  }

  /// Returns the segment after the marker and advances past it; absent if it is truncated.
  std::optional<std::span<const std::uint8_t>> Segment() {
    if (at_ + 2 > bytes_.size()) return std::nullopt;
    const std::size_t length =
        static_cast<std::size_t>(bytes_[at_] << 8U) + static_cast<std::size_t>(bytes_[at_ + 1]);
    if (length < 2 || at_ + length > bytes_.size()) return std::nullopt;
    const auto segment = bytes_.subspan(at_ + 2, length - 2);
    at_ += length;
    return segment;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 2;  // behind the start of the image
};

Error NoSize() {
  return {ErrorKind::kInput, "it begins like a JPEG, but its header does not state a size"};
}

Result<JpegOutline> FrameOf(std::uint8_t marker, std::span<const std::uint8_t> segment) {
  if (segment.size() < 6) return tl::unexpected(NoSize());
  JpegOutline outline;
  outline.height_px = segment[1] << 8 | segment[2];
  outline.width_px = segment[3] << 8 | segment[4];
  outline.components = segment[5];
  outline.whole = IsProgressive(marker);
  if (outline.width_px < 1 || outline.height_px < 1 || outline.components < 1) {
    return Fail(fmt::format("its header states {} x {} px in {} colours", outline.width_px,
                            outline.height_px, outline.components));
  }
  return outline;
}

}  // namespace

Result<JpegOutline> OutlineOf(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 4 || bytes[0] != 0xFF || bytes[1] != 0xD8) return tl::unexpected(NoSize());
  Markers markers(bytes);
  std::optional<JpegOutline> outline;
  for (;;) {
    // Before the frame header decoders treat bytes that are no marker differently.
    const auto marker = markers.Next(!outline);
    if (!outline && (!marker || *marker == kEndOfImage || *marker == kStartOfScan)) {
      return tl::unexpected(NoSize());
    }
    if (!marker || *marker == kEndOfImage) return *outline;
    const auto segment = markers.Segment();
    if (!segment && !outline) return tl::unexpected(NoSize());
    if (!segment) return *outline;
    if (IsStartOfFrame(*marker)) {
      if (outline) return Fail("it states its size twice; save it again");
      auto frame = TRY(FrameOf(*marker, *segment));
      outline = frame;
    } else if (*marker == kStartOfScan) {
      ++outline->scans;
      if (!segment->empty() && (*segment)[0] < outline->components) outline->whole = true;
    }
  }
}

Result<void> CheckCost(const JpegOutline& outline, std::size_t bytes) {
  constexpr std::int64_t kMaxScans = 100;  // cameras and programs write up to a dozen
  constexpr double kMaxPixelsOfScans = 4e9;
  constexpr double kMaxPixelsOfAByte = 512;  // a bit for each block of 8 x 8
  if (outline.scans > kMaxScans) {
    return Fail(fmt::format(
        "it is a progressive JPEG of {} scans, and at most {} are read; save it again, baseline",
        outline.scans, kMaxScans));
  }
  const double pixels = static_cast<double>(outline.width_px) * outline.height_px;
  if (pixels > kMaxPixelsOfAByte * static_cast<double>(bytes)) {
    return Fail(
        fmt::format("its header states {} x {} px, more than its {} bytes can hold; "
                    "it was cut off or is damaged: copy it again",
                    outline.width_px, outline.height_px, bytes));
  }
  if (outline.whole && pixels * static_cast<double>(outline.scans) > kMaxPixelsOfScans) {
    return Fail(fmt::format(
        "its {} scans of {} x {} px are more than the {:.0f} megapixels of all scans that are "
        "read; save it again, baseline",
        outline.scans, outline.width_px, outline.height_px, kMaxPixelsOfScans / 1e6));
  }
  return {};
}

}  // namespace trammel::image
