// Surplus of filament at each corner of a photographed chevron pattern.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/photo/photo_reader.h"
#include "pressure_advance/photo/photo_search.h"
#include "vision/chevron_finder.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// Reading of one chevron. Lengths in spacings of the apexes.
struct ChevronReading {
  double surplus = 0;    ///< filled area around the corner less that of straight arms, over the
                         ///< band's width: length of band. Positive: too much filament
  double sigma = 0;      ///< 1 sigma, from equal windows on the straight arms
  double wider = 0;      ///< width of the arm below over that above, less 1
  std::string unusable;  ///< why it was not measured; empty if it was
};

/// Chevrons straight from above.
struct ChevronView {
  std::string problem;          ///< why there is none, and the remedy; empty if there is one
  vision::FoundChevrons found;  ///< with a problem: count 0 where no chevrons are seen
  Frame picture;                ///< apexes to the right, never mirrored
  vision::GrayImage fill;       ///< same size: 0 on plate … 1 on filament
  double spacing_px = 0;        ///< of neighbouring apexes
  double first_x_px = 0;        ///< column of the first apex's middle
  double apex_y_px = 0;         ///< row of the apexes
  /// Distance of the frame's inner edge from the apexes' row, in spacings; absent: no frame is
  /// seen.
  std::optional<double> frame;
  vision::Homography photo_from_picture;
  int photo_width_px = 0, photo_height_px = 0;

  /// True if the photo shows this place of `picture`.
  [[nodiscard]] bool Shows(double x_px, double y_px) const;
};

/// Finds the chevrons of a photo and separates filament from plate.
[[nodiscard]] ChevronView ViewChevrons(PhotoSearch& photo);
/// Does the same for chevrons that were found before. REQUIRES at most 16384 px each way.
[[nodiscard]] ChevronView ViewChevrons(const BgrView& photo, const vision::FoundChevrons& found);

/// Measures each corner, first to last.
/// @param half_window  along the band from the corner, in spacings; clamped to 0.1 … 1.7
[[nodiscard]] std::vector<ChevronReading> ReadChevrons(const ChevronView& view, double half_window);

/// Returns the spacing of the apexes by the frame's height, which all tools have in common, mm; the
/// usual one without a frame.
[[nodiscard]] double SpacingOf_mm(const ChevronView& view);

/// Returns the picture with the apexes upwards and the bands' edges, one per pressure advance.
[[nodiscard]] PhotoView PictureOf(const ChevronView& view,
                                  const std::vector<double>& pressure_advance_s);

}  // namespace trammel::pressure_advance
