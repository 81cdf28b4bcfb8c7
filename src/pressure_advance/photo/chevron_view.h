// Photographed chevron patterns straight from above, filament told from plate.
#pragma once

#include <optional>
#include <string>

#include "base/frame.h"
#include "pressure_advance/photo/photo_search.h"
#include "vision/chevron_finder.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// Part of each arm that tells its straight edges, in spacings from the apexes' row: 5 to 14 mm
/// along the arm of a pattern with a spacing of 3.6 mm.
inline constexpr double kStraightBegin = 1.0, kStraightEnd = 2.75;

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
  /// Returns the row at a distance from the apexes, in spacings. @param side  -1: above, 1: below
  [[nodiscard]] int RowOf(int side, double distance) const;
  /// Returns the column of a chevron's middle in a row, px. @param off  from it, in spacings
  [[nodiscard]] double ColumnOf(int chevron, double row, double off) const;
};

/// Finds the chevrons of a photo and separates filament from plate.
[[nodiscard]] ChevronView ViewChevrons(PhotoSearch& photo);
/// Does the same for chevrons that were found before. REQUIRES at most 16384 px each way.
[[nodiscard]] ChevronView ViewChevrons(const BgrView& photo, const vision::FoundChevrons& found);

/// Returns the spacing of the apexes by the frame's height, which all tools have in common, mm; the
/// usual one without a frame.
[[nodiscard]] double SpacingOf_mm(const ChevronView& view);

/// Returns the value between two columns of a row, both within the image or at its border.
[[nodiscard]] float ValueAt(const vision::GrayImage& image, double x_px, int y_px);

}  // namespace trammel::pressure_advance
