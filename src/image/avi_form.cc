#include "image/avi_form.h"

#include <cmath>
#include <string_view>
#include <utility>

#include "base/check.h"

namespace trammel::image {
namespace {

std::array<std::uint8_t, 4> Little(std::size_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8U),
          static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 24U)};
}

/// Little-endian bytes of a RIFF file.
class Bytes {
 public:
  Bytes& Tag(std::string_view four) {
    data_.insert(data_.end(), four.begin(), four.end());
    return *this;
  }
  Bytes& U32(std::size_t value) {
    const auto bytes = Little(value);
    data_.insert(data_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  Bytes& U16(int value) {
    data_.push_back(static_cast<std::uint8_t>(value));
    data_.push_back(static_cast<std::uint8_t>(value >> 8));
    return *this;
  }
  std::vector<std::uint8_t>& data() { return data_; }

 private:
  std::vector<std::uint8_t> data_;
};

// Places in the head that a finished file fills in.
constexpr std::size_t kRiffSizeAt = 4;
constexpr std::size_t kFrameCountAt = 48;
constexpr std::size_t kStreamLengthAt = 140;
constexpr std::size_t kMoviSizeAt = 216;
constexpr std::size_t kHeadBytes = 224;

}  // namespace

std::vector<std::uint8_t> AviHead(const AviForm& form) {
  TRAMMEL_CHECK(form.width_px > 0 && form.width_px < 65536 && form.height_px > 0 &&
                    form.height_px < 65536 && form.frames_per_s > 0,
                "{}x{} px with {} frames/s", form.width_px, form.height_px, form.frames_per_s);
  const auto w = static_cast<std::size_t>(form.width_px);
  const auto h = static_cast<std::size_t>(form.height_px);
  const auto rate = static_cast<std::size_t>(std::lround(form.frames_per_s * 1000));
  Bytes out;
  out.Tag("RIFF").U32(0).Tag("AVI ").Tag("LIST").U32(192).Tag("hdrl");
  constexpr std::size_t kHasIndex = 0x10;
  out.Tag("avih").U32(56).U32(static_cast<std::size_t>(std::lround(1e6 / form.frames_per_s)));
  out.U32(0).U32(0).U32(kHasIndex).U32(0).U32(0).U32(1).U32(0).U32(w).U32(h);
  out.U32(0).U32(0).U32(0).U32(0);
  out.Tag("LIST").U32(116).Tag("strl").Tag("strh").U32(56).Tag("vids").Tag("MJPG");
  out.U32(0).U32(0).U32(0).U32(1000).U32(rate).U32(0).U32(0).U32(0);
  out.U32(0xFFFFFFFF).U32(0).U16(0).U16(0).U16(form.width_px).U16(form.height_px);
  out.Tag("strf").U32(40).U32(40).U32(w).U32(h).U16(1).U16(24).Tag("MJPG").U32(w * h * 3);
  out.U32(0).U32(0).U32(0).U32(0);
  out.Tag("LIST").U32(0).Tag("movi");
  TRAMMEL_CHECK(out.data().size() == kHeadBytes, "a head of {} bytes", out.data().size());
  return std::move(out.data());
}

std::array<std::uint8_t, 8> AviFrameHead(std::size_t size) {
  const auto bytes = Little(size);
  return {'0', '0', 'd', 'c', bytes[0], bytes[1], bytes[2], bytes[3]};
}

std::vector<std::uint8_t> AviIndex(std::span<const AviEntry> entries) {
  constexpr std::size_t kEntryBytes = 16;
  constexpr std::size_t kKeyFrame = 0x10;
  constexpr std::size_t kMoviAt = kHeadBytes - 4;  // places count from the list's type
  Bytes out;
  out.Tag("idx1").U32(entries.size() * kEntryBytes);
  for (const AviEntry& entry : entries) {
    out.Tag("00dc").U32(kKeyFrame).U32(entry.at - kMoviAt).U32(entry.size);
  }
  return std::move(out.data());
}

std::vector<AviPatch> AviSizes(std::size_t frames, std::size_t frames_end, std::size_t file_bytes) {
  return {{kFrameCountAt, Little(frames)},
          {kStreamLengthAt, Little(frames)},
          {kMoviSizeAt, Little(frames_end - kMoviSizeAt - 4)},
          {kRiffSizeAt, Little(file_bytes - 8)}};
}

}  // namespace trammel::image
