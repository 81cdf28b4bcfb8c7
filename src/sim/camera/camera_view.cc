#include "sim/camera/camera_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "base/check.h"

namespace trammel::sim {
namespace {

constexpr double kLowestRiseMm = -24;  // the lens would soon touch the plate
constexpr double kHighestRiseMm = 60;
// An aperture of 1.3 mm (3.6 mm at f/2.8) blurs a point at distance d + rise to a disc of 1.3 mm x
// rise / d, whose standard deviation is a quarter of its width.
constexpr double kApertureMm = 1.3;
// The same for a beam of 4 mm at the laser's lens, 60 mm away.
constexpr double kLaserSpread = 1.0 / 60;
constexpr double kFinestCellMm = 0.025;
constexpr double kAheadMm = 24;  // ahead of a moving head: most of a sweep
constexpr double kAroundMm = 3;

double LensBlurMm(const LaserTraits& focused, double rise_mm) {
  return kApertureMm / 4 * std::abs(rise_mm) / focused.distance_mm;
}

// Returns a cell size at which no pixel is much smaller than a cell.
double CellFor(double px_per_mm) {
  double cell_mm = kFinestCellMm;
  while (cell_mm < 0.2 && px_per_mm * cell_mm < 0.375) cell_mm *= 2;
  return cell_mm;
}

// Returns the blur in steps of two, so that small movements in height can reuse their scene.
int BlurStep(double sigma_cells) {
  return sigma_cells < 0.5 ? 0 : 1 + static_cast<int>(std::floor(std::log2(sigma_cells / 0.5)));
}

void BlurLook(LaserScene& scene, int step) {
  if (step == 0) return;
  const double sigma_cells = 0.7 * std::exp2(step - 1);
  // Two passes of a box of width w have a variance of (w^2 - 1) / 6.
  const int width =
      1 + 2 * static_cast<int>(std::lround((std::sqrt(6 * sigma_cells * sigma_cells + 1) - 1) / 2));
  cv::Mat look(scene.relief.rows, scene.relief.columns, CV_8UC3, scene.look_bgr.data());
  for (int pass = 0; pass < 2; ++pass) cv::blur(look, look, cv::Size(width, width));
}

bool Covers(const BedRegion& outer, const BedRegion& inner) {
  return outer.Contains(inner.min_x_mm, inner.min_y_mm) &&
         outer.Contains(inner.max_x_mm, inner.max_y_mm);
}

bool SameStrand(const Strand& a, const Strand& b) {
  const auto same = [](const BeadSample& p, const BeadSample& q) {
    return p.x_mm == q.x_mm && p.y_mm == q.y_mm && p.width_mm == q.width_mm;
  };
  return a.samples.size() == b.samples.size() &&
         (a.samples.empty() ||
          (same(a.samples.front(), b.samples.front()) && same(a.samples.back(), b.samples.back())));
}

// True if beds differ near a region, for beds that only grow (or are cleared).
bool DifferWithin(const BedRegion& region, const Bed& before, const Bed& after) {
  constexpr double kReachMm = 2;  // of a bead from its centre
  if (after.strands.size() < before.strands.size()) return true;
  for (std::size_t i = 0; i < after.strands.size(); ++i) {
    const Strand& strand = after.strands[i];
    if (i < before.strands.size() && SameStrand(before.strands[i], strand)) continue;
    for (const BeadSample& sample : strand.samples) {
      if (sample.x_mm >= region.min_x_mm - kReachMm && sample.x_mm <= region.max_x_mm + kReachMm &&
          sample.y_mm >= region.min_y_mm - kReachMm && sample.y_mm <= region.max_y_mm + kReachMm) {
        return true;
      }
    }
  }
  return false;
}

// Returns the seed of the speckle, constant while the head is at rest, and different once it has
// moved by a grain.
std::uint64_t SpeckleAt(double x_mm, double y_mm) {
  constexpr double kGrainMm = 0.02;
  const auto cell = [](double mm) {
    return static_cast<std::uint64_t>(std::llround(mm / kGrainMm)) & 0xffffffffU;
  };
  return cell(x_mm) << 32 | cell(y_mm);
}

}  // namespace

HeadOptics DrawHeadOptics(const Condition& condition, const Random& random) {
  const auto draw = [&](bool ambient) {
    Random again = random;  // the same draws: only the light differs
    return DrawLaserTraits({condition.plate, condition.filament, ambient}, again);
  };
  return {condition, draw(false), draw(true)};
}

LaserTraits AtRise(const LaserTraits& focused, double rise_mm) {
  const double rise = std::clamp(rise_mm, kLowestRiseMm, kHighestRiseMm);
  const double slope = std::tan(focused.laser_angle_rad);
  LaserTraits traits = focused;
  traits.distance_mm = focused.distance_mm + rise;
  traits.px_per_mm = focused.px_per_mm * focused.distance_mm / traits.distance_mm;
  const double ratio = traits.px_per_mm / focused.px_per_mm;
  constexpr double kMiddleColumn = kSensorWidthPx / 2.0;
  constexpr double kMiddleRow = kSensorHeightPx / 2.0;
  traits.stripe_column_px = kMiddleColumn + (focused.stripe_column_px - kMiddleColumn) * ratio +
                            rise * slope * traits.px_per_mm;
  traits.line_row_px = kMiddleRow + (focused.line_row_px - kMiddleRow) * ratio;
  traits.fan_distance_mm = focused.fan_distance_mm + rise / std::cos(focused.laser_angle_rad);
  const double sharp_mm = focused.stripe_sigma_px / focused.px_per_mm;
  const double laser_mm = kLaserSpread * rise / std::cos(focused.laser_angle_rad);
  const double sigma_mm = std::hypot(sharp_mm, laser_mm, LensBlurMm(focused, rise));
  traits.stripe_sigma_px = sigma_mm * traits.px_per_mm;
  for (Sheen* sheen : {&traits.plate, &traits.filament}) {
    sheen->peak *= sharp_mm / sigma_mm;
    sheen->glow_sigma_px = std::clamp(sheen->glow_sigma_px * ratio, 4.0, 20.0);
    sheen->glow_shift_px *= ratio;
  }
  return traits;
}

bool LookAlike(const CameraMoment& a, const CameraMoment& b) {
  constexpr double kNearMm = 1e-4;  // a two-hundredth of a pixel
  const auto still = [](const CameraMoment& m) {
    return std::hypot(m.travel_x_mm, m.travel_y_mm) < kNearMm;
  };
  return a.bed == b.bed && a.machine.laser_on == b.machine.laser_on &&
         a.machine.lights_on == b.machine.lights_on && still(a) && still(b) &&
         std::hypot(a.machine.x_mm - b.machine.x_mm, a.machine.y_mm - b.machine.y_mm,
                    a.machine.z_mm - b.machine.z_mm) < kNearMm;
}

CameraView::CameraView(const HeadOptics& optics, const CameraViewOptions& options,
                       const Random& random)
    : optics_(MountOptics(optics, options.rig)),
      mount_(options.mount),
      map_(MapOf(options.rig)),
      picture_(WindowAroundCrop(options.frame_width_px, options.frame_height_px)),
      upright_(map_.identity() ? picture_ : UprightWindow(map_, picture_)),
      motion_(options.rig, random.Fork(3)),
      camera_(optics.condition, optics_.dark, upright_, random.Fork(1)),
      random_(random.Fork(2)) {
  gain_phase_rad_ = random_.Uniform(0, 2 * std::numbers::pi);
}

void CameraView::Settle(CameraMoment& moment) {
  motion_.Settle(moment.machine);
  moment.bed = motion_.Lay(moment.bed);
}

double CameraView::exposure_s() const {
  return std::max(optics_.dark.exposure_s, optics_.lit.exposure_s);
}

CameraMoment CameraView::MomentAt(const MachineSource& machine, double mid_exposure_s,
                                  double machine_time_scale) const {
  TRAMMEL_CHECK(machine_time_scale > 0, "machine_time_scale = {}", machine_time_scale);
  CameraMoment moment;
  moment.time_s = mid_exposure_s;
  moment.machine = machine.At(mid_exposure_s);
  moment.bed = machine.bed(mid_exposure_s);
  const double half_s =
      (moment.machine.lights_on ? optics_.lit : optics_.dark).exposure_s / 2 / machine_time_scale;
  const MachineView before = machine.At(mid_exposure_s - half_s);
  const MachineView after = machine.At(mid_exposure_s + half_s);
  moment.travel_x_mm = after.x_mm - before.x_mm;
  moment.travel_y_mm = after.y_mm - before.y_mm;
  return moment;
}

CameraView::Spot CameraView::LaserSpot(const MachineView& machine) const {
  return {machine.x_mm + mount_.offset_x_mm + optics_.dark.position_error_mm,
          machine.y_mm + mount_.offset_y_mm};
}

void CameraView::Focus(double rise_mm, bool lit) {
  if (rise_mm == rise_mm_ && lit == lit_) return;
  camera_.SetTraits(AtRise(lit ? optics_.lit : optics_.dark, rise_mm));
  rise_mm_ = rise_mm;
  lit_ = lit;
}

// Redraws the surroundings unless the cached ones are still valid.
void CameraView::KeepScene(const CameraMoment& moment, const Spot& spot, double rise_mm) {
  const LaserTraits traits = AtRise(optics_.dark, rise_mm);
  Look look;
  look.bed = moment.bed;
  look.lit = moment.machine.lights_on;
  look.cell_mm = CellFor(traits.px_per_mm);
  look.blur_step = BlurStep(LensBlurMm(optics_.dark, rise_mm) / look.cell_mm);
  look.region = camera_.RegionInView(spot.x_mm, spot.y_mm);
  const bool holds = scene_ && look.lit == look_.lit && look.cell_mm == look_.cell_mm &&
                     look.blur_step == look_.blur_step && Covers(look_.region, look.region) &&
                     (look.bed == look_.bed || !DifferWithin(look_.region, *look_.bed, *look.bed));
  if (holds) {
    look_.bed = look.bed;
    return;
  }
  const double dx = moment.travel_x_mm;
  const double dy = moment.travel_y_mm;
  const bool along_x = std::abs(dx) >= std::abs(dy);
  const auto reach = [&](double travel, bool main) {
    return main && travel > 0 ? kAheadMm : kAroundMm;
  };
  look.region.min_x_mm -= reach(-dx, along_x);
  look.region.max_x_mm += reach(dx, along_x);
  look.region.min_y_mm -= reach(-dy, !along_x);
  look.region.max_y_mm += reach(dy, !along_x);
  const BedRegion plate{0, 0, look.bed->size_x_mm, look.bed->size_y_mm};
  scene_ = camera_.MakeScene(*look.bed, look.region, look.cell_mm, plate);
  BlurLook(*scene_, look.blur_step);
  look_ = look;
}

void CameraView::Render(const CameraMoment& moment, Frame& frame) {
  TRAMMEL_CHECK(moment.bed != nullptr, "no bed at {} s", moment.time_s);
  const double rise_mm =
      std::clamp(moment.machine.z_mm - mount_.focus_height_mm, kLowestRiseMm, kHighestRiseMm);
  const bool lit = moment.machine.lights_on;
  Focus(rise_mm, lit);
  Spot spot = LaserSpot(moment.machine);
  spot.x_mm += rise_mm * std::tan(optics_.dark.laser_angle_rad);
  KeepScene(moment, spot, rise_mm);
  const LaserTraits& traits = lit ? optics_.lit : optics_.dark;
  const double gain =
      1 + traits.gain_drift * std::sin(gain_phase_rad_ +
                                       2 * std::numbers::pi * moment.time_s / traits.gain_period_s);
  camera_.Render(*scene_,
                 {spot.x_mm, spot.y_mm, moment.travel_x_mm, moment.travel_y_mm, gain,
                  moment.machine.laser_on, SpeckleAt(spot.x_mm, spot.y_mm)},
                 random_, map_.identity() ? frame : drawn_);
  if (!map_.identity()) TurnPicture(map_, upright_, drawn_, picture_, frame);
}

}  // namespace trammel::sim
