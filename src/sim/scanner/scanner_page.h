// Scans a printed sheet row by row.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

struct PageFormat {
  int width_px = 0;
  int height_px = 0;
  int channels = 1;  ///< 1 grey, 3 red green blue
  int bits = 8;      ///< per sample, 8 or 16

  [[nodiscard]] std::size_t row_bytes() const {
    return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(channels * bits / 8);
  }
};

/// One row of the page, row_bytes() long; 16-bit samples in the machine's own order. Its error ends
/// the scan.
using RowSink = std::function<Result<void>(std::span<const std::uint8_t> row)>;

struct ScannedPage {
  PageFormat format;
  std::vector<std::uint8_t> samples;  ///< row after row
};

/// A sheet on the glass. Memory: the outlines of its lines and some 100 rows.
class SheetScan {
 public:
  /// Errors (kInput): Validate's; ScannerMap::Make's.
  [[nodiscard]] static Result<SheetScan> Lay(const PrintedSheet& sheet,
                                             const ScannerTraits& traits);
  SheetScan(SheetScan&&) noexcept;
  SheetScan& operator=(SheetScan&&) noexcept;
  ~SheetScan();

  [[nodiscard]] const PageFormat& format() const;
  /// Where a place of the bed is seen, px from the centre of the first pixel (CONVENTIONS.md).
  [[nodiscard]] std::array<double, 2> PlaceOf(const PlaneMm& bed) const;
  /// Whether some of the print lies outside the page.
  [[nodiscard]] bool cut_off() const;

  /// Order of the optics: coverage of each ink exact per pixel, shadow, blur, lamp, grain, noise,
  /// gamma, rounding. The place of a line is exact to below 0.1 um (scanner_page_test).
  Result<void> Render(const Random& random, const RowSink& sink) const;

 private:
  struct Parts;
  explicit SheetScan(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// The same into memory.
[[nodiscard]] Result<ScannedPage> ScanSheet(const PrintedSheet& sheet, const ScannerTraits& traits,
                                            const Random& random);

}  // namespace trammel::sim
