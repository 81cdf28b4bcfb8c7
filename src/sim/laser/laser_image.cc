// Laser camera's picture: the surfaces' appearance, with the laser's light on top.
#include <algorithm>
#include <array>
#include <cmath>

#include "sim/laser/laser_camera.h"

namespace trammel::sim {
namespace {

constexpr int kNoiseCount = 1 << 16;
constexpr double kSmearMm = 0.2;  // motion during an exposure above which the texture is blurred
constexpr int kSmearPlaces = 6;
constexpr float kVeil = 0.15F;  // share of one material's glow that is seen over the other

std::uint8_t ToByte(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0) + 0.5);
}

std::uint8_t Raised(std::uint8_t level, float by) {
  return static_cast<std::uint8_t>(std::min(static_cast<float>(level) + by, 255.0F) + 0.5F);
}

}  // namespace

void LaserCamera::DrawLook(LaserScene& scene) const {
  const Relief& relief = scene.relief;
  scene.look_bgr.resize(relief.height_mm.size() * 3);
  const int column0 = static_cast<int>(std::floor(relief.origin_x_mm / relief.cell_mm));
  const int row0 = static_cast<int>(std::floor(relief.origin_y_mm / relief.cell_mm));
  // The node spacing and the texture's cell size are multiples of each other.
  const double stride = relief.cell_mm / plate_texture_.cell_mm;
  const auto texel = [&](int node) { return static_cast<int>(std::floor(node * stride)); };
  const auto beyond = [&](int column, int row) {
    return scene.plate && !scene.plate->Contains((column + column0) * relief.cell_mm,
                                                 (row + row0) * relief.cell_mm);
  };
  std::uint8_t* out = scene.look_bgr.data();
  for (int row = 0; row < relief.rows; ++row) {
    const float* heights = relief.row(row);
    const float* above = relief.row(std::min(row + 1, relief.rows - 1));
    const int texture_row = texel(row + row0);
    for (int column = 0; column < relief.columns; ++column, out += 3) {
      const auto height = static_cast<double>(heights[column]);
      const bool bare = height <= kBareMm;
      if (beyond(column, row)) {
        std::fill(out, out + 3, std::uint8_t{0});
        continue;
      }
      double shade = 1;
      if (!bare) {  // room light comes from above and a little from behind
        const double slope = (static_cast<double>(above[column]) - height) / relief.cell_mm;
        shade = (0.9 - 0.25 * slope) / std::sqrt(1 + slope * slope) + 0.1;
      }
      const Texture& texture = bare ? plate_texture_ : filament_texture_;
      const Sheen& sheen = bare ? traits_.plate : traits_.filament;
      shade *= static_cast<double>(texture.ambient.At(texel(column + column0), texture_row));
      for (std::size_t i = 0; i < 3; ++i) out[i] = ToByte(shade * sheen.ambient_bgr[i]);
    }
  }
}

// Copies the surfaces' appearance into the frame. The motion blur of an ordinary sweep is finer
// than the plate's own texture; faster movement is summed over several positions of the camera.
void LaserCamera::GatherLook(const LaserScene& scene, const View& view, const Exposure& exposure,
                             Frame& frame) {
  const Relief& relief = scene.relief;
  const double cells_per_px = 1 / (traits_.px_per_mm * relief.cell_mm);
  const double x0 = (view.camera_x_mm - relief.origin_x_mm) / relief.cell_mm -
                    view.centre_column_px * cells_per_px;
  const double y0 =
      (view.camera_y_mm - relief.origin_y_mm) / relief.cell_mm + view.centre_row_px * cells_per_px;
  const auto step = static_cast<std::int64_t>(std::lround(cells_per_px * 65536));
  const std::int64_t last = relief.columns - 1;
  const double travel_mm = std::hypot(exposure.travel_x_mm, exposure.travel_y_mm);
  const int places = travel_mm > kSmearMm ? kSmearPlaces : 1;
  for (int v = 0; v < frame.height; ++v) {
    std::uint8_t* out = frame.row(v);
    smear_.assign(places > 1 ? 3 * static_cast<std::size_t>(frame.width) : 0, 0);
    for (int place = 0; place < places; ++place) {
      const double share = ((place + 0.5) / places - 0.5) / relief.cell_mm;
      const int row = std::clamp(
          static_cast<int>(std::lround(y0 - v * cells_per_px + share * exposure.travel_y_mm)), 0,
          relief.rows - 1);
      const std::uint8_t* look =
          scene.look_bgr.data() + static_cast<std::ptrdiff_t>(row) * relief.columns * 3;
      std::int64_t at = std::lround(std::max(0.0, x0 + share * exposure.travel_x_mm) * 65536);
      for (int u = 0; u < frame.width; ++u, at += step) {
        const std::uint8_t* in = look + 3 * std::min(at >> 16, last);
        if (places == 1) {
          std::copy(in, in + 3, out + std::ptrdiff_t{3} * u);
          continue;
        }
        std::uint16_t* sum = smear_.data() + std::ptrdiff_t{3} * u;
        for (int i = 0; i < 3; ++i) sum[i] = static_cast<std::uint16_t>(sum[i] + in[i]);
      }
    }
    for (std::size_t i = 0; i < smear_.size(); ++i) {
      out[i] = static_cast<std::uint8_t>((smear_[i] + places / 2) / places);
    }
  }
}

void LaserCamera::AddNoise(double gain, Random& random, Frame& frame) const {
  // One look-up per value: the result of each level under each noise.
  std::vector<std::uint8_t> noisy(noisy_.size());
  for (int level = 0; level < 256; ++level) {
    const std::uint8_t* from = noisy_.data() + std::ptrdiff_t{256} * ToByte(level * gain);
    std::copy_n(from, 256, noisy.data() + std::ptrdiff_t{256} * level);
  }
  for (int v = 0; v < frame.height; ++v) {
    std::uint8_t* out = frame.row(v);
    const std::int8_t* noise = noise_.data() + (random.Bits() & (kNoiseCount / 2 - 1));
    for (int i = 0; i < 3 * frame.width; ++i) out[i] = noisy[(out[i] << 8) | (noise[i] & 255)];
  }
}

// Data of each column of the band for AddLaser, the same in all rows of a frame.
struct LaserCamera::Column {
  int relief = 0;
  int texture = 0;
  int plate_glow = 0;  // left of the two glow cells between which the column lies
  int filament_glow = 0;
  float plate_share = 0;  // weight of the right one
  float filament_share = 0;
};

std::vector<LaserCamera::Column> LaserCamera::ColumnsOfBand(const Relief& relief,
                                                            const View& view) const {
  const int cells = (band_end_ - band_begin_) / kGlowCell + 1;
  std::vector<Column> columns;
  for (int u = band_begin_; u < band_end_; ++u) {
    const double x_mm = view.camera_x_mm + (u - view.centre_column_px) / traits_.px_per_mm;
    Column column;
    column.relief =
        std::clamp(static_cast<int>(std::lround((x_mm - relief.origin_x_mm) / relief.cell_mm)), 0,
                   relief.columns - 1);
    column.texture = static_cast<int>(std::floor(x_mm / plate_texture_.cell_mm));
    const auto place = [&](double shift_px, int& left, float& share) {
      const double at = std::clamp((u - band_begin_ - shift_px) / kGlowCell, 0.0, cells - 1.001);
      left = static_cast<int>(at);
      share = static_cast<float>(at - left);
    };
    place(traits_.plate.glow_shift_px, column.plate_glow, column.plate_share);
    place(traits_.filament.glow_shift_px, column.filament_glow, column.filament_share);
    columns.push_back(column);
  }
  return columns;
}

void LaserCamera::AddLaser(const LaserScene& scene, const View& view, const Exposure& exposure,
                           Random& random, Frame& frame) {
  const Relief& relief = scene.relief;
  const int band = band_end_ - band_begin_;
  const int cells = band / kGlowCell + 1;
  const auto speckle_at = static_cast<int>(
      exposure.speckle ? Random(*exposure.speckle).Below(1 << 16) : random.Below(1 << 16));
  const int speckle_x = (speckle_at & 255) + band_begin_;
  const int speckle_y = speckle_at >> 8;
  const std::vector<Column> columns = ColumnsOfBand(relief, view);
  scratch_.resize(std::max(scratch_.size(), 2 * static_cast<std::size_t>(cells)));
  float* plate_row = scratch_.data();
  float* filament_row = plate_row + cells;
  for (int v = 0; v < frame.height; ++v) {
    const double glow_y =
        std::clamp((v - 1.5) / kGlowCell, 0.0, window_.height / kGlowCell - 0.001);
    const int above = static_cast<int>(glow_y) * cells;
    const auto share = static_cast<float>(glow_y - std::floor(glow_y));
    for (int i = 0; i < cells; ++i) {
      const float* plate = plate_glow_.data() + above + i;
      const float* filament = filament_glow_.data() + above + i;
      plate_row[i] = plate[0] + share * (plate[cells] - plate[0]);
      filament_row[i] = filament[0] + share * (filament[cells] - filament[0]);
    }
    const double y_mm = view.camera_y_mm + (view.centre_row_px - v) / traits_.px_per_mm;
    const int texture_y = static_cast<int>(std::floor(y_mm / plate_texture_.cell_mm));
    const float* heights = relief.row(
        std::clamp(static_cast<int>(std::lround((y_mm - relief.origin_y_mm) / relief.cell_mm)), 0,
                   relief.rows - 1));
    const float* core = core_.data() + static_cast<std::ptrdiff_t>(v) * band;
    std::uint8_t* out = frame.row(v) + std::ptrdiff_t{3} * band_begin_;
    for (int i = 0; i < band; ++i, out += 3) {
      const Column& column = columns[static_cast<std::size_t>(i)];
      const bool bare = heights[column.relief] <= static_cast<float>(kBareMm);
      const float* p = plate_row + column.plate_glow;
      const float* q = filament_row + column.filament_glow;
      // Light that spreads in one material is visible through it, and hardly through the other.
      float light = (bare ? 1.0F : kVeil) * (p[0] + column.plate_share * (p[1] - p[0])) +
                    (bare ? kVeil : 1.0F) * (q[0] + column.filament_share * (q[1] - q[0]));
      if (core[i] > 0.002F) {
        light += core[i] *
                 (bare ? plate_speckle_ : filament_speckle_).At(i + speckle_x, v + speckle_y) *
                 (bare ? plate_texture_ : filament_texture_).laser.At(column.texture, texture_y);
      }
      light *= static_cast<float>(exposure.gain);
      if (light < 0.002F) continue;
      // The red filter leaks into green and blue only where red approaches full scale: measured on
      // a real frame, green = 0.85 (red - 0.47), blue a little less, red clipped at 1.
      const float pink = 255 * 0.85F * std::max(0.0F, light - 0.47F);
      out[0] = Raised(out[0], 0.93F * pink);
      out[1] = Raised(out[1], pink);
      out[2] = Raised(out[2], 255 * light);
    }
  }
}

}  // namespace trammel::sim
