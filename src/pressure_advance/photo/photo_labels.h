// Reads the numbers that other tools print beside their lines and chevrons.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/photo/chevron_reader.h"
#include "pressure_advance/photo/photo_lines.h"
#include "pressure_advance/photo/photo_reader.h"

namespace trammel::pressure_advance {

/// Numbers read beside a pattern, as one evenly spaced sequence.
struct LabelReading {
  std::vector<double> pressure_advance_s;  ///< of all candidates, first to last; empty: not read
  std::string problem;                     ///< why they were not read; empty if they were
  double lead = 0;  ///< logarithmic likelihood over that of the next best sequence
  std::optional<PhotoSide> from = {}, start = {};  ///< of lines: sides of the photo, by the labels
  bool mirrored = false;  ///< the photo is, by labels that are read or at least seen
};

/// Reads the labels of chevrons.
/// @param photo  the same px as those in which `view` was found
/// @param given_s  values, one per chevron, that are preferred: nothing is read unless the labels
///     contradict them. May be empty.
[[nodiscard]] LabelReading ReadLabels(const BgrView& photo, const ChevronView& view,
                                      const std::vector<double>& given_s = {});

/// Reads the labels of lines.
/// @param lines  found in `photo`, without a frame (PhotoOptions::framed)
[[nodiscard]] LabelReading ReadLabels(const BgrView& photo, const PhotoLines& lines,
                                      const std::vector<double>& given_s = {});

}  // namespace trammel::pressure_advance
