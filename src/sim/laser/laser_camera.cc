#include "sim/laser/laser_camera.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/check.h"

namespace trammel::sim {
namespace {

constexpr int kPhases = 64;       // sub-pixel positions of the line's profile
constexpr int kRaysPerRow = 4;    // of the laser fan, per image row
constexpr int kBandReachPx = 72;  // columns on either side of the line that its light can reach
constexpr double kReliefCellMm = 0.0125;  // half a row: a bead's edge is not to lock to it
constexpr double kSlopeReachMm = 0.025;
constexpr double kMarginMm = 0.8;      // beyond the image, for what throws shadow into it
constexpr double kMatchStepMm = 0.02;  // step along a ray

Tile SpeckleFactors(const Tile& normal, double contrast) {
  Tile tile = normal;
  for (float& value : tile.value) {
    value = static_cast<float>(
        std::exp(contrast * static_cast<double>(value) - contrast * contrast / 2));
  }
  return tile;
}

// Returns four weights of the cubic B-spline: the lens's blur across rows.
std::array<double, 4> RowWeights(double t) {
  const double s = 1 - t;
  return {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6,
          t * t * t / 6};
}

}  // namespace

SensorWindow WindowAroundCrop(int width, int height) {
  TRAMMEL_CHECK(width >= 64 && width <= kSensorWidthPx && height >= 64 && height <= kSensorHeightPx,
                "window of {} x {} px", width, height);
  constexpr int kCropCentreX = 859;
  constexpr int kCropCentreY = 371;
  return {std::clamp(kCropCentreX - width / 2, 0, kSensorWidthPx - width),
          std::clamp(kCropCentreY - height / 2, 0, kSensorHeightPx - height), width, height};
}

LaserCamera::LaserCamera(const Condition& condition, const LaserTraits& traits,
                         const SensorWindow& window, Random random)
    : window_(window) {
  plate_texture_ = traits.textured ? MakePlateTexture(condition.plate, random) : MakePlainTexture();
  filament_texture_ = traits.textured ? MakeFilamentTexture(random) : MakePlainTexture();
  const Tile speckle = SmoothNoise(256, 0.9, random);
  plate_speckle_ = SpeckleFactors(speckle, traits.plate.speckle);
  filament_speckle_ = SpeckleFactors(speckle, traits.filament.speckle);

  // Neighbouring pixels share noise, as after a colour filter's interpolation.
  const Tile grain = SmoothNoise(256, 0.5, random);
  for (const float value : grain.value) {
    noise_.push_back(static_cast<std::int8_t>(
        std::clamp(std::lround(32 * static_cast<double>(value)), -127L, 127L)));
  }
  SetTraits(traits);
}

void LaserCamera::SetTraits(const LaserTraits& traits) {
  traits_ = traits;
  noisy_.clear();
  for (int level = 0; level < 256; ++level) {
    const double sigma =
        std::sqrt(traits.noise_floor * traits.noise_floor + traits.noise_shot * level);
    const int strength = static_cast<int>(std::lround(8 * sigma));  // sigma times 256 / 32
    for (int i = 0; i < 256; ++i) {
      const int noise = i < 128 ? i : i - 256;
      noisy_.push_back(
          static_cast<std::uint8_t>(std::clamp(level + ((noise * strength + 128) >> 8), 0, 255)));
    }
  }

  profile_.clear();
  const double sigma_px = traits.stripe_sigma_px;
  profile_radius_ = static_cast<int>(std::ceil(4 * sigma_px)) + 1;
  for (int phase = 0; phase < kPhases; ++phase) {
    for (int i = -profile_radius_; i <= profile_radius_; ++i) {
      const double off = (i - static_cast<double>(phase) / kPhases) / sigma_px;
      profile_.push_back(static_cast<float>(std::exp(-0.5 * off * off)));
    }
  }

  const int stripe = static_cast<int>(std::lround(traits.stripe_column_px)) - window_.x;
  const int sway = static_cast<int>(std::ceil(std::abs(traits.stripe_tilt_rad) * window_.height));
  const int reach = std::max(kBandReachPx, profile_radius_) + sway;
  band_begin_ = std::clamp(stripe - reach, 0, window_.width);
  band_end_ = std::clamp(stripe + reach, band_begin_, window_.width);
}

BedRegion LaserCamera::RegionInView(double laser_x_mm, double laser_y_mm) const {
  const double scale = traits_.px_per_mm;
  const auto x_at = [&](double column) {
    return laser_x_mm + (column + window_.x - traits_.stripe_column_px) / scale;
  };
  const auto y_at = [&](double row) {
    return laser_y_mm - (row + window_.y - traits_.line_row_px) / scale;
  };
  return {x_at(0) - kMarginMm, y_at(window_.height) - kMarginMm, x_at(window_.width) + kMarginMm,
          y_at(0) + kMarginMm};
}

LaserScene LaserCamera::MakeScene(const Bed& bed, const BedRegion& region, double cell_mm,
                                  const std::optional<BedRegion>& plate) const {
  LaserScene scene;
  scene.plate = plate;
  if (plate) scene.level_x_mm = (plate->min_x_mm + plate->max_x_mm) / 2;
  scene.relief = RasterizeBed(bed, region, cell_mm);
  DrawLook(scene);
  return scene;
}

LaserScene LaserCamera::MakeScene(const Bed& bed, double line_y_mm, double from_mm,
                                  double to_mm) const {
  const BedRegion first = RegionInView(std::min(from_mm, to_mm), line_y_mm);
  const BedRegion last = RegionInView(std::max(from_mm, to_mm), line_y_mm);
  LaserScene scene = MakeScene(bed, {first.min_x_mm, first.min_y_mm, last.max_x_mm, last.max_y_mm},
                               kReliefCellMm, std::nullopt);
  scene.line_y_mm = line_y_mm;
  scene.level_x_mm = scene.relief.origin_x_mm;
  return scene;
}

// Adds a line profile of height `weight`, spread over four rows, to the core, and the light that
// enters the surface to its glow.
void LaserCamera::Splat(double column_px, double row_px, double weight, bool on_filament) {
  const int band = band_end_ - band_begin_;
  const int rows = window_.height;
  const double phase_px = std::round(column_px * kPhases) / kPhases;
  const int column = static_cast<int>(std::floor(phase_px));
  const int phase = static_cast<int>(std::lround((phase_px - column) * kPhases));
  const int taps = 2 * profile_radius_ + 1;
  const float* profile = profile_.data() + static_cast<std::ptrdiff_t>(phase) * taps;
  const int first = column - profile_radius_ - band_begin_;
  const int begin = std::max(0, -first);
  const int end = std::min(taps, band - first);
  const int top = static_cast<int>(std::floor(row_px)) - 1;
  const std::array<double, 4> share = RowWeights(row_px - std::floor(row_px));
  const double peak = on_filament ? traits_.filament.peak : traits_.plate.peak;
  for (int i = 0; i < 4; ++i) {
    const int row = top + i;
    if (row < 0 || row >= rows) continue;
    const auto amount = static_cast<float>(peak * weight * share[static_cast<std::size_t>(i)]);
    float* out = core_.data() + static_cast<std::ptrdiff_t>(row) * band + first;
    for (int tap = begin; tap < end; ++tap) out[tap] += amount * profile[tap];
  }
  const int glow_columns = band / kGlowCell + 1;
  const double x = (column_px - band_begin_) / kGlowCell;
  const int glow_row = static_cast<int>(std::floor(row_px)) / kGlowCell;
  const int left = static_cast<int>(std::floor(x));
  if (row_px < 0 || row_px >= rows || left < 0 || left + 1 >= glow_columns) return;
  float* glow =
      (on_filament ? filament_glow_ : plate_glow_).data() + glow_row * glow_columns + left;
  glow[0] += static_cast<float>(weight * (1 - (x - left)));
  glow[1] += static_cast<float>(weight * (x - left));
}

// Traces the fan's rays from the slit to the first surface that each one hits.
void LaserCamera::CastSheet(const LaserScene& scene, const View& view, double weight) {
  const Relief& relief = scene.relief;
  const double focal_px = traits_.px_per_mm * traits_.distance_mm;
  const double slope = std::tan(traits_.laser_angle_rad);
  const double slit_z = traits_.fan_distance_mm * std::cos(traits_.laser_angle_rad);
  const double slit_y = view.laser_y_mm + traits_.fan_offset_mm;
  const double tilt = std::tan(traits_.stripe_tilt_rad);
  const double step_mm = 1 / (traits_.px_per_mm * kRaysPerRow);
  const double top_y = view.camera_y_mm + (view.centre_row_px + 8) / traits_.px_per_mm;
  const int rays = (window_.height + 16) * kRaysPerRow;
  for (int ray = 0; ray < rays; ++ray) {
    const double foot_y = top_y - ray * step_mm;
    const double foot_x = view.laser_x_mm - tilt * (foot_y - view.laser_y_mm);
    const double lean = (slit_y - foot_y) / slit_z;
    const auto gap = [&](double z) {  // above the surface
      return z - relief.HeightAt(foot_x - slope * z, foot_y + lean * z);
    };
    const double top = relief.TopBetween(foot_y - 0.15, foot_y + 0.15);
    double z = 0;
    if (top > 0) {
      z = top + kMatchStepMm;
      double clear = gap(z);
      while (z > 0) {
        const double next = std::max(0.0, z - kMatchStepMm);
        const double gap_next = gap(next);
        if (gap_next <= 0) {
          z = clear > gap_next ? next + (z - next) * -gap_next / (clear - gap_next) : next;
          break;
        }
        z = next;
        clear = gap_next;
      }
    }
    const bool on_filament = z > kBareMm;
    double x = foot_x - slope * z;
    double y = foot_y + lean * z;
    if (scene.plate && !scene.plate->Contains(x, y)) continue;
    const Texture& texture = on_filament ? filament_texture_ : plate_texture_;
    const double bump =
        static_cast<double>(texture.bump_mm.At(static_cast<int>(std::floor(x / texture.cell_mm)),
                                               static_cast<int>(std::floor(y / texture.cell_mm))));
    const double rise = bump + traits_.plate_slope * (x - scene.level_x_mm);
    double facing = 1;  // of the surface towards the camera
    if (on_filament) {
      const double dzdy =
          (relief.HeightAt(x, y + kSlopeReachMm) - relief.HeightAt(x, y - kSlopeReachMm)) /
          (2 * kSlopeReachMm);
      facing = 1 / std::sqrt(1 + dzdy * dzdy);
    }
    z += rise;
    x -= slope * rise;
    y += lean * rise;
    const double scale = focal_px / (traits_.distance_mm - z);
    Splat(view.centre_column_px + (x - view.camera_x_mm) * scale,
          view.centre_row_px - (y - view.camera_y_mm) * scale, weight * facing / kRaysPerRow,
          on_filament);
  }
}

// Converts the light that entered each material to the light emitted around that point.
void LaserCamera::SpreadGlow() {
  const int columns = (band_end_ - band_begin_) / kGlowCell + 1;
  const int rows = window_.height / kGlowCell + 1;
  for (auto [glow, sheen] :
       {std::pair{&plate_glow_, &traits_.plate}, std::pair{&filament_glow_, &traits_.filament}}) {
    const double sigma = sheen->glow_sigma_px / kGlowCell;
    const std::vector<float> kernel = GaussianKernel(sigma);
    const int radius = static_cast<int>(kernel.size() / 2);
    // A long straight line, kGlowCell of weight per cell, must glow with sheen->glow.
    const auto gain = static_cast<float>(sheen->glow * std::sqrt(2 * M_PI) * sigma / kGlowCell);
    std::fill(scratch_.begin(), scratch_.end(), 0.0F);
    for (int row = 0; row < rows; ++row) {
      float* out = scratch_.data() + static_cast<std::ptrdiff_t>(row) * columns;
      for (int i = -radius; i <= radius; ++i) {  // the line goes on beyond the image
        const int from = std::clamp(row + i, 0, rows - 2);
        const float tap = kernel[static_cast<std::size_t>(i + radius)];
        const float* in = glow->data() + static_cast<std::ptrdiff_t>(from) * columns;
        for (int column = 0; column < columns; ++column) out[column] += tap * in[column];
      }
    }
    for (int row = 0; row < rows; ++row) {
      const float* in = scratch_.data() + static_cast<std::ptrdiff_t>(row) * columns;
      float* out = glow->data() + static_cast<std::ptrdiff_t>(row) * columns;
      for (int column = 0; column < columns; ++column) {
        float sum = 0;
        const int lo = std::max(-radius, -column);
        const int hi = std::min(radius, columns - 1 - column);
        for (int i = lo; i <= hi; ++i) {
          sum += kernel[static_cast<std::size_t>(i + radius)] * in[column + i];
        }
        out[column] = gain * sum;
      }
    }
  }
}

void LaserCamera::Render(const LaserScene& scene, double laser_mm, double travel_mm, double gain,
                         Random& random, Frame& frame) {
  Render(scene, Exposure{laser_mm, scene.line_y_mm, travel_mm, 0, gain, true}, random, frame);
}

void LaserCamera::Render(const LaserScene& scene, const Exposure& exposure, Random& random,
                         Frame& frame) {
  if (frame.width != window_.width || frame.height != window_.height) {
    frame = Frame(window_.width, window_.height);
  }
  View view;
  view.centre_column_px = kSensorWidthPx / 2.0 - window_.x;
  view.centre_row_px = kSensorHeightPx / 2.0 - window_.y;
  const auto place = [&](double share) {  // share of travel, from its middle
    const double scale = traits_.px_per_mm;
    view.laser_x_mm = exposure.laser_x_mm + share * exposure.travel_x_mm;
    view.laser_y_mm = exposure.laser_y_mm + share * exposure.travel_y_mm;
    view.camera_x_mm = view.laser_x_mm - (traits_.stripe_column_px - kSensorWidthPx / 2.0) / scale;
    view.camera_y_mm = view.laser_y_mm + (traits_.line_row_px - kSensorHeightPx / 2.0) / scale;
  };
  const int band = band_end_ - band_begin_;
  const bool laser = exposure.laser_on && band > 0;
  if (laser) {
    const auto glow_cells =
        static_cast<std::size_t>((band / kGlowCell + 1) * (window_.height / kGlowCell + 1));
    core_.assign(static_cast<std::size_t>(band) * static_cast<std::size_t>(window_.height), 0.0F);
    plate_glow_.assign(glow_cells, 0.0F);
    filament_glow_.assign(glow_cells, 0.0F);
    scratch_.resize(glow_cells);
    // The line is static in the image while the surface moves through it.
    const double travel_mm = std::hypot(exposure.travel_x_mm, exposure.travel_y_mm);
    const int places =
        travel_mm > 0.01 ? std::clamp(static_cast<int>(std::ceil(travel_mm / 0.06)), 3, 12) : 1;
    for (int i = 0; i < places; ++i) {
      place((i + 0.5) / places - 0.5);
      CastSheet(scene, view, 1.0 / places);
    }
    SpreadGlow();
  }
  place(0);
  GatherLook(scene, view, exposure, frame);
  AddNoise(exposure.gain, random, frame);
  if (laser) AddLaser(scene, view, exposure, random, frame);
}

}  // namespace trammel::sim
