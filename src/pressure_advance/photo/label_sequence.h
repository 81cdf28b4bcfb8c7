// Reads printed numbers as one evenly spaced sequence.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/frame.h"
#include "vision/image.h"
#include "vision/segment_digits.h"

namespace trammel::pressure_advance {

/// Numbers as a tool writes them.
struct LabelFormat {
  vision::DigitStyle style;
  bool rounded = false;  ///< to `digits` decimals; else `digits` significant ones, and cut
  int digits = 4;
  std::size_t characters = 20;  ///< longer ones are cut

  [[nodiscard]] std::string TextOf(double value_s) const;
};

/// One way in which the labels may lie.
struct LabelPlaces {
  std::vector<vision::Homography> photo_from_label;  ///< at candidates 0, 2, 4 …, as for LabelRow
  std::vector<LabelFormat> formats;
  int longest_mm = 14;  ///< of a label that is looked at
  double along_mm = 1;  ///< search on either side
};

/// Values that the labels show.
struct SequenceReading {
  std::vector<double> values_s;  ///< of all candidates; empty: not read
  std::string problem;           ///< why they were not read; empty if they were, or are as given
  bool as_given = false;         ///< the labels show the given values, or look like them
  double score = 0;              ///< logarithmic likelihood of the best sequence over no labels
  double lead = 0;               ///< that over the next best sequence
  std::size_t places = 0;        ///< index of the way in which the labels lie
};

/// Least score of labels that are seen, also where a digit stays open. Tuned on virtual prints,
/// seeds 310000 to 310999.
inline constexpr double kLeastLabelScore = 30;

/// Compares the photo with each sequence of round steps from a round start that people print: the
/// number of digits is free, their order is not, so that a digit that is hardly seen does no harm.
/// A sequence counts if it leads clearly over all others, if two of three labels are seen, and if
/// no digit looks clearly like another one.
/// @param all  each way with one label per second candidate
/// @param given_s  values that are preferred: nothing is read unless the labels contradict them.
///     May be empty.
/// REQUIRES candidates >= 4.
[[nodiscard]] SequenceReading ReadSequence(const BgrView& photo,
                                           const std::vector<LabelPlaces>& all,
                                           std::size_t candidates,
                                           const std::vector<double>& given_s = {});

}  // namespace trammel::pressure_advance
