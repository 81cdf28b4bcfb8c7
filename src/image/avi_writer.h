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

/// Appends all of the bytes to a file of `size` bytes, or none of them: a part of them is taken
/// away again. Adds to `size`. @returns 0 or the system's error number.
[[nodiscard]] int AppendWhole(int fd, std::span<const std::uint8_t> bytes, std::size_t& size);

/// Writes to an empty file that its caller keeps open. Each frame is handed to the system before
/// Add() returns: after a SIGKILL at any moment the file has every frame that was added, and its
/// sizes are 0, which says that it was not finished. Its functions return 0 or the system's error
/// number; EOVERFLOW where RIFF counts no more bytes (2 GB, which many readers take as signed).
class AviWriter {
 public:
  explicit AviWriter(int fd) : fd_(fd) {}

  /// Writes everything before the first frame.
  [[nodiscard]] int Begin(const AviForm& form);

  /// Appends a frame whole. After an error the file has those before it.
  [[nodiscard]] int Add(std::span<const std::uint8_t> jpeg);

  /// Takes the last frame away again. REQUIRES Add() before, and no other call since.
  void TakeBack();

  /// Writes the index, and the sizes into the head. Once, at the end.
  [[nodiscard]] int Finish();

  [[nodiscard]] std::size_t frames() const { return index_.size(); }

 private:
  struct Entry {
    std::size_t at = 0;    ///< of the chunk, from the file's start
    std::size_t size = 0;  ///< of the JPEG, in bytes
  };

  int fd_;
  std::size_t size_ = 0;
  std::vector<Entry> index_;
  std::vector<std::uint8_t> chunk_;
};

}  // namespace trammel::image
