// Scans a printed sheet row by row.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_machine.h"
#include "sim/sheet/sheet_paper.h"
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

/// Receives one row of the page, row_bytes() long; 16-bit samples in native byte order. Its error
/// ends the scan.
using RowSink = std::function<Result<void>(std::span<const std::uint8_t> row)>;

struct ScannedPage {
  PageFormat format;
  std::vector<std::uint8_t> samples;  ///< row after row
};

/// Sheet on the glass. Memory: the outlines of its lines and some 100 rows.
class SheetScan {
 public:
  /// Errors (kInput): a sheet without strokes; ScannerMap::Make's.
  [[nodiscard]] static Result<SheetScan> Lay(const PrintedSheet& sheet,
                                             const ScannerTraits& traits);
  SheetScan(SheetScan&&) noexcept;
  SheetScan& operator=(SheetScan&&) noexcept;
  ~SheetScan();

  [[nodiscard]] const PageFormat& format() const;
  /// Computes the pixel of a place of the bed, px from the first pixel's centre (CONVENTIONS.md).
  [[nodiscard]] std::array<double, 2> PlaceOf(const PlaneMm& bed) const;
  /// True if some of the print is outside the page.
  [[nodiscard]] bool cut_off() const;

  /// Applies the optics in this order: coverage of each ink exact per pixel, shadow, blur, lamp,
  /// grain, noise, gamma, rounding. The position of a line is exact to below 0.1 um
  /// (scanner_page_test).
  Result<void> Render(const Random& random, const RowSink& sink) const;

 private:
  struct Parts;
  explicit SheetScan(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// Does the same into memory.
[[nodiscard]] Result<ScannedPage> ScanSheet(const PrintedSheet& sheet, const ScannerTraits& traits,
                                            const Random& random);

struct PageFileOptions {
  std::optional<double> dpi;  ///< as stated in the file, even if wrong; absent: not stated
  int jpeg_quality = 90;      ///< 1 … 100
};

/// Scans into a new file of the kind of its extension: .png (written row by row), .jpg or .jpeg (8
/// bit only). Removes an incomplete file. Errors (kInput): another extension, 16 bit JPEG, a file
/// that cannot be written.
[[nodiscard]] Result<void> WriteScan(const SheetScan& scan, const Random& random,
                                     const PageFileOptions& options,
                                     const std::filesystem::path& path);

/// Sheet in the world of a seed, and its scan. Two sheets of one seed share their machine; two
/// scans of one sheet share their ink. Seeds below 1000 are for development.
struct SheetName {
  std::uint64_t seed = 0;
  std::uint64_t sheet = 0;  ///< 0 … 9999
  std::uint64_t scan = 0;   ///< 0 … 9999
};

[[nodiscard]] SheetMachine MachineOf(const SheetName& name, SheetScene scene);
[[nodiscard]] SheetPaper PaperOf(const SheetName& name, SheetScene scene);
/// Returns the random generator of PrintSheet.
[[nodiscard]] Random PrintingOf(const SheetName& name);
[[nodiscard]] ScannerTraits ScannerOf(const SheetName& name, const PrintedSheet& sheet);
/// Returns the random generator of a scan's noise.
[[nodiscard]] Random ScanningOf(const SheetName& name);

/// Returns the truth of a scan as JSON (docs/reference/formats.md): the offset from `reference` of
/// each tool that the file draws with, null if the reference draws nothing; the backlash; the
/// scanner's errors.
[[nodiscard]] std::string SheetTruthJson(const SheetName& name, const PrintedSheet& sheet,
                                         int reference, const ScannerTraits& scanner,
                                         const PageFormat& format);

}  // namespace trammel::sim
