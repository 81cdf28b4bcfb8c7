// Surplus of filament at each corner of a photographed chevron pattern.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/photo/chevron_view.h"
#include "pressure_advance/photo/photo_reader.h"

namespace trammel::pressure_advance {

/// Reading of one chevron. Lengths in spacings of the apexes.
struct ChevronReading {
  double surplus = 0;    ///< filled area around the corner less that of straight arms, over the
                         ///< band's width: length of band. Positive: too much filament
  double sigma = 0;      ///< 1 sigma, from equal windows on the straight arms
  double wider = 0;      ///< width of the arm below over that above, less 1
  std::string unusable;  ///< why it was not measured; empty if it was
};

/// Measures each corner, first to last.
/// @param half_window  along the band from the corner, in spacings; clamped to 0.1 … 1.7
[[nodiscard]] std::vector<ChevronReading> ReadChevrons(const ChevronView& view, double half_window);

/// Returns the picture with the apexes upwards and the bands' edges, one per pressure advance.
[[nodiscard]] PhotoView PictureOf(const ChevronView& view,
                                  const std::vector<double>& pressure_advance_s);

}  // namespace trammel::pressure_advance
