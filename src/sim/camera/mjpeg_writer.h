// Motion JPEG in AVI files, frame by frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "base/result.h"

namespace trammel::sim {

/// Writes ready-made JPEG images into an AVI file without touching them.
class MjpegWriter {
 public:
  /// Creates the file; an existing one is an error. REQUIRES width, height, frames_per_s > 0.
  [[nodiscard]] static Result<MjpegWriter> Create(const std::filesystem::path& path, int width,
                                                  int height, int frames_per_s);

  MjpegWriter(MjpegWriter&&) noexcept;
  MjpegWriter& operator=(MjpegWriter&&) noexcept;
  ~MjpegWriter();  ///< An unfinished file stays behind without an index.

  /// Appends one frame. REQUIRES a JPEG image of the file's width and height.
  [[nodiscard]] Result<void> Add(std::span<const std::uint8_t> jpeg);

  /// Writes the index and closes the file; nothing can be added afterwards.
  [[nodiscard]] Result<void> Finish();

 private:
  struct State;
  explicit MjpegWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace trammel::sim
