#include "image/avi_writer.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/check.h"

namespace trammel::image {
namespace {

constexpr std::size_t kMaxBytes = 2'000'000'000;

std::array<std::uint8_t, 4> Little(std::size_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8U),
          static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 24U)};
}

/// Little-endian bytes of a RIFF file.
class Bytes {
 public:
  explicit Bytes(std::vector<std::uint8_t>& data) : data_(data) { data_.clear(); }
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

 private:
  std::vector<std::uint8_t>& data_;
};

// Offsets of header fields that are filled in at the end.
constexpr std::size_t kRiffSizeAt = 4;
constexpr std::size_t kFrameCountAt = 48;
constexpr std::size_t kStreamLengthAt = 140;
constexpr std::size_t kMoviSizeAt = 216;
constexpr std::size_t kHeadBytes = 224;

int WriteAt(int fd, std::size_t at, std::size_t value) {
  const auto bytes = Little(value);
  const ssize_t count = pwrite(fd, bytes.data(), bytes.size(), static_cast<off_t>(at));
  return count == static_cast<ssize_t>(bytes.size()) ? 0 : (count < 0 ? errno : ENOSPC);
}

// If even this fails, the reader drops the last, unfinished chunk.
void Shrink(int fd, std::size_t size) {
  if (ftruncate(fd, static_cast<off_t>(size)) != 0) return;
  std::ignore = lseek(fd, static_cast<off_t>(size), SEEK_SET);
}

}  // namespace

int AppendWhole(int fd, std::span<const std::uint8_t> bytes, std::size_t& size) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = write(fd, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      Shrink(fd, size);
      return error;
    }
    done += static_cast<std::size_t>(count);
  }
  size += done;
  return 0;
}

int AviWriter::Begin(const AviForm& form) {
  TRAMMEL_CHECK(form.width_px > 0 && form.width_px < 65536 && form.height_px > 0 &&
                    form.height_px < 65536 && form.frames_per_s > 0,
                "{}x{} px with {} frames/s", form.width_px, form.height_px, form.frames_per_s);
  const auto w = static_cast<std::size_t>(form.width_px);
  const auto h = static_cast<std::size_t>(form.height_px);
  const auto rate = static_cast<std::size_t>(std::lround(form.frames_per_s * 1000));
  Bytes out(chunk_);
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
  TRAMMEL_CHECK(chunk_.size() == kHeadBytes, "a head of {} bytes", chunk_.size());
  return AppendWhole(fd_, chunk_, size_);
}

int AviWriter::Add(std::span<const std::uint8_t> jpeg) {
  Bytes(chunk_).Tag("00dc").U32(jpeg.size());
  chunk_.insert(chunk_.end(), jpeg.begin(), jpeg.end());
  if (jpeg.size() % 2 == 1) chunk_.push_back(0);
  if (size_ + chunk_.size() > kMaxBytes) return EOVERFLOW;
  const std::size_t at = size_;
  const int error = AppendWhole(fd_, chunk_, size_);
  if (error == 0) index_.push_back({at, jpeg.size()});
  return error;
}

void AviWriter::TakeBack() {
  size_ = index_.back().at;
  index_.pop_back();
  Shrink(fd_, size_);
}

int AviWriter::Finish() {
  constexpr std::size_t kEntryBytes = 16;
  constexpr std::size_t kKeyFrame = 0x10;
  constexpr std::size_t kMoviAt = kHeadBytes - 4;  // places count from the list's type
  const std::size_t frames_end = size_;
  Bytes out(chunk_);
  out.Tag("idx1").U32(index_.size() * kEntryBytes);
  for (const Entry& entry : index_) {
    out.Tag("00dc").U32(kKeyFrame).U32(entry.at - kMoviAt).U32(entry.size);
  }
  int error = AppendWhole(fd_, chunk_, size_);
  for (const auto& [at, value] :
       {std::pair{kFrameCountAt, index_.size()}, std::pair{kStreamLengthAt, index_.size()},
        std::pair{kMoviSizeAt, frames_end - kMoviSizeAt - 4}, std::pair{kRiffSizeAt, size_ - 8}}) {
    if (error == 0) error = WriteAt(fd_, at, value);
  }
  return error;
}

}  // namespace trammel::image
