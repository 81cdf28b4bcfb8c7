#include "tool_offset/reading/photo_checks.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/statistics.h"
#include "geometry/linear_systems.h"

namespace trammel::tool_offset {
namespace {

/// Mean ink across a side of the box, by the distance outside the outermost line's middle.
struct SideProfile {
  static constexpr double kHalf_mm = 0.6;  // paper beside the lines
  static constexpr double kStep_mm = 0.025;
  std::vector<double> ink;
  double px_per_mm = 0;
  int places = 0;
};

SideProfile ProfileOf(const PageView& page, const SheetPlan& plan, const SheetOnPage& sheet,
                      Side side) {
  SideProfile profile;
  const double inside_mm = plan.box_insets_mm.back() + SideProfile::kHalf_mm;
  const auto columns =
      static_cast<std::size_t>((inside_mm + SideProfile::kHalf_mm) / SideProfile::kStep_mm) + 1;
  profile.ink.assign(columns, 0);
  std::vector<float> samples;
  for (const SidePoint& point : sheet.box_places) {
    if (point.side != side) continue;
    const LocalMap local = sheet.map.Near(sheet.map.OnSide(side, point.along_mm));
    const PagePoint inward = -Outward(side) * (IsUpright(side) ? local.u_px_mm : local.v_px_mm);
    Strip strip;
    strip.rows = 1;
    strip.columns = static_cast<int>(columns);
    strip.column_step = SideProfile::kStep_mm * inward;
    strip.origin = point.place - SideProfile::kHalf_mm * inward;
    if (!SampleStrip(page, sheet.reference_mix, strip, samples)) continue;
    for (std::size_t c = 0; c < columns; ++c) profile.ink[c] += static_cast<double>(samples[c]);
    profile.px_per_mm += Length(inward);
    ++profile.places;
  }
  for (double& value : profile.ink) value /= std::max(1, profile.places);
  profile.px_per_mm /= std::max(1, profile.places);
  return profile;
}

/// Computes a line of this width, blurred; 1 inside a wide one.
double BlurredLine(double at_mm, double width_mm, double sigma_mm) {
  const double k = 1 / (sigma_mm * std::numbers::sqrt2);
  return (std::erf(k * (at_mm + width_mm / 2)) - std::erf(k * (at_mm - width_mm / 2))) / 2;
}

/// Returns the profile's residual after the best level, slope and darkness.
double Misfit(const SideProfile& profile, const SheetPlan& plan, double width_mm, double sigma_mm) {
  const auto rows = static_cast<Eigen::Index>(profile.ink.size());
  Eigen::MatrixXd design(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double inside_mm = static_cast<double>(i) * SideProfile::kStep_mm - SideProfile::kHalf_mm;
    double lines = 0;
    for (const double inset_mm : plan.box_insets_mm) {
      lines += BlurredLine(inside_mm - inset_mm, width_mm, sigma_mm);
    }
    design.row(i) << 1, inside_mm, lines;
  }
  const Eigen::Map<const Eigen::VectorXd> ink(profile.ink.data(), rows);
  const Eigen::Vector3d fit =
      geometry::SolveSymmetric(design.transpose() * design, design.transpose() * ink);
  return (ink - design * fit).squaredNorm();
}

double BlurOfSide_px(const SideProfile& profile, const SheetPlan& plan) {
  constexpr double kFinest_px = 0.3;
  constexpr double kCoarsest_px = 6;
  constexpr double kStep_px = 0.1;
  double best_px = 0;
  double least = 1e300;
  for (double factor = 0.6; factor < 1.6; factor += 0.05) {
    const double width_mm = factor * plan.settings.line_width_mm;
    for (double blur_px = kFinest_px; blur_px <= kCoarsest_px; blur_px += kStep_px) {
      const double misfit = Misfit(profile, plan, width_mm, blur_px / profile.px_per_mm);
      if (misfit >= least) continue;
      least = misfit;
      best_px = blur_px;
    }
  }
  return best_px;
}

/// The reference tool's ink and paper around one of its fingers.
struct FingerLight {
  double paper = 0;  ///< levels of all channels, mean
  double depth = 0;  ///< darkness of ink, as a share of the paper
  bool saturated = false;
};

std::optional<FingerLight> LightAt(const PageView& page, const PageMap& map, SheetPoint middle,
                                   bool is_x) {
  constexpr double kAcross_mm = 0.9;
  constexpr double kAlong_mm = 0.5;
  constexpr double kSaturated = 252;
  const LocalMap local = map.Near(middle);
  const PagePoint across = is_x ? local.u_px_mm : local.v_px_mm;
  const PagePoint along = is_x ? local.v_px_mm : local.u_px_mm;
  Strip strip;
  strip.columns = static_cast<int>(2 * kAcross_mm * Length(across)) + 1;
  strip.rows = static_cast<int>(2 * kAlong_mm * Length(along)) + 1;
  strip.column_step = (1 / Length(across)) * across;
  strip.row_step = (1 / Length(along)) * along;
  strip.origin = local.at - kAcross_mm * across - kAlong_mm * along;
  const ChannelMix mean =
      page.channels == 1 ? ChannelMix{1, 0, 0} : ChannelMix{1 / 3.0F, 1 / 3.0F, 1 / 3.0F};
  std::vector<float> samples;
  if (!SampleStrip(page, mean, strip, samples)) return std::nullopt;
  const auto level = [&](double part) {
    const auto at = samples.begin() +
                    static_cast<std::ptrdiff_t>(part * static_cast<double>(samples.size() - 1));
    std::nth_element(samples.begin(), at, samples.end());
    return static_cast<double>(*at);
  };
  const double paper = level(0.85);
  const double ink = level(0.1);
  return FingerLight{paper, (paper - ink) / std::max(1.0, paper), paper >= kSaturated};
}

}  // namespace

double BlurOfBox_px(const PageView& page, const SheetPlan& plan, const SheetOnPage& sheet) {
  constexpr int kFewest = 4;
  double worst_px = 0;
  for (const Side side : {kLeft, kRight, kBottom, kTop}) {
    const SideProfile profile = ProfileOf(page, plan, sheet, side);
    if (profile.places >= kFewest) worst_px = std::max(worst_px, BlurOfSide_px(profile, plan));
  }
  return worst_px;
}

std::optional<std::string> PhotoFault(const PhotoOnPage& photo) {
  const double tilt_deg = photo.pose.tilt_rad * 180 / std::numbers::pi;
  if (photo.px_per_mm < kMinPhotoScale_px_mm) {
    return fmt::format(
        "the photo shows the sheet with {:.2f} px per mm, at least {:.0f} are needed: "
        "let the sheet fill the picture, and take it with all of the camera's pixels",
        photo.px_per_mm, kMinPhotoScale_px_mm);
  }
  const double max_blur_px = std::min(kMaxPhotoBlur_px, kMaxPhotoBlur_mm * photo.px_per_mm);
  if (photo.blur_px > max_blur_px) {
    return fmt::format(
        "the photo is blurred by {:.1f} px (1 sigma), at most {:.1f} can be read: hold the phone "
        "still, further away if it cannot focus, in more light",
        photo.blur_px, max_blur_px);
  }
  if (tilt_deg > kMaxPhotoTilt_deg) {
    return fmt::format(
        "the photo was taken {:.0f} degrees aslant, at most {:.0f} can be read: hold "
        "the phone parallel to the sheet, above its middle",
        tilt_deg, kMaxPhotoTilt_deg);
  }
  return std::nullopt;
}

std::vector<bool> GlareOver(const PageView& page, const SheetPlan& plan, const PageMap& map) {
  constexpr double kDrowned = 0.6;  // relative to the depth elsewhere
  constexpr double kBrighter = 1.02;
  constexpr int kFewest = 2;  // fingers
  std::vector<std::vector<FingerLight>> lights(plan.structures.size());
  std::vector<double> depths;
  for (std::size_t i = 0; i < plan.structures.size(); ++i) {
    const Structure& structure = plan.structures[i];
    const bool is_x = structure.axis == Axis::kX;
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      if (structure.combs[comb].tool != plan.settings.reference_tool) continue;
      for (int finger = 0; finger < plan.settings.teeth; ++finger) {
        const SheetPoint middle = OuterMiddle(plan, structure, comb, finger);
        const auto light = LightAt(page, map, middle, is_x);
        if (!light) continue;
        lights[i].push_back(*light);
        depths.push_back(light->depth);
      }
    }
  }
  std::vector<bool> glare(plan.structures.size(), false);
  if (depths.empty()) return glare;
  const double usual = Median(depths);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    std::vector<double> paper;
    for (const FingerLight& light : lights[i]) paper.push_back(light.paper);
    if (paper.empty()) continue;
    const double usual_paper = Median(paper);
    const auto drowned = std::count_if(lights[i].begin(), lights[i].end(), [&](const auto& light) {
      return light.depth < kDrowned * usual &&
             (light.saturated || light.paper > kBrighter * usual_paper);
    });
    glare[i] = drowned >= kFewest;
  }
  return glare;
}

namespace {

/// Resolutions of flatbeds and feeders of offices; network scanners, too.
constexpr std::array<double, 14> kScannersDpi{100, 150, 200, 240, 250, 300,  360,
                                              400, 480, 500, 600, 800, 1200, 2400};
constexpr double kScannersScale = 0.01;  // printer's and scanner's together

bool Near(double dpi, double other, double part) { return std::abs(dpi / other - 1) < part; }

bool IsScanners(const Resolution& shown) {
  return std::any_of(kScannersDpi.begin(), kScannersDpi.end(), [&](double dpi) {
    return Near(shown.x, dpi, kScannersScale) && Near(shown.y, dpi, kScannersScale);
  });
}

/// Returns the outward bow of the sides, mean of all four; a camera's lens bows them alike.
double Barrel_mm(const PageMap& map) {
  constexpr std::size_t kSquare = 2;
  const auto& bend = map.bend_mm;
  // The square's factor is the distance of a side's middle from the line between its ends.
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
  constexpr double kFlat = 0.003;  // perspective on a flatbed if paper is slightly raised
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
  // A camera so oblique that its axes differ shows far more perspective.
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
