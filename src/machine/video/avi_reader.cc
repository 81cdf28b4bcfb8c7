#include "machine/video/avi_reader.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <span>
#include <string_view>
#include <utility>

#include "base/text.h"
#include "machine/camera/image_file.h"

namespace trammel::machine {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::int64_t kChunkHead = 8;
constexpr std::int64_t kListHead = 12;
constexpr std::int64_t kMaxOfHead = 1 << 20;  // per stream's list, which takes some hundred bytes
constexpr std::size_t kMaxParts = 1'000'000;  // enough for 100,000 frames with sound

std::uint32_t U32(Bytes bytes, std::size_t at) {
  return bytes[at] | bytes[at + 1] << 8U | bytes[at + 2] << 16U |
         static_cast<std::uint32_t>(bytes[at + 3]) << 24U;
}

std::string_view Tag(Bytes bytes, std::size_t at) {
  return {reinterpret_cast<const char*>(bytes.data()) + at, 4};
}

bool IsJpegCodec(std::string_view tag) {
  const std::string upper = UpperCase(tag);
  return upper == "MJPG" || upper == "JPEG";
}

bool ReadAt(int fd, std::int64_t at, std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = pread(fd, bytes.data(), bytes.size(), at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    at += count;
  }
  return true;
}

constexpr const char* kForeign =
    "it is no MJPEG in AVI, the only video that is read; convert it: "
    "ffmpeg -i IN -c:v mjpeg -q:v 2 OUT.avi";

}  // namespace

tl::unexpected<Error> AviReader::Broken(const std::string& what) const {
  return Fail(fmt::format("video '{}': {}", path_.string(), what), ErrorKind::kMeasurement);
}

/// Reads up to `count` bytes: fewer at the file's end, none if it cannot be read.
std::vector<std::uint8_t> AviReader::BytesAt(std::int64_t at, std::size_t count) const {
  const std::int64_t left = std::max<std::int64_t>(file_.size() - at, 0);
  std::vector<std::uint8_t> bytes(std::min(count, static_cast<std::size_t>(left)));
  if (!ReadAt(file_.fd(), at, bytes)) bytes.clear();
  return bytes;
}

/// Reads the chunk's header; absent if too few bytes are left.
std::optional<AviReader::Chunk> AviReader::ChunkAt(std::int64_t at) const {
  const auto head = BytesAt(at, kListHead);
  if (head.size() < kChunkHead) return std::nullopt;
  Chunk chunk{std::string(Tag(head, 0)), {}, at, U32(head, 4)};
  const bool list = chunk.tag == "LIST" || chunk.tag == "RIFF";
  if (list && head.size() == kListHead) chunk.list = Tag(head, 8);
  return chunk;
}

Result<void> AviReader::CheckHead() {
  const auto riff = ChunkAt(0);
  if (!riff || riff->tag != "RIFF" || riff->list != "AVI ") return Broken(kForeign);
  // A recorder that was killed leaves 0 or all ones here.
  const bool stated = riff->size != 0xFFFFFFFF;
  unfinished_ = !stated || riff->size == 0;
  if (stated && riff->size + kChunkHead > file_.size()) {
    return Broken(fmt::format(
        "truncated: its header announces {} bytes, there are {}; copy it again or record again",
        riff->size + kChunkHead, file_.size()));
  }
  return {};
}

/// Reads one stream's list if it is the first video.
void AviReader::TakeStream(const std::vector<std::uint8_t>& list, int number) {
  constexpr std::size_t kStreamHead = 36;
  constexpr std::size_t kBitmapHead = 20;
  Bytes bytes = list;
  Bytes head;
  Bytes format;
  while (bytes.size() >= kChunkHead) {
    const std::size_t size = std::min<std::size_t>(U32(bytes, 4), bytes.size() - kChunkHead);
    if (Tag(bytes, 0) == "strh") head = bytes.subspan(kChunkHead, size);
    if (Tag(bytes, 0) == "strf") format = bytes.subspan(kChunkHead, size);
    bytes = bytes.subspan(std::min(kChunkHead + size + size % 2, bytes.size()));
  }
  if (stream_.number >= 0 || head.size() < kStreamHead || Tag(head, 0) != "vids") return;
  stream_.number = number;
  if (format.size() < kBitmapHead) return;
  stream_.jpeg = IsJpegCodec(Tag(format, 16));
  stream_.width_px = static_cast<int>(std::min(U32(format, 4), 0x7FFFFFFFU));
  stream_.height_px = static_cast<int>(std::min(U32(format, 8), 0x7FFFFFFFU));
  const double scale = U32(head, 20);
  const double rate = U32(head, 24);
  if (scale > 0 && rate > 0) stream_.frames_per_s = rate / scale;
  if (stream_.frames_per_s > 0) stream_.start_s = U32(head, 28) / stream_.frames_per_s;
}

/// Finds the first video among the streams, and moves to the first frame; false if there is none.
bool AviReader::FindStream() {
  int number = 0;
  for (at_ = kListHead; at_ < file_.size();) {
    const auto chunk = ChunkAt(at_);
    if (!chunk || ++parts_ > kMaxParts) return false;
    if (chunk->list == "movi") break;
    if (chunk->list == "hdrl") {
      at_ += kListHead;
      continue;
    }
    if (chunk->list == "strl") {
      const std::int64_t size = std::clamp<std::int64_t>(chunk->size - 4, 0, kMaxOfHead);
      TakeStream(BytesAt(at_ + kListHead, static_cast<std::size_t>(size)), number++);
    }
    at_ = chunk->end();
  }
  return at_ < file_.size() && stream_.number >= 0 && stream_.number < 100 && stream_.jpeg;
}

/// True if the first frame is a JPEG of the stated size: not one of two fields.
Result<bool> AviReader::HasWholeFrames() {
  const std::int64_t first = at_;
  AviFrame frame;
  const auto more = Next(frame);
  at_ = first;
  chunks_ = frames_ = 0;
  if (!more) return more;
  const auto header = ReadImageHeader(frame.bytes);
  return !header || header->format != ImageFormat::kJpeg || header->height_px >= stream_.height_px;
}

Result<AviReader> AviReader::Open(const std::filesystem::path& path, std::size_t max_bytes) {
  auto file = OpenFile::Open(path);
  if (!file) {
    return Fail(fmt::format("video '{}': {}", path.string(), file.error().message),
                ErrorKind::kMeasurement);
  }
  AviReader reader(path, max_bytes, std::move(*file));
  if (reader.file_.size() == 0) {
    return reader.Broken("the file is empty (0 bytes); record the line again");
  }
  TRY(reader.CheckHead());
  if (!reader.FindStream()) return reader.Broken(kForeign);
  const auto whole = TRY(reader.HasWholeFrames());
  if (!whole) return reader.Broken(kForeign);
  return reader;
}

/// Returns the next chunk of the stream, empty or not; absent at the end.
Result<std::optional<AviReader::Chunk>> AviReader::NextChunk() {
  for (;;) {
    if (++parts_ > kMaxParts) return Broken("it has more than a million parts; record it again");
    const auto chunk = ChunkAt(at_);
    const bool frame = chunk && (chunk->tag == fmt::format("{:02}dc", stream_.number) ||
                                 chunk->tag == fmt::format("{:02}db", stream_.number));
    const bool named = chunk && std::all_of(chunk->tag.begin(), chunk->tag.end(),
                                            [](char c) { return c >= ' ' && c <= '~'; });
    const bool list =
        chunk && (chunk->list == "movi" || chunk->list == "rec " || chunk->list == "AVIX");
    const bool whole = named && chunk->at + kChunkHead + chunk->size <= file_.size();
    if (list) {
      if (chunk->list == "movi") frames_end_ = chunk->size > 0 ? chunk->end() : 0;
      at_ += kListHead;
    } else if (!whole && !unfinished_ && (frame || at_ < frames_end_)) {
      return Broken(
          fmt::format("frame {} is damaged or cut off, at byte {} of {}; record the line "
                      "again",
                      frames_ + 1, at_, file_.size()));
    } else if (!whole || chunk->tag == "RIFF") {
      return std::nullopt;  // room that a recorder set aside, or another file behind this one
    } else {
      at_ = chunk->end();
      if (frame) return chunk;
    }
  }
}

Result<bool> AviReader::Next(AviFrame& frame) {
  for (;;) {
    const auto chunk = TRY(NextChunk());
    if (!chunk) {
      if (frames_ == 0) return Broken("holds no frames; record the line again");
      return false;
    }
    const std::uint64_t place = chunks_++;
    const auto size = static_cast<std::size_t>(chunk->size);
    if (size == 0) continue;  // the frame before is shown once more
    ++frames_;
    if (size > max_bytes_) {
      return Broken(fmt::format("frame {} has {} bytes, more than the {} that are read", frames_,
                                size, max_bytes_));
    }
    frame.time_s.reset();
    frame.bytes.resize(size);
    if (!ReadAt(file_.fd(), chunk->at + kChunkHead, frame.bytes)) {
      return Broken(fmt::format("frame {} cannot be read; copy the file again", frames_));
    }
    if (stream_.frames_per_s > 0) {
      frame.time_s = stream_.start_s + static_cast<double>(place) / stream_.frames_per_s;
    }
    return true;
  }
}

}  // namespace trammel::machine
