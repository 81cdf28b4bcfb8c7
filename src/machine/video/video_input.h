// Opens a recorded video for libav, which is given its bytes and never a name: whatever the file
// says, no other file and no address is opened.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"

struct AVFormatContext;
struct AVPacket;

namespace trammel::machine {

/// Whether a codec of libav's is one of those that recordings are made with: MJPEG, raw pixels,
/// H.264, H.265, MPEG-4, VP8, VP9, FFV1.
[[nodiscard]] bool IsRecordingCodec(int codec_id);

/// The most pixels of a frame, of `most` in general: decoders of codecs whose frames depend on each
/// other keep up to sixteen of them.
[[nodiscard]] std::size_t MostPixelsOf(int codec_id, std::size_t most);

/// The packets of a file's first video. AVI, MP4 or MOV, and Matroska or WebM are read, told by
/// their first bytes whatever the name; nothing else that libav knows (playlists, lists of files,
/// patterns, devices) is even looked for. Messages do not name the file.
class VideoInput {
 public:
  /// @param most_pixels  of a frame; a file that states more is refused before any is decoded.
  /// Errors (kMeasurement): no regular file, no video of these kinds, cut off, another codec, more
  /// entries in its tables than its bytes can hold.
  [[nodiscard]] static Result<VideoInput> Open(const std::filesystem::path& path,
                                               std::size_t most_pixels);
  VideoInput(VideoInput&&) noexcept;
  VideoInput& operator=(VideoInput&&) noexcept;
  ~VideoInput();

  [[nodiscard]] AVFormatContext* format() const;
  [[nodiscard]] int stream() const;
  [[nodiscard]] std::int64_t bytes() const;
  /// Its recorder was killed before it could state its size; the last frame may be cut off.
  [[nodiscard]] bool unfinished() const;

  /// The next packet of the video with anything in it; 0, or libav's error, AVERROR_EOF at the end.
  /// A file whose index names the same bytes over and over ends with an error (see fault()).
  [[nodiscard]] int Next(AVPacket* packet);

  /// What Next() ended with where it was not libav that failed; else empty.
  [[nodiscard]] const std::string& fault() const;

 private:
  struct State;
  explicit VideoInput(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// libav's words for an error.
[[nodiscard]] std::string ExplainLibav(int error);

}  // namespace trammel::machine
