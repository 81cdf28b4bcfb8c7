#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "base/result.h"

namespace trammel::image {

/// Forms of the rows. Palettes and less than 8 bits are always expanded.
enum class PngPixels {
  kAsStored,  ///< grey or RGB, with or without alpha, 8 bits or 16 in the processor's order
  kBgr8,      ///< the upper 8 bits of 16, without alpha, grey three times over
};

struct PngHeader {
  int width_px = 0;             ///< 1 … 1,000,000
  int height_px = 0;            ///< 1 … 1,000,000
  int samples = 1;              ///< of a pixel of the rows: 1 … 4
  int bits = 8;                 ///< of a sample of the rows: 8 or 16
  bool interlaced = false;      ///< Adam7: seven passes
  std::optional<double> dpi_x;  ///< absent where it does not say
  std::optional<double> dpi_y;
};

/// Decodes with libpng; texts and colour profiles stay packed. Input may be hostile, but what it
/// costs is the caller's to bound, from the header or before. Messages do not name the file.
class PngReader {
 public:
  /// Reads the header. REQUIRES that `bytes` live as long as the reader.
  [[nodiscard]] static Result<PngReader> Open(std::span<const std::uint8_t> bytes,
                                              PngPixels pixels);
  PngReader(PngReader&&) noexcept;
  PngReader& operator=(PngReader&&) noexcept;
  ~PngReader();

  [[nodiscard]] const PngHeader& header() const;
  [[nodiscard]] std::size_t row_bytes() const;

  /// Fills the next row with row_bytes(). With kAsStored those of an interlaced picture hold the
  /// pixels of their pass alone. With kBgr8 all rows come once in each of passes(), each time with
  /// more of their pixels set: it REQUIRES the row as the pass before left it.
  [[nodiscard]] Result<void> ReadRow(std::uint8_t* row);
  [[nodiscard]] int passes() const;  ///< 1 or 7

  /// Reads what stands behind the last row, and checks it.
  [[nodiscard]] Result<void> Finish();

  /// 1 … 8, of EXIF. REQUIRES Finish(): it may stand at the end.
  [[nodiscard]] int orientation() const;

 private:
  struct State;
  explicit PngReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

struct PngOutline {
  std::uint32_t width_px = 0;   ///< 1 … 2147483647
  std::uint32_t height_px = 0;  ///< 1 … 2147483647
  int bits = 8;                 ///< of a pixel
};

/// Reads the header alone. Errors (kInput): there is none, or it states no size.
[[nodiscard]] Result<PngOutline> OutlineOfPng(std::span<const std::uint8_t> bytes);

/// Refuses a size that so few bytes cannot hold: packing makes a picture smaller by a factor of
/// 1032 at most.
[[nodiscard]] Result<void> CheckCost(const PngOutline& outline, std::size_t bytes);

}  // namespace trammel::image
