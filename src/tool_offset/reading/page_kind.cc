#include "tool_offset/reading/page_kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tool_offset/reading/photo_pose.h"

namespace trammel::tool_offset {
namespace {

/// Flatbeds and feeders of offices; by the way of a network, too.
constexpr std::array<double, 14> kScannersDpi{100, 150, 200, 240, 250, 300,  360,
                                              400, 480, 500, 600, 800, 1200, 2400};
constexpr double kScannersScale = 0.01;  // printer's and scanner's together

bool Near(double dpi, double other, double part) { return std::abs(dpi / other - 1) < part; }

bool IsScanners(const Resolution& shown) {
  return std::any_of(kScannersDpi.begin(), kScannersDpi.end(), [&](double dpi) {
    return Near(shown.x, dpi, kScannersScale) && Near(shown.y, dpi, kScannersScale);
  });
}

/// By which the sides bow outwards, mean of all four; a camera's lens bows them alike.
double Barrel_mm(const PageMap& map) {
  constexpr std::size_t kSquare = 2;
  const auto& bend = map.bend_mm;
  // Between a side's ends it lies as far from its middle as its square's factor is large.
  return (bend[kLeft][kSquare] - bend[kRight][kSquare] + bend[kBottom][kSquare] -
          bend[kTop][kSquare]) /
         4;
}

}  // namespace

Resolution ShownResolution(const PageMap& map) {
  return {25.4 * std::hypot(map.u_px_mm.x_px, map.v_px_mm.x_px),
          25.4 * std::hypot(map.u_px_mm.y_px, map.v_px_mm.y_px)};
}

KindSigns SignsOf(const PageView& page, const PageMap& map, const StatedOfPage& stated) {
  constexpr double kFlat = 0.003;  // of a flatbed on which paper does not lie quite flat
  constexpr double kAxes = 0.02;
  constexpr double kAslant = 0.01;
  constexpr double kStraight_mm = 0.1;
  KindSigns signs;
  signs.shown = ShownResolution(map);
  signs.perspective = map.perspective();
  signs.barrel_mm = Barrel_mm(map);
  signs.camera_size = IsStoredSize(page.width, page.height);
  signs.stated = stated.dpi_x && stated.dpi_y &&
                 Near(signs.shown.x, *stated.dpi_x, kSameResolution) &&
                 Near(signs.shown.y, *stated.dpi_y, kSameResolution);
  signs.scanners = IsScanners(signs.shown);
  // A camera that stands so aslant that its axes differ sees far more perspective.
  signs.squeezed = signs.perspective < kAslant && !Near(signs.shown.x, signs.shown.y, kAxes);
  signs.flat = signs.perspective < kFlat && std::abs(signs.barrel_mm) < kStraight_mm;
  return signs;
}

std::optional<PageKind> KindBy(const KindSigns& signs, const StatedOfPage& stated, bool for_photo) {
  constexpr double kSurelyAslant = 0.01;
  if (stated.film_focal) {
    return signs.stated && signs.flat ? std::nullopt : std::optional(PageKind::kPhoto);
  }
  if (signs.perspective > kSurelyAslant) return PageKind::kPhoto;
  if (signs.stated) return signs.flat ? std::optional(PageKind::kScan) : std::nullopt;
  if (signs.squeezed) return std::nullopt;
  const bool as_scanners = signs.scanners && signs.flat;
  if (signs.camera_size) {
    return as_scanners && !for_photo ? std::nullopt : std::optional(PageKind::kPhoto);
  }
  if (as_scanners) return PageKind::kScan;
  return signs.flat || signs.scanners ? std::nullopt : std::optional(PageKind::kPhoto);
}

std::string WhyNoKind(const KindSigns& signs) {
  if (signs.squeezed) {
    return fmt::format(
        "it is squeezed, as by a fax or an editor: it shows the sheet with {0:.0f} dpi along a row "
        "and {1:.0f} down the page. Scan again with the same resolution both ways, or state both: "
        "--dpi {0:.0f} {1:.0f}",
        signs.shown.x, signs.shown.y);
  }
  return fmt::format(
      "cannot tell whether it is a scan or a photo: it shows the sheet with {:.0f} x {:.0f} dpi{}, "
      "seen aslant by {:.2f} %, sides bowed by {:.2f} mm{}. Take the file as the scanner or the "
      "phone stored it; or say --photo, or of a scan its resolution: --dpi {:.0f}",
      signs.shown.x, signs.shown.y,
      signs.stated ? ", as the file states" : ", which the file does not state",
      100 * signs.perspective, std::abs(signs.barrel_mm),
      signs.camera_size ? ", in a size that cameras store" : "",
      std::sqrt(signs.shown.x * signs.shown.y));
}

}  // namespace trammel::tool_offset
