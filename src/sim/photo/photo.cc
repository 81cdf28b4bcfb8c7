#include "sim/photo/photo.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "files/new_file.h"
#include "sim/camera/jpeg.h"
#include "sim/print/texture.h"

namespace trammel::sim {
namespace {

using Bgr = std::array<double, 3>;  // relative to full scale

constexpr int kSamples = 2;           // per pixel, each way
constexpr double kLargePixels = 4e6;  // from there on fewer: lens blur is wider than a pixel
constexpr double kMarginMm = 2;       // relief around the print, for shadows
constexpr double kFinestCellMm = 0.025;
constexpr double kCoarsestCellMm = 0.0375;  // a twelfth of the narrowest bead
constexpr double kCellsInPixel = 6;
constexpr double kMaxCells = 20e6;
constexpr double kBlockMm = 1;  // resolution at which bare plate is told apart quickly
constexpr double kTextureCellMm = 0.035;
constexpr double kLitCellMm = 0.05;  // a third of the narrowest slot between two walls

// Appearance of materials in even light of full strength.
struct Materials {
  Bgr plate;
  double plate_relief = 0;  // contrast that the plate's texture throws
  Bgr filament;
  double depth_mm = 0.1;  // visible depth in the filament
  double gloss = 0;
};

struct PlateLook {
  Bgr colour;
  double relief = 0;
  Bgr natural;  // translucent filament, in the light that comes back from the plate
};

PlateLook LookOf(PhotoPlate plate) {
  switch (plate) {
    case PhotoPlate::kGold:
      return {{0.24, 0.38, 0.44}, 0.36, {0.86, 0.82, 0.78}};
    case PhotoPlate::kDark:
      return {{0.15, 0.16, 0.16}, 0.45, {0.82, 0.80, 0.78}};
    case PhotoPlate::kLight:
      return {{0.72, 0.76, 0.78}, 0.05, {0.86, 0.86, 0.84}};
    case PhotoPlate::kSmoothGold:
      return {{0.30, 0.50, 0.58}, 0.06, {0.84, 0.84, 0.82}};
    case PhotoPlate::kGlass:
      return {{0.34, 0.38, 0.36}, 0.02, {0.84, 0.84, 0.82}};
    case PhotoPlate::kMagnetic:
      return {{0.08, 0.08, 0.08}, 0.15, {0.80, 0.80, 0.78}};
  }
  return {};
}

Materials MaterialsOf(const PhotoScene& scene) {
  const PlateLook look = LookOf(scene.plate);
  Materials materials{look.colour, look.relief, look.natural, 0.09, 0.35};
  switch (scene.filament) {
    case PhotoFilament::kNatural:
      break;
    case PhotoFilament::kBlack:
      materials = {look.colour, look.relief, {0.07, 0.07, 0.07}, 0.01, 0.25};
      break;
    case PhotoFilament::kWhite:
      materials = {look.colour, look.relief, {0.88, 0.89, 0.88}, 0.03, 0.3};
      break;
    case PhotoFilament::kOrange:
      materials = {look.colour, look.relief, {0.10, 0.38, 0.86}, 0.03, 0.3};
      break;
    case PhotoFilament::kBlue:
      materials = {look.colour, look.relief, {0.55, 0.24, 0.07}, 0.02, 0.3};
      break;
    case PhotoFilament::kGrey:
      materials = {look.colour, look.relief, {0.42, 0.41, 0.40}, 0.02, 0.3};
      break;
  }
  if (scene.matte) materials.gloss *= 0.1;
  return materials;
}

Vector3 Towards(double azimuth_rad) { return {std::cos(azimuth_rad), std::sin(azimuth_rad), 0}; }

// Height field of the beads on a grid aslant to the bed's axes: on one along them, all edges of a
// line would lie on whole cells, and its width jump by a twelfth.
class SlantedRelief {
 public:
  SlantedRelief() = default;
  /// @param finest_mm  side of a cell, or more for a large region
  SlantedRelief(Bed bed, const BedRegion& region, double finest_mm) {
    BedRegion turned{kInfinity, kInfinity, -kInfinity, -kInfinity};
    for (const double x : {region.min_x_mm, region.max_x_mm}) {
      for (const double y : {region.min_y_mm, region.max_y_mm}) {
        const auto [u, v] = InGrid(x, y);
        turned = {std::min(turned.min_x_mm, u), std::min(turned.min_y_mm, v),
                  std::max(turned.max_x_mm, u), std::max(turned.max_y_mm, v)};
      }
    }
    for (Strand& strand : bed.strands) {
      for (BeadSample& sample : strand.samples) {
        std::tie(sample.x_mm, sample.y_mm) = InGrid(sample.x_mm, sample.y_mm);
      }
    }
    const double area = (turned.max_x_mm - turned.min_x_mm) * (turned.max_y_mm - turned.min_y_mm);
    grid_ = RasterizeBed(bed, turned, std::max(finest_mm, std::sqrt(area / kMaxCells)));
  }

  [[nodiscard]] double HeightAt(double x_mm, double y_mm) const {
    const auto [u, v] = InGrid(x_mm, y_mm);
    return grid_.HeightAt(u, v);
  }
  [[nodiscard]] bool CoveredAt(double x_mm, double y_mm) const {
    const auto [u, v] = InGrid(x_mm, y_mm);
    return grid_.CoveredAt(u, v);
  }
  [[nodiscard]] const Relief& grid() const { return grid_; }
  [[nodiscard]] static std::pair<double, double> InGrid(double x_mm, double y_mm) {
    return {kCos * x_mm + kSin * y_mm, kCos * y_mm - kSin * x_mm};
  }
  [[nodiscard]] static std::pair<double, double> OnBed(double u_mm, double v_mm) {
    return {kCos * u_mm - kSin * v_mm, kSin * u_mm + kCos * v_mm};
  }

 private:
  // 16.26 degrees: lines along the axes cross a cell's edge every 3.4 cells, others at 45 degrees
  // every 1.8.
  static constexpr double kCos = 0.96, kSin = 0.28;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  Relief grid_;
};

class Scene {
 public:
  Scene(const Bed& bed, const BedRegion& print, const PhotoTraits& traits, Random& random)
      : traits_(traits),
        camera_(traits, print),
        materials_(MaterialsOf(traits.scene)),
        bed_x_mm_(bed.size_x_mm),
        bed_y_mm_(bed.size_y_mm),
        bumps_(SmoothNoise(1024, 2.2, random)),
        glints_(SmoothNoise(1024, 1.5, random)) {
    const BedRegion region{print.min_x_mm - kMarginMm, print.min_y_mm - kMarginMm,
                           print.max_x_mm + kMarginMm, print.max_y_mm + kMarginMm};
    const double pixel_mm = std::max((print.max_x_mm - print.min_x_mm) / traits.width_px,
                                     (print.max_y_mm - print.min_y_mm) / traits.height_px);
    relief_ = SlantedRelief(bed, region,
                            std::clamp(pixel_mm / kCellsInPixel, kFinestCellMm, kCoarsestCellMm));
    layered_ = IsLayered(bed);
    MarkBlocks();
    light_ = {std::cos(traits.light_elevation_rad) * std::cos(traits.light_azimuth_rad),
              std::cos(traits.light_elevation_rad) * std::sin(traits.light_azimuth_rad),
              std::sin(traits.light_elevation_rad)};
    uneven_ = Towards(traits.unevenness_azimuth_rad);
    shadowed_ = Towards(traits.shadow_azimuth_rad);
    if (layered_) LightRelief();
  }

  /// Returns the light that arrives along one ray, relative to full scale.
  [[nodiscard]] Bgr See(double x_px, double y_px) const {
    const Vector3 ray = camera_.Ray(x_px, y_px);
    const Vector3& optics = camera_.position();
    double x = optics.x + ray.x * optics.z;
    double y = optics.y + ray.y * optics.z;
    Bgr colour;
    if (const double shade = FingerAt(x_px, y_px); shade > 0) {
      colour = {0.42 * shade, 0.52 * shade, 0.72 * shade};
    } else if (!(x >= 0 && y >= 0 && x <= bed_x_mm_ && y <= bed_y_mm_)) {
      colour = {0.02, 0.02, 0.02};  // beyond the plate
    } else if (!Near(x, y)) {
      colour = PlateAt(x, y, x_px, y_px, 1);
    } else {
      const double z = Meet(ray, x, y);
      colour = z > 0 ? FilamentAt(x, y, z, x_px, y_px, ray)
                     : PlateAt(x, y, x_px, y_px, layered_ ? LitAt(x, y) : ShadowAt(x, y));
    }
    const double light = Illumination(x_px, y_px);
    for (double& value : colour) value *= light;
    return colour;
  }

  /// True if no filament is near where the pixel's ray meets the plate.
  [[nodiscard]] bool Bare(double x_px, double y_px) const {
    const Vector3 ray = camera_.Ray(x_px, y_px);
    const Vector3& optics = camera_.position();
    return !Near(optics.x + ray.x * optics.z, optics.y + ray.y * optics.z);
  }

 private:
  void MarkBlocks() {
    const Relief& relief = relief_.grid();
    block_columns_ = static_cast<int>(relief.columns * relief.cell_mm / kBlockMm) + 1;
    block_rows_ = static_cast<int>(relief.rows * relief.cell_mm / kBlockMm) + 1;
    blocks_.assign(static_cast<std::size_t>(block_columns_ * block_rows_), 0);
    for (int row = 0; row < relief.rows; ++row) {
      const int below = static_cast<int>(row * relief.cell_mm / kBlockMm);
      for (int column = 0; column < relief.columns; ++column) {
        if (relief.row(row)[column] <= 0) continue;
        top_mm_ = std::max(top_mm_, static_cast<double>(relief.row(row)[column]));
        const int left = static_cast<int>(column * relief.cell_mm / kBlockMm);
        for (int i = std::max(0, below - 1); i <= std::min(block_rows_ - 1, below + 1); ++i) {
          for (int k = std::max(0, left - 1); k <= std::min(block_columns_ - 1, left + 1); ++k) {
            blocks_[static_cast<std::size_t>(i * block_columns_ + k)] = 1;
          }
        }
      }
    }
  }

  // True if there is filament within a block's width.
  [[nodiscard]] bool Near(double x, double y) const {
    const auto [u, v] = relief_.InGrid(x, y);
    const double column = (u - relief_.grid().origin_x_mm) / kBlockMm;
    const double row = (v - relief_.grid().origin_y_mm) / kBlockMm;
    if (!(column >= 0 && row >= 0 && column < block_columns_ && row < block_rows_)) return false;
    return blocks_[static_cast<std::size_t>(static_cast<int>(row) * block_columns_ +
                                            static_cast<int>(column))] != 0;
  }

  // Moves (x, y) from the ray's intersection with the plate to that with the surface.
  double Meet(const Vector3& ray, double& x, double& y) const {
    // In prints of several layers the ray passes about three cells from one step to the next.
    constexpr int kMostSteps = 10;
    constexpr double kStepCells = 3;
    const double across = std::sqrt(ray.x * ray.x + ray.y * ray.y);
    const double shift = across * top_mm_ / (kStepCells * relief_.grid().cell_mm);
    const int steps =
        layered_ ? std::clamp(static_cast<int>(shift) + 1, 2, kMostSteps) : kMostSteps;
    const auto gap = [&](double z) { return z - relief_.HeightAt(x - ray.x * z, y - ray.y * z); };
    double z = top_mm_;
    double clear = gap(z);
    for (int i = steps - 1; i >= 0; --i) {
      const double next = top_mm_ * i / steps;
      const double below = gap(next);
      if (below < 0 || (i == 0 && below <= 0)) {
        z = clear > below ? next + (z - next) * -below / (clear - below) : next;
        break;
      }
      z = next;
      clear = below;
    }
    x -= ray.x * z;
    y -= ray.y * z;
    return z;
  }

  // Returns 1 in the light, less where a bead is between the lamp and a point above the plate.
  [[nodiscard]] double ShadowAt(double x, double y, double from_mm = 0) const {
    constexpr double kClearMm = 0.03;  // a surface does not hide itself
    const int steps = layered_ ? 14 : 5;
    const double lowest = from_mm > 0 ? from_mm + kClearMm : 0;
    double deepest = 0;
    for (int i = 1; i <= steps; ++i) {
      const double z = lowest + (top_mm_ - lowest) * (i - 0.5) / steps;
      const double towards_x = x + light_.x / light_.z * (z - from_mm);
      const double towards_y = y + light_.y / light_.z * (z - from_mm);
      if (!relief_.CoveredAt(towards_x, towards_y)) continue;
      deepest = std::max(deepest, relief_.HeightAt(towards_x, towards_y) - z);
    }
    return 1 - 0.5 * std::clamp(deepest / 0.08, 0.0, 1.0);
  }

  // Tabulates the light on the relief of several layers: shadows and slots need many heights.
  void LightRelief() {
    const Relief& grid = relief_.grid();
    lit_columns_ = static_cast<int>(grid.columns * grid.cell_mm / kLitCellMm) + 2;
    lit_rows_ = static_cast<int>(grid.rows * grid.cell_mm / kLitCellMm) + 2;
    lit_.assign(static_cast<std::size_t>(lit_columns_) * static_cast<std::size_t>(lit_rows_), 1.0F);
    for (int row = 0; row < lit_rows_; ++row) {
      for (int column = 0; column < lit_columns_; ++column) {
        const auto [x, y] = relief_.OnBed(grid.origin_x_mm + column * kLitCellMm,
                                          grid.origin_y_mm + row * kLitCellMm);
        if (!Near(x, y)) continue;
        const double z = relief_.HeightAt(x, y);
        if (z > top_mm_ - 0.05) continue;
        // A plate's light comes from a larger part of the sky than a slot's between two walls.
        const double ambient = z > 0 ? 0.15 : 0.4;
        lit_[static_cast<std::size_t>(row) * static_cast<std::size_t>(lit_columns_) +
             static_cast<std::size_t>(column)] =
            static_cast<float>(ShadowAt(x, y, z) * (ambient + (1 - ambient) * SkyAt(x, y, z)));
      }
    }
  }

  // Interpolates what LightRelief tabulated; 1 outside.
  [[nodiscard]] double LitAt(double x, double y) const {
    const auto [on_u, on_v] = relief_.InGrid(x, y);
    const double u = (on_u - relief_.grid().origin_x_mm) / kLitCellMm;
    const double v = (on_v - relief_.grid().origin_y_mm) / kLitCellMm;
    if (!(u >= 0 && v >= 0 && u < lit_columns_ - 1 && v < lit_rows_ - 1)) return 1;
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    const float* p = lit_.data() + static_cast<std::ptrdiff_t>(row) * lit_columns_ + column;
    const float* q = p + lit_columns_;
    const double fu = u - column;
    const double fv = v - row;
    return (1 - fv) * ((1 - fu) * static_cast<double>(p[0]) + fu * static_cast<double>(p[1])) +
           fv * ((1 - fu) * static_cast<double>(q[0]) + fu * static_cast<double>(q[1]));
  }

  // Returns the share of a cloudy sky that a point sees: deep slots between walls are dark.
  [[nodiscard]] double SkyAt(double x, double y, double z) const {
    constexpr int kDirections = 8;
    constexpr double kFarMm[] = {0.08, 0.16, 0.3, 0.6};
    static const std::array<Vector3, kDirections> towards = [] {
      std::array<Vector3, kDirections> all;
      for (int i = 0; i < kDirections; ++i) {
        all[static_cast<std::size_t>(i)] = Towards(2 * std::numbers::pi * (i + 0.5) / kDirections);
      }
      return all;
    }();
    double sum = 0;
    for (const Vector3& direction : towards) {
      double steepest = 0;
      for (const double far : kFarMm) {
        const double rise = relief_.HeightAt(x + far * direction.x, y + far * direction.y) - z;
        steepest = std::max(steepest, rise / far);
      }
      sum += 1 / (1 + steepest * steepest);
    }
    return sum / kDirections;
  }

  [[nodiscard]] Bgr PlateAt(double x, double y, double x_px, double y_px, double lit) const {
    const int column = static_cast<int>(std::floor(x / kTextureCellMm));
    const int row = static_cast<int>(std::floor(y / kTextureCellMm));
    const double fx = x / kTextureCellMm - column;
    const double fy = y / kTextureCellMm - row;
    const double here = static_cast<double>(bumps_.At(column, row));
    const double right = static_cast<double>(bumps_.At(column + 1, row));
    const double above = static_cast<double>(bumps_.At(column, row + 1));
    // Shades the relief from the lamp's side, with raised winding crests.
    const double emboss = (here - right) * light_.x + (here - above) * light_.y;
    const double level = here + fx * (right - here) + fy * (above - here);
    const double crest = 2.2 * std::exp(-3 * level * level) - 1;
    const double shade = std::max(0.1, 1 + materials_.plate_relief * (1.6 * emboss + 0.45 * crest));
    Bgr colour = materials_.plate;
    for (double& value : colour) value *= shade * lit;
    const double facet =
        std::pow(std::max(0.0, static_cast<double>(glints_.At(column, row)) - 0.2), 2);
    for (const Reflection& patch : traits_.reflections) {
      const double weight = Fade(patch, x_px, y_px);
      if (weight < 0.002) continue;
      const double amount =
          lit * weight * (patch.sheen * (0.6 + 0.5 * shade) + patch.glints * facet);
      for (std::size_t i = 0; i < 3; ++i) colour[i] += amount * patch.bgr[i];
    }
    for (std::size_t i = 0; i < 3; ++i) colour[i] += GlareAt(i, x_px, y_px);
    return colour;
  }

  [[nodiscard]] Bgr FilamentAt(double x, double y, double z, double x_px, double y_px,
                               const Vector3& ray) const {
    const double step = relief_.grid().cell_mm;
    const double slope_x =
        (relief_.HeightAt(x + step, y) - relief_.HeightAt(x - step, y)) / (2 * step);
    const double slope_y =
        (relief_.HeightAt(x, y + step) - relief_.HeightAt(x, y - step)) / (2 * step);
    const double norm = 1 / std::sqrt(1 + slope_x * slope_x + slope_y * slope_y);
    const double facing = norm * (light_.z - slope_x * light_.x - slope_y * light_.y) - light_.z;
    // Half-way vector between lamp and camera, for gloss.
    const double length = std::sqrt(1 + ray.x * ray.x + ray.y * ray.y);
    const Vector3 half{light_.x - ray.x / length, light_.y - ray.y / length, light_.z + 1 / length};
    const double half_length = std::sqrt(half.x * half.x + half.y * half.y + half.z * half.z);
    const double mirror =
        std::max(0.0, norm * (half.z - slope_x * half.x - slope_y * half.y) / half_length);
    const double gloss = materials_.gloss * std::pow(mirror, 40);

    const double height = relief_.HeightAt(x, y);
    const double cover = 1 - std::exp(-std::max(height, z) / materials_.depth_mm);
    const double lit = layered_ && z < top_mm_ - 0.05 ? LitAt(x, y) : 1;
    // Through several layers nothing of the plate is seen.
    const bool opaque = layered_ && cover > 0.999;
    const Bgr below = opaque ? Bgr{} : PlateAt(x, y, x_px, y_px, 0.8);
    const double grain =
        1 + 0.025 * static_cast<double>(glints_.At(static_cast<int>(x / kTextureCellMm),
                                                   static_cast<int>(y / kTextureCellMm)));
    Bgr colour;
    for (std::size_t i = 0; i < 3; ++i) {
      const double body = materials_.filament[i] * grain * (1 + 0.45 * facing);
      double own = body + gloss;
      for (const Reflection& patch : traits_.reflections) {
        own += 0.25 * patch.sheen * patch.bgr[i] * Fade(patch, x_px, y_px);
      }
      own += GlareAt(i, x_px, y_px);
      colour[i] = cover * own * lit + (1 - cover) * below[i];
    }
    return colour;
  }

  [[nodiscard]] double Fade(const Reflection& patch, double x_px, double y_px) const {
    const double x = (x_px - 0.5 * traits_.width_px) / traits_.height_px - patch.x;
    const double y = (y_px - 0.5 * traits_.height_px) / traits_.height_px - patch.y;
    return std::exp(-0.5 * (x * x + y * y) / (patch.radius * patch.radius));
  }

  [[nodiscard]] double GlareAt(std::size_t channel, double x_px, double y_px) const {
    const Reflection& glare = traits_.glare;
    return glare.sheen > 0 ? glare.sheen * glare.bgr[channel] * Fade(glare, x_px, y_px) : 0;
  }

  [[nodiscard]] double Illumination(double x_px, double y_px) const {
    const double x = 2 * x_px / traits_.width_px - 1;
    const double y = 2 * y_px / traits_.height_px - 1;
    const double slope = x * uneven_.x + y * uneven_.y;
    const double corner = 1 - traits_.vignetting * (x * x + y * y) / 2;
    double light = traits_.exposure * corner * std::max(0.1, 1 + 0.7 * traits_.unevenness * slope);
    if (traits_.shadow > 0) {
      const double u = (x_px - 0.5 * traits_.width_px) / traits_.height_px;
      const double v = (y_px - 0.5 * traits_.height_px) / traits_.height_px;
      const double past = u * shadowed_.x + v * shadowed_.y - traits_.shadow_offset;
      light *= 1 - traits_.shadow * std::clamp(past / traits_.shadow_softness + 0.5, 0.0, 1.0);
    }
    return light;
  }

  // Returns the brightness of the finger there, 0 without one.
  [[nodiscard]] double FingerAt(double x_px, double y_px) const {
    for (const PhotoFinger& finger : traits_.fingers) {
      const double x = (x_px - 0.5 * traits_.width_px) / traits_.height_px - finger.x;
      const double y = (y_px - 0.5 * traits_.height_px) / traits_.height_px - finger.y;
      const double c = std::cos(finger.azimuth_rad);
      const double s = std::sin(finger.azimuth_rad);
      const double along = std::clamp(x * c + y * s, 0.0, finger.length);
      const double off = std::hypot(x - along * c, y - along * s) / finger.radius;
      if (off < 1) return 1 - 0.5 * off * off;
    }
    return 0;
  }

  const PhotoTraits& traits_;
  PhotoCamera camera_;
  Materials materials_;
  double bed_x_mm_;
  double bed_y_mm_;
  Tile bumps_;
  Tile glints_;
  SlantedRelief relief_;
  double top_mm_ = 0;
  bool layered_ = false;
  int lit_columns_ = 0;
  int lit_rows_ = 0;
  std::vector<float> lit_;  // of prints of several layers
  Vector3 light_;
  Vector3 uneven_;    // towards the bright side of the picture
  Vector3 shadowed_;  // towards the dark side of the shadow's edge
  int block_columns_ = 0;
  int block_rows_ = 0;
  std::vector<std::uint8_t> blocks_;
};

// Applies lens blur, the camera's sharpening and its noise.
void Develop(const PhotoTraits& traits, Random& random, cv::Mat& light, Frame& frame) {
  if (traits.blur_sigma_px > 0) cv::GaussianBlur(light, light, {}, traits.blur_sigma_px);
  if (traits.sharpening > 0) {
    cv::Mat soft;
    cv::GaussianBlur(light, soft, {}, 1.6);
    light += traits.sharpening * (light - soft);
  }
  const Tile noise = SmoothNoise(512, 0.5, random);
  for (int y = 0; y < frame.height; ++y) {
    const auto* in = light.ptr<float>(y);
    std::uint8_t* out = frame.row(y);
    const int shift = static_cast<int>(random.Below(512));
    const int jump = static_cast<int>(random.Below(512));
    for (int x = 0; x < frame.width; ++x) {
      const auto common = static_cast<double>(noise.At(x + shift, y + jump));
      for (int i = 0; i < 3; ++i) {
        const auto own = static_cast<double>(noise.At(x + 171 * (i + 1), y + jump));
        const double value = std::clamp(static_cast<double>(in[3 * x + i]), 0.0, 1.0);
        const double sigma = traits.noise * std::sqrt(0.3 + 1.4 * value);
        out[3 * x + i] = static_cast<std::uint8_t>(
            std::clamp(255 * value + sigma * (0.8 * common + 0.5 * own), 0.0, 255.0) + 0.5);
      }
    }
  }
}

}  // namespace

Result<BedRegion> PrintedRegion(const Bed& bed) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  BedRegion region{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (const Strand& strand : bed.strands) {
    for (const BeadSample& sample : strand.samples) {
      if (sample.width_mm <= 0) continue;
      const double half = sample.width_mm / 2;
      region.min_x_mm = std::min(region.min_x_mm, sample.x_mm - half);
      region.min_y_mm = std::min(region.min_y_mm, sample.y_mm - half);
      region.max_x_mm = std::max(region.max_x_mm, sample.x_mm + half);
      region.max_y_mm = std::max(region.max_y_mm, sample.y_mm + half);
    }
  }
  if (region.min_x_mm > region.max_x_mm) {
    return Fail("there is no filament on the virtual bed; print something first");
  }
  return region;
}

Result<Frame> RenderPhoto(const Bed& bed, const PhotoTraits& traits, Random random) {
  const std::int64_t pixels = std::int64_t{traits.width_px} * traits.height_px;
  if (traits.width_px < 64 || traits.height_px < 64 || traits.width_px > 20000 ||
      traits.height_px > 20000 || pixels > 100'000'000) {
    return Fail(fmt::format(
        "a photo of {} x {} px: each side must be 64 ... 20000 and all at most 100 million",
        traits.width_px, traits.height_px));
  }
  const BedRegion print = TRY(PrintedRegion(bed));
  const Scene scene(bed, print, traits, random);
  const bool large = static_cast<double>(pixels) > kLargePixels;
  cv::Mat light(traits.height_px, traits.width_px, CV_32FC3);
  for (int y = 0; y < traits.height_px; ++y) {
    auto* out = light.ptr<float>(y);
    for (int x = 0; x < traits.width_px; ++x) {
      // All four places of a pixel in small pictures; in large ones two on a diagonal, one where
      // the plate is bare.
      const int samples = !large ? kSamples * kSamples : scene.Bare(x, y) ? 1 : 2;
      Bgr sum{};
      for (int i = 0; i < samples; ++i) {
        const int place = large ? 3 * i : i;
        const double dx = samples == 1 ? 0 : (place % kSamples + 0.5) / kSamples - 0.5;
        const double dy = samples == 1 ? 0 : (place / kSamples + 0.5) / kSamples - 0.5;
        const Bgr seen = scene.See(x + dx, y + dy);
        for (std::size_t k = 0; k < 3; ++k) sum[k] += std::min(seen[k], 1.5);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        out[3 * static_cast<std::size_t>(x) + k] = static_cast<float>(sum[k] / samples);
      }
    }
  }
  Frame frame(traits.width_px, traits.height_px);
  if (traits.mirrored) cv::flip(light, light, 1);
  Develop(traits, random, light, frame);
  return frame;
}

Result<void> WriteJpegFile(const Frame& frame, int quality, const std::filesystem::path& path) {
  std::vector<std::uint8_t> jpeg;
  EncodeJpeg(frame.view(), quality, jpeg);
  const std::string_view bytes(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
  return files::WriteWholeFile(path, bytes, files::IfThere::kRefuse);
}

}  // namespace trammel::sim
