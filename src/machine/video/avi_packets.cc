#include "machine/video/avi_packets.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "machine/camera/image_file.h"
#include "machine/net/file_bytes.h"
#include "machine/video/riff_head.h"

namespace trammel::machine {
namespace {

constexpr std::int64_t kChunkHead = 8;
constexpr std::int64_t kListHead = 12;
constexpr std::int64_t kMostOfHead = 1 << 20;  // of a stream's list, which takes some hundred bytes

/// Reads a file front to back through a window, so that many small chunks cost few calls.
class FileWindow {
 public:
  explicit FileWindow(OpenFile file) : file_(std::move(file)) {}

  [[nodiscard]] std::int64_t size() const { return file_.size(); }

  /// Up to `count` bytes from `at`: fewer at the file's end. Valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> At(std::int64_t at, std::size_t count) {
    if (at < from_ || at + static_cast<std::int64_t>(count) > from_ + held_) Fill(at, count);
    const std::int64_t left = std::max<std::int64_t>(from_ + held_ - at, 0);
    return {window_.data() + (at - from_), std::min(count, static_cast<std::size_t>(left))};
  }

  /// Like At(), into bytes of the caller's own.
  [[nodiscard]] bool Read(std::int64_t at, std::span<std::uint8_t> bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = pread(file_.fd(), bytes.data(), bytes.size(), at);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(count));
      at += count;
    }
    return true;
  }

 private:
  void Fill(std::int64_t at, std::size_t count) {
    constexpr std::size_t kWindow = 1 << 12;
    const auto left = static_cast<std::size_t>(std::max<std::int64_t>(file_.size() - at, 0));
    window_.resize(std::min(std::max(count, kWindow), left));
    from_ = at;
    held_ = Read(at, window_) ? static_cast<std::int64_t>(window_.size()) : 0;
  }

  OpenFile file_;
  std::vector<std::uint8_t> window_;
  std::int64_t from_ = 0;
  std::int64_t held_ = 0;
};

std::uint32_t U32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] | bytes[at + 1] << 8U | bytes[at + 2] << 16U |
         static_cast<std::uint32_t>(bytes[at + 3]) << 24U;
}

std::string_view Tag(std::span<const std::uint8_t> bytes, std::size_t at) {
  return {reinterpret_cast<const char*>(bytes.data()) + at, 4};
}

/// What a chunk's first bytes say.
struct Chunk {
  std::string tag;
  std::string list;  ///< a list's or RIFF's type, else empty
  std::int64_t at = 0;
  std::int64_t size = 0;  ///< of what follows its head

  [[nodiscard]] std::int64_t end() const { return at + kChunkHead + size + size % 2; }
};

/// The head at `at`; absent where not even that is left.
std::optional<Chunk> ChunkAt(FileWindow& file, std::int64_t at) {
  const auto head = file.At(at, kListHead);
  if (head.size() < kChunkHead) return std::nullopt;
  Chunk chunk{std::string(Tag(head, 0)), {}, at, U32(head, 4)};
  const bool list = chunk.tag == "LIST" || chunk.tag == "RIFF";
  if (list && head.size() == kListHead) chunk.list = Tag(head, 8);
  return chunk;
}

/// What the first video of the head's streams states.
struct AviStream {
  int number = -1;  ///< of its chunks' names; -1: there is none
  bool jpeg = false;
  int width_px = 0;
  int height_px = 0;
  double frames_per_s = 0;  ///< 0: not stated
  double start_s = 0;
};

bool IsJpegCodec(std::string_view tag) {
  std::string upper;
  for (const char c : tag) upper += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return upper == "MJPG" || upper == "JPEG";
}

/// Takes one stream's list, whose chunks are `bytes`.
void TakeStream(std::span<const std::uint8_t> bytes, int number, AviStream& stream) {
  constexpr std::size_t kStreamHead = 36;
  constexpr std::size_t kBitmapHead = 20;
  std::span<const std::uint8_t> head;
  std::span<const std::uint8_t> format;
  while (bytes.size() >= kChunkHead) {
    const std::size_t size = std::min<std::size_t>(U32(bytes, 4), bytes.size() - kChunkHead);
    if (Tag(bytes, 0) == "strh") head = bytes.subspan(kChunkHead, size);
    if (Tag(bytes, 0) == "strf") format = bytes.subspan(kChunkHead, size);
    bytes = bytes.subspan(std::min(kChunkHead + size + size % 2, bytes.size()));
  }
  if (stream.number >= 0 || head.size() < kStreamHead || Tag(head, 0) != "vids") return;
  stream.number = number;
  if (format.size() < kBitmapHead) return;
  stream.jpeg = IsJpegCodec(Tag(format, 16));
  stream.width_px = static_cast<int>(std::min(U32(format, 4), 0x7FFFFFFFU));
  stream.height_px = static_cast<int>(std::min(U32(format, 8), 0x7FFFFFFFU));
  const double scale = U32(head, 20);
  const double rate = U32(head, 24);
  if (scale > 0 && rate > 0) stream.frames_per_s = rate / scale;
  if (stream.frames_per_s > 0) stream.start_s = U32(head, 28) / stream.frames_per_s;
}

class AviPackets final : public VideoPackets {
 public:
  AviPackets(std::filesystem::path path, std::size_t most_bytes, OpenFile file)
      : path_(std::move(path)), most_bytes_(most_bytes), file_(std::move(file)) {}

  /// Whether this reader is the one for the file.
  Result<bool> Begin();
  Result<bool> Next(VideoPacket& packet) override;
  [[nodiscard]] int width_px() const override { return stream_.width_px; }
  [[nodiscard]] int height_px() const override { return stream_.height_px; }
  [[nodiscard]] std::int64_t file_bytes() const override { return file_.size(); }

 private:
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path_.string(), what), ErrorKind::kMeasurement);
  }
  bool FindStream();
  Result<bool> HasWholeFrames();
  Result<std::optional<Chunk>> NextFrame();

  std::filesystem::path path_;
  std::size_t most_bytes_;
  FileWindow file_;
  AviStream stream_;
  std::string chunk_dc_;  ///< names of the stream's chunks
  std::string chunk_db_;
  bool unfinished_ = false;
  std::int64_t at_ = 0;
  std::int64_t frames_end_ = 0;  ///< of the list that holds them; 0: not stated
  std::uint64_t chunks_ = 0;     ///< of the stream, so far
  std::uint64_t frames_ = 0;
};

/// Finds the first video among the streams, and goes to the first frame; false where there is none.
bool AviPackets::FindStream() {
  int number = 0;
  const std::int64_t end = file_.size();
  for (at_ = kListHead; at_ < end;) {
    const auto chunk = ChunkAt(file_, at_);
    if (!chunk) return false;
    if (chunk->list == "movi") break;
    if (chunk->list == "hdrl") {
      at_ += kListHead;
      continue;
    }
    if (chunk->list == "strl") {
      const std::int64_t size = std::min(chunk->size - 4, kMostOfHead);
      if (size > 0) {
        TakeStream(file_.At(at_ + kListHead, static_cast<std::size_t>(size)), number, stream_);
      }
      ++number;
    }
    at_ = chunk->end();
  }
  return at_ < end && stream_.number >= 0 && stream_.number < 100 && stream_.jpeg;
}

/// Whether the first frame is a JPEG of the size that is stated: not one of two fields.
Result<bool> AviPackets::HasWholeFrames() {
  const std::int64_t first = at_;
  VideoPacket packet;
  const auto more = Next(packet);
  at_ = first;
  chunks_ = frames_ = 0;
  if (!more) return more;
  if (!*more) return true;  // without frames: Next() says so
  const auto header = ReadImageHeader(packet.bytes);
  return !header || header->format != ImageFormat::kJpeg || header->height_px >= stream_.height_px;
}

Result<bool> AviPackets::Begin() {
  const auto start = file_.At(0, kListHead);
  if (start.size() < kListHead || Tag(start, 0) != "RIFF" || Tag(start, 8) != "AVI ") return false;
  if (const auto wrong = InspectRiff(start, file_.size(), unfinished_); !wrong.empty()) {
    return Broken(wrong);
  }
  if (!FindStream()) return false;
  chunk_dc_ = fmt::format("{:02}dc", stream_.number);
  chunk_db_ = fmt::format("{:02}db", stream_.number);
  return HasWholeFrames();
}

/// The next chunk of the stream, empty or not; absent at the end.
Result<std::optional<Chunk>> AviPackets::NextFrame() {
  for (;;) {
    const auto chunk = ChunkAt(file_, at_);
    const bool frame = chunk && (chunk->tag == chunk_dc_ || chunk->tag == chunk_db_);
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

Result<bool> AviPackets::Next(VideoPacket& packet) {
  for (;;) {
    const auto chunk = NextFrame();
    if (!chunk) return tl::unexpected(chunk.error());
    if (!*chunk) {
      if (frames_ == 0) return Broken("holds no frames; record the line again");
      return false;
    }
    const std::uint64_t place = chunks_++;
    const auto size = static_cast<std::size_t>((*chunk)->size);
    if (size == 0) continue;  // the frame before stands once more
    ++frames_;
    if (size > most_bytes_) {
      return Broken(fmt::format("frame {} has {} bytes, more than the {} that are read", frames_,
                                size, most_bytes_));
    }
    packet.time_s.reset();
    packet.bytes.resize(size);
    if (!file_.Read((*chunk)->at + kChunkHead, packet.bytes)) {
      return Broken(fmt::format("frame {} cannot be read; copy the file again", frames_));
    }
    if (stream_.frames_per_s > 0) {
      packet.time_s = stream_.start_s + static_cast<double>(place) / stream_.frames_per_s;
    }
    return true;
  }
}

}  // namespace

Result<std::unique_ptr<VideoPackets>> OpenAviPackets(const std::filesystem::path& path,
                                                     std::size_t most_bytes) {
  auto file = OpenFile::Open(path);
  if (!file) {
    return Fail(fmt::format("video '{}': {}", path.string(), file.error().message),
                ErrorKind::kMeasurement);
  }
  auto packets = std::make_unique<AviPackets>(path, most_bytes, std::move(*file));
  const auto ours = packets->Begin();
  if (!ours) return tl::unexpected(ours.error());
  if (!*ours) return nullptr;
  return packets;
}

}  // namespace trammel::machine
