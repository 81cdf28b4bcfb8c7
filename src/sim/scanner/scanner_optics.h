// What happens to the light of some rows of a scan: inks, shadow, blur, sensor.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/random.h"
#include "sim/print/noise_field.h"
#include "sim/scanner/scanner_coverage.h"
#include "sim/scanner/scanner_page.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// Columns of a row, from begin up to end.
struct Columns {
  int begin = 0;
  int end = 0;
};

/// The light that comes back from some rows of the page, one plane per channel.
class LightRows {
 public:
  LightRows(const PrintedSheet& sheet, const ScannerTraits& traits, int width_px);

  /// Rows that have to be known above and below those that are wanted.
  [[nodiscard]] int halo_rows() const { return blur_radius_ + shadow_rows_; }
  /// Columns beside a line that its light reaches.
  [[nodiscard]] int halo_columns() const { return blur_radius_ + 1; }

  /// Computes `rows` rows from the coverages of rows + 2 * halo_rows() rows. Outside of `columns`
  /// is plain paper.
  void Compute(std::span<const CoverageRows> coverages, const std::array<bool, kInkCount>& has_ink,
               const CoverageRows& raised, Columns columns, int rows);
  /// Only plain paper.
  void ComputePaper(int rows);
  [[nodiscard]] std::span<const float> row(int channel, int index) const;

 private:
  void Compose(std::span<const CoverageRows> coverages, const std::array<bool, kInkCount>& has_ink,
               const CoverageRows& raised, Columns columns, int rows, std::size_t channel);
  void ShadeRow(const CoverageRows& raised, Columns columns, int index);
  void Blur(Columns columns, int rows, std::size_t channel);

  int channels_ = 1;
  std::size_t width_ = 0;
  int blur_radius_ = 0;
  int shadow_rows_ = 0;
  bool shadow_below_ = true;
  float shadow_strength_ = 0;
  std::vector<float> blur_taps_;
  std::vector<float> shadow_taps_;
  std::array<float, 3> paper_{};
  std::array<std::array<float, 3>, kInkCount> inks_{};  // by ink, then channel
  std::vector<float> before_;                           // rows before the blur
  std::vector<float> shade_;                            // one row
  std::array<std::vector<float>, 3> planes_;
};

/// Lamp, grain, noise, gamma and rounding.
class Sensor {
 public:
  Sensor(const ScannerTraits& traits, const PageFormat& format, const Random& random);

  /// One row of light per channel into the samples of one row of the page.
  void Read(const LightRows& light, int index, int page_row, std::span<std::uint8_t> samples);

 private:
  PageFormat format_;
  float texture_ = 0;
  Tile grain_;
  std::vector<float> lamp_;
  std::vector<float> noise_;
  std::vector<float> gain_;
  Random random_;
  std::vector<std::uint16_t> values_;  // of 65536 reflectances
};

}  // namespace trammel::sim
