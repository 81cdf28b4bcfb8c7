// Weighs texts of printed seven-segment digits whose places in a photo are known.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "base/frame.h"
#include "vision/image.h"

namespace trammel::vision {

/// Digits of seven strokes, 2 mm each, in cells of 2 x 4 mm every 3 mm.
struct DigitStyle {
  bool narrow = false;     ///< "1" and "." at the cell's left edge, 1 mm before the next cell; else
                           ///< in the middle of an ordinary cell
  bool nine_foot = false;  ///< "9" has a bottom stroke
};

/// Returns the length of a text to the last cell's end, mm.
[[nodiscard]] double LengthOf_mm(std::string_view text, const DigitStyle& style);

/// Offset of all labels from where they were expected.
struct LabelOffset {
  double along_mm = 0;
  double up_mm = 0;
  double scale = 1;
};

/// Samples across a stroke: 0.2 mm apart, in each of three colours.
inline constexpr int kStrokeSamples = 7;
using StrokeSection = std::array<double, std::size_t{3} * kStrokeSamples>;

/// Sum of the sections along the strokes of texts.
struct StrokeSum {
  StrokeSection level{}, upright{};
  int levels = 0, uprights = 0;  ///< pieces of 1 mm

  void Add(const StrokeSum& other);
};

/// Sections of all places at which strokes may lie, whitened over all of them.
class StrokeTable {
 public:
  /// Sums the sections of a text in one label; REQUIRES label < the row's.
  [[nodiscard]] StrokeSum SumOf(std::size_t label, std::string_view text,
                                const DigitStyle& style) const;
  /// Returns the logarithmic likelihood that these places and no others hold strokes, over that of
  /// none: the strokes' look is not known, and the one that fits best counts (Wilks' lambda of two
  /// classes, for level and for upright strokes).
  /// @param total  sum over all labels
  [[nodiscard]] double LogLikelihood(const StrokeSum& total) const;

 private:
  friend class LabelRow;
  int units_ = 0;                                            // mm along each label
  std::vector<std::vector<StrokeSection>> level_, upright_;  // per label, per place
  std::size_t levels_ = 0, uprights_ = 0;
};

/// Labels cut out of a photo.
class LabelRow {
 public:
  /// @param photo_from_label  of each label: mm, x along the text from the lower left corner of its
  ///     first cell, y up.
  /// @param longest_mm  length of the labels that is looked at, 1 … 20
  LabelRow(const BgrView& photo, const std::vector<Homography>& photo_from_label, int longest_mm);

  [[nodiscard]] std::size_t size() const { return labels_.size(); }
  /// Photo px per mm at the row's middle.
  [[nodiscard]] double px_per_mm() const { return photo_px_per_mm_; }
  /// Takes the sections at an offset of at most 1.5 mm.
  [[nodiscard]] StrokeTable TableAt(const LabelOffset& offset) const;

 private:
  // Sums of the pixels above and left of each corner, per colour.
  struct Label {
    int width = 0, height = 0;
    std::array<std::vector<double>, 3> sum;
  };
  [[nodiscard]] std::array<double, 3> MeanOf(const Label& label, double x0_mm, double x1_mm,
                                             double y0_mm, double y1_mm) const;

  std::vector<Label> labels_;
  double photo_px_per_mm_ = 0;
  double px_per_mm_ = 10;
  int units_ = 0;
};

}  // namespace trammel::vision
