// Writes PNG row by row.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/page.h"
#include "base/result.h"

namespace trammel::image {

struct PngForm {
  enum class Order { kRgb, kBgr };
  enum class Packing {
    kFast,   ///< differences along the row, as run lengths: a camera's noise packs no better
    kDense,  ///< zlib's level 3 with the best filter for each row; several times slower
  };
  int width_px = 0;           ///< 1 … 1,000,000
  int height_px = 0;          ///< 1 … 1,000,000
  int channels = 1;           ///< 1 grey, 3 colours
  int bits = 8;               ///< 8, or 16 in the processor's order
  Order order = Order::kBgr;  ///< colour order of the given rows
  Packing packing = Packing::kFast;
  std::optional<double> dpi_x;  ///< > 0; stated where both are
  std::optional<double> dpi_y;  ///< > 0
};

/// Receives the file's bytes as they are produced; an error ends the writing.
using ByteSink = std::function<Result<void>(std::span<const std::uint8_t>)>;

class PngWriter {
 public:
  /// Writes the header. Errors: a size beyond the form's limits (kInput), the sink's unchanged.
  [[nodiscard]] static Result<PngWriter> Create(const PngForm& form, ByteSink sink);
  PngWriter(PngWriter&&) noexcept;
  PngWriter& operator=(PngWriter&&) noexcept;
  ~PngWriter();

  /// REQUIRES fewer than height_px earlier calls, and width_px * channels samples.
  [[nodiscard]] Result<void> WriteRow(const std::uint8_t* row);

  /// Writes the end of the file. REQUIRES all rows.
  [[nodiscard]] Result<void> Finish();

 private:
  struct State;
  explicit PngWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Encodes grey or BGR pixels. @param dpi_x, dpi_y  stored if both are present.
/// Errors (kInput): a side of less than 1 or more than 1,000,000 px.
[[nodiscard]] Result<std::vector<std::uint8_t>> EncodePng(const PageView& pixels,
                                                          std::optional<double> dpi_x = {},
                                                          std::optional<double> dpi_y = {});

}  // namespace trammel::image
