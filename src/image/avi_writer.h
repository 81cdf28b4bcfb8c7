// Writes JPEG frames into an AVI file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trammel::image {

struct AviForm {
  int width_px = 0;          ///< 1 … 65535
  int height_px = 0;         ///< 1 … 65535
  double frames_per_s = 30;  ///< > 0; for players
};

/// Appends all of the bytes to a file of `size` bytes, or none: a partial write is truncated again.
/// Updates `size`. @returns 0 or the system's error number.
[[nodiscard]] int AppendWhole(int fd, std::span<const std::uint8_t> bytes, std::size_t& size);

/// Writes to an empty file that its caller owns. Each frame is passed to the system before Add()
/// returns: after a SIGKILL the file contains every added frame, and its sizes are 0, which marks
/// it as unfinished. Functions return 0 or the system's error number; EOVERFLOW if RIFF cannot
/// count more bytes (2 GB, which many readers take as signed).
class AviWriter {
 public:
  explicit AviWriter(int fd) : fd_(fd) {}

  /// Writes everything before the first frame.
  [[nodiscard]] int Begin(const AviForm& form);

  /// Appends a complete frame. After an error the file contains the frames before it.
  [[nodiscard]] int Add(std::span<const std::uint8_t> jpeg);

  /// Removes the last frame. REQUIRES that the last call was Add().
  void TakeBack();

  /// Writes the index, and the sizes into the header. Called once, at the end.
  [[nodiscard]] int Finish();

  [[nodiscard]] std::size_t frames() const { return index_.size(); }

 private:
  struct Entry {
    std::size_t at = 0;    ///< chunk's offset from the file's start
    std::size_t size = 0;  ///< JPEG size, bytes
  };

  int fd_;
  std::size_t size_ = 0;
  std::vector<Entry> index_;
  std::vector<std::uint8_t> chunk_;
};

}  // namespace trammel::image
