#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "base/result.h"

namespace trammel::image {

/// Pixel formats of the rows. Palettes and less than 8 bits are always expanded.
enum class PngPixels {
  kAsStored,  ///< grey or RGB, with or without alpha, 8 bits or 16 in the processor's order
  kBgr8,      ///< the upper 8 bits of 16, without alpha, grey three times over
};

struct PngHeader {
  int width_px = 0;             ///< 1 … 1,000,000
  int height_px = 0;            ///< 1 … 1,000,000
  int samples = 1;              ///< per pixel of the rows: 1 … 4
  int bits = 8;                 ///< per sample of the rows: 8 or 16
  bool interlaced = false;      ///< Adam7: seven passes
  std::optional<double> dpi_x;  ///< absent where it does not say
  std::optional<double> dpi_y;
};

/// Decodes with libpng; texts and colour profiles are not unpacked. Input may be hostile, but the
/// caller must bound its cost, from the header or before. Messages do not name the file.
class PngReader {
 public:
  /// Reads the header. REQUIRES that `bytes` outlive the reader.
  [[nodiscard]] static Result<PngReader> Open(std::span<const std::uint8_t> bytes,
                                              PngPixels pixels);
  PngReader(PngReader&&) noexcept;
  PngReader& operator=(PngReader&&) noexcept;
  ~PngReader();

  [[nodiscard]] const PngHeader& header() const;
  [[nodiscard]] std::size_t row_bytes() const;

  /// Fills the next row with row_bytes(). With kAsStored rows of an interlaced picture contain only
  /// their pass's pixels. With kBgr8 each of passes() delivers all rows, each time with more pixels
  /// set: REQUIRES the row from the pass before.
  [[nodiscard]] Result<void> ReadRow(std::uint8_t* row);
  [[nodiscard]] int passes() const;  ///< 1 or 7

  /// Reads and checks the data after the last row.
  [[nodiscard]] Result<void> Finish();

  /// EXIF orientation, 1 … 8. REQUIRES Finish(): it may be at the end of the file.
  [[nodiscard]] int orientation() const;

 private:
  struct State;
  explicit PngReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

struct PngOutline {
  std::uint32_t width_px = 0;   ///< 1 … 2147483647
  std::uint32_t height_px = 0;  ///< 1 … 2147483647
  int bits = 8;                 ///< per pixel
};

/// Reads only the header. Errors (kInput): none found, or it states no size.
[[nodiscard]] Result<PngOutline> OutlineOfPng(std::span<const std::uint8_t> bytes);

/// Rejects a size that so few bytes cannot hold: compression reduces a picture by a factor of 1032
/// at most.
[[nodiscard]] Result<void> CheckCost(const PngOutline& outline, std::size_t bytes);

}  // namespace trammel::image
