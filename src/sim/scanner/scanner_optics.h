// Exact coverage of each pixel by a line of ink.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/random.h"
#include "sim/print/texture.h"
#include "sim/scanner/scanner_page.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// Outline of one stroke on the page.
struct InkOutline {
  int ink = 0;
  bool raised = true;
  double weight = 1;  ///< opacity, negative where the outline runs the other way round
  double top_px = 0;
  double bottom_px = 0;
  double left_px = 0;
  double right_px = 0;
  std::vector<PixelPlace> corners;  ///< in order, not closed
};

/// From the bed to the picture.
using InkPlace = std::function<PixelPlace(const PlaneMm&)>;

/// Returns both edges of the stroke, joined by half circles at its ends.
[[nodiscard]] InkOutline OutlineOf(const InkStroke& stroke, const InkPlace& seen_at);

/// Sets the bounds, and the sign of an opacity in `weight`, from the corners.
void Close(InkOutline& outline);

/// Coverage of a few rows' pixels, as differences along each row: a pixel's coverage is the sum of
/// the values up to it. The cost of an outline grows with its edge's length, not its area; areas
/// that share an edge add up to the exact area of both.
///
/// A pixel weighs its surroundings by a pyramid two pixels wide: its own square, blurred by optics
/// by one pixel. Unlike a square's, such a pixel's sums preserve a line's position exactly,
/// wherever the line is between the pixels. Exact across columns; across rows in steps of 1/4.
class CoverageRows {
 public:
  /// Margin of pixels by which an outline affects its surroundings.
  static constexpr int kReachPx = 1;

  /// Clears to `rows` rows from page row `first_row` on, `width` px wide.
  void Reset(int first_row, int rows, int width);
  /// Adds the part of the outline within the rows.
  void Add(const InkOutline& outline);
  /// Integrates differences to coverages within 0 … 1.
  void Sum();
  /// First of the changed columns; empty (begin >= end) if there are none.
  [[nodiscard]] int begin() const { return begin_; }
  [[nodiscard]] int end() const { return end_; }
  [[nodiscard]] std::span<const float> row(int index) const {
    return {values_.data() + static_cast<std::size_t>(index) * stride_ + kPad, width_};
  }

 private:
  static constexpr int kPad = 2;  // columns left of the page that an edge at its border touches

  void AddEdge(PixelPlace from, PixelPlace to, double weight);
  void AddStep(double x_px, double next_x_px, int quarter, double height);

  int first_row_ = 0;
  int rows_ = 0;
  std::size_t width_ = 0;
  int begin_ = 0;
  int end_ = 0;
  std::size_t stride_ = 0;
  std::vector<float> values_;
};

/// Columns of a row, from begin up to end.
struct Columns {
  int begin = 0;
  int end = 0;
};

/// Reflected light of some rows of the page, one plane per channel.
class LightRows {
 public:
  LightRows(const PrintedSheet& sheet, const ScannerTraits& traits, int width_px);

  /// Returns the number of rows needed above and below the wanted ones.
  [[nodiscard]] int halo_rows() const { return blur_radius_ + shadow_rows_; }
  /// Returns the number of columns beside a line that its light reaches.
  [[nodiscard]] int halo_columns() const { return blur_radius_ + 1; }

  /// Computes `rows` rows from the coverages of rows + 2 * halo_rows() rows. Plain paper outside of
  /// `columns`.
  void Compute(std::span<const CoverageRows> coverages, const std::array<bool, kInkCount>& has_ink,
               const CoverageRows& raised, Columns columns, int rows);
  /// Computes rows of plain paper.
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

  /// Converts one row of light per channel to the samples of one row of the page.
  void Read(const LightRows& light, int index, int page_row, std::span<std::uint8_t> samples);

 private:
  PageFormat format_;
  float texture_ = 0;
  Tile grain_;
  std::vector<float> lamp_;
  std::vector<float> noise_;
  std::vector<float> gain_;
  Random random_;
  std::vector<std::uint16_t> values_;  // in 1/65536 of reflectance
};

}  // namespace trammel::sim
