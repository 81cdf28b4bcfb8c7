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

  void Add(const StrokeSum& other) {
    for (std::size_t i = 0; i < level.size(); ++i) level[i] += other.level[i];
    for (std::size_t i = 0; i < upright.size(); ++i) upright[i] += other.upright[i];
    levels += other.levels;
    uprights += other.uprights;
  }
};

/// Sums of each character at each place of each label.
class GlyphSums {
 public:
  /// Adds the sections of a text in one label. Parts beyond the row's longest_mm are not seen.
  /// REQUIRES label < the row's.
  void Add(std::size_t label, std::string_view text, StrokeSum& total) const;

 private:
  friend class StrokeTable;
  DigitStyle style_;
  std::size_t units_ = 0;
  std::vector<StrokeSum> sums_;  // by label, place in mm and character
};

/// Sections of all places at which strokes may lie, whitened over all of them.
class StrokeTable {
 public:
  [[nodiscard]] GlyphSums SumsOf(const DigitStyle& style) const;
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
  using Colour = std::array<double, 3>;
  // Sums of the pixels above and left of each corner.
  struct Label {
    int width = 0, height = 0;
    std::vector<Colour> sum;
  };
  [[nodiscard]] Colour SumTo(const Label& label, double x_mm, double y_mm) const;
  [[nodiscard]] StrokeSection SectionAt(const Label& label, double x_mm, double y_mm,
                                        bool upright) const;

  std::vector<Label> labels_;
  double photo_px_per_mm_ = 0;
  double px_per_mm_ = 10;
  int units_ = 0;
};

}  // namespace trammel::vision
