// Reads the JPEG frames of an AVI file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/net/file_bytes.h"

namespace trammel::machine {

/// Frame as stored.
struct AviFrame {
  std::vector<std::uint8_t> bytes;
  std::optional<double> time_s;  ///< on the recording's clock
};

/// Reads the chunks of an AVI in file order, by their own sizes: ignores the indices and counts in
/// its headers. Files of any size, including OpenDML's further segments.
///
/// A frame's time is its index among the stream's chunks, empty ones included, at the stream's
/// stated rate; absent if there is none. A killed recording ends where it was truncated.
class AviReader {
 public:
  /// @param most_bytes  of a frame.
  /// Errors (kMeasurement), which name the file: missing, cut off, or a video of another kind; that
  /// one has the command that converts it.
  [[nodiscard]] static Result<AviReader> Open(const std::filesystem::path& path,
                                              std::size_t max_bytes);

  /// Reads the next frame into reused memory; false after the last.
  /// Errors (kMeasurement): damage, a frame of more bytes, no frame at all, a million chunks.
  [[nodiscard]] Result<bool> Next(AviFrame& frame);

  [[nodiscard]] int width_px() const { return stream_.width_px; }    ///< from the header
  [[nodiscard]] int height_px() const { return stream_.height_px; }  ///< from the header

 private:
  /// First video among the header's streams.
  struct Stream {
    int number = -1;  ///< as in its chunks' names; -1: none found
    bool jpeg = false;
    int width_px = 0;
    int height_px = 0;
    double frames_per_s = 0;  ///< 0: not stated
    double start_s = 0;
  };
  struct Chunk {
    std::string tag;
    std::string list;  ///< a list's or RIFF's type, else empty
    std::int64_t at = 0;
    std::int64_t size = 0;  ///< payload size, without header

    [[nodiscard]] std::int64_t end() const { return at + 8 + size + size % 2; }
  };

  AviReader(std::filesystem::path path, std::size_t max_bytes, OpenFile file)
      : path_(std::move(path)), max_bytes_(max_bytes), file_(std::move(file)) {}

  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const;
  [[nodiscard]] std::vector<std::uint8_t> BytesAt(std::int64_t at, std::size_t count) const;
  [[nodiscard]] std::optional<Chunk> ChunkAt(std::int64_t at) const;
  [[nodiscard]] Result<void> CheckHead();
  void TakeStream(const std::vector<std::uint8_t>& list, int number);
  [[nodiscard]] bool FindStream();
  [[nodiscard]] Result<bool> HasWholeFrames();
  [[nodiscard]] Result<std::optional<Chunk>> NextChunk();

  std::filesystem::path path_;
  std::size_t max_bytes_;
  OpenFile file_;
  Stream stream_;
  bool unfinished_ = false;  ///< true if the recorder was killed before writing sizes
  std::int64_t at_ = 0;
  std::int64_t frames_end_ = 0;  ///< end of the frames' list; 0: not stated
  std::size_t parts_ = 0;        ///< chunks of any kind, so far
  std::uint64_t chunks_ = 0;     ///< chunks of the stream so far
  std::uint64_t frames_ = 0;
};

}  // namespace trammel::machine
