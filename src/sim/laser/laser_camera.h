// Renders what the laser eye sees of a bed, from the geometry of sheet, surface and camera.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/random.h"
#include "sim/laser/laser_traits.h"
#include "sim/print/bed.h"
#include "sim/print/surface.h"
#include "sim/print/texture.h"

namespace trammel::sim {

/// The part of the sensor that is read out.
struct SensorWindow {
  int x = 0;
  int y = 0;
  int width = kSensorWidthPx;
  int height = kSensorHeightPx;
};

/// A window of the given size around the centre of the paper's crop, kept on the sensor.
/// REQUIRES 64 … 1280 by 64 … 720.
[[nodiscard]] SensorWindow WindowAroundCrop(int width, int height);

/// A piece of the bed as the laser eye passes over it, for example one printed line and its
/// surroundings. Coordinates: x along image +x, y against image +y (up in the image), z above the
/// plate.
struct LaserScene {
  Relief relief;
  std::vector<std::uint8_t> look_bgr;  ///< without laser; same grid as the relief, 3 bytes a node
  double line_y_mm = 0;                ///< centre of the printed line, where there is one
  double level_x_mm = 0;               ///< where a sloping plate has its nominal height
  std::optional<BedRegion> plate;      ///< beyond it is nothing that light falls on
};

/// What the eye does while one frame is exposed.
struct Exposure {
  double laser_x_mm = 0;   ///< where the laser meets the plate, at mid-exposure,
  double laser_y_mm = 0;   ///< in the row where the traits have the printed line
  double travel_x_mm = 0;  ///< how far the eye moves during the exposure
  double travel_y_mm = 0;
  double gain = 1;  ///< multiplies all light
  bool laser_on = true;
  /// Names the speckle: it is the same again at the same place. Absent: drawn anew.
  std::optional<std::uint64_t> speckle = {};
};

/// Not safe for use from several threads at once: it keeps its buffers.
class LaserCamera {
 public:
  /// @param random  Draws the textures of plate and filament and the speckle.
  LaserCamera(const Condition& condition, const LaserTraits& traits, const SensorWindow& window,
              Random random);

  /// Gives the eye another geometry, brightness or sharpness; the surfaces and their speckle stay.
  /// Scenes made before keep the look of the light they were made in. Cost: 0.1 ms.
  void SetTraits(const LaserTraits& traits);

  /// Part of the bed that a frame shows while the laser meets the plate at (laser_x, laser_y), with
  /// what beside it throws shadow into it.
  [[nodiscard]] BedRegion RegionInView(double laser_x_mm, double laser_y_mm) const;

  /// Prepares one part of the bed. REQUIRES cell_mm a power of two times 0.0125, at most 0.2.
  /// Cost: about 15 ns a cell.
  [[nodiscard]] LaserScene MakeScene(const Bed& bed, const BedRegion& region, double cell_mm,
                                     const std::optional<BedRegion>& plate) const;

  /// Prepares a sweep during which the laser stands at x = from_mm … to_mm on the plate.
  [[nodiscard]] LaserScene MakeScene(const Bed& bed, double line_y_mm, double from_mm,
                                     double to_mm) const;

  /// Renders one frame of the size of the window.
  /// @param laser_mm   where the laser meets the plate, in the line's row, at mid-exposure.
  /// @param travel_mm  how far the eye moves during the exposure.
  /// @param gain       multiplies all light.
  /// Accuracy: without noise, speckle and texture the line's centre lies within 0.05 px of the
  /// geometry. Cost: under 1 ms at 160 x 120.
  void Render(const LaserScene& scene, double laser_mm, double travel_mm, double gain,
              Random& random, Frame& frame);
  /// The same for any movement. Where the scene does not reach, its border goes on.
  void Render(const LaserScene& scene, const Exposure& exposure, Random& random, Frame& frame);

 private:
  static constexpr int kGlowCell = 4;       // px; light below a surface is smooth
  static constexpr double kBareMm = 0.004;  // what is lower is plate

  struct View {              // one position of the eye
    double laser_x_mm = 0;   // on the plate in the line's row
    double laser_y_mm = 0;   // the line's row
    double camera_x_mm = 0;  // foot of the optical axis
    double camera_y_mm = 0;
    double centre_column_px = 0;  // of the optical axis, in the window
    double centre_row_px = 0;
  };
  struct Column;

  void DrawLook(LaserScene& scene) const;
  void CastSheet(const LaserScene& scene, const View& view, double weight);
  void Splat(double column_px, double row_px, double weight, bool on_filament);
  void SpreadGlow();
  void GatherLook(const LaserScene& scene, const View& view, const Exposure& exposure,
                  Frame& frame);
  void AddNoise(double gain, Random& random, Frame& frame) const;
  [[nodiscard]] std::vector<Column> ColumnsOfBand(const Relief& relief, const View& view) const;
  void AddLaser(const LaserScene& scene, const View& view, const Exposure& exposure, Random& random,
                Frame& frame);

  LaserTraits traits_;
  SensorWindow window_;
  Texture plate_texture_;
  Texture filament_texture_;
  Tile plate_speckle_;  // factors with mean 1
  Tile filament_speckle_;
  std::vector<std::int8_t> noise_;   // standard normal times 32
  std::vector<std::uint8_t> noisy_;  // per level and noise & 255: what comes of them
  std::vector<float> profile_;       // of the line, for each sub-pixel phase
  int profile_radius_ = 0;
  int band_begin_ = 0;  // columns of the window that laser light can reach
  int band_end_ = 0;
  std::vector<float> core_;  // (window rows, band columns): the line itself
  // (rows / 4, columns / 4) of the band: light that enters each material, then what spreads.
  std::vector<float> plate_glow_;
  std::vector<float> filament_glow_;
  std::vector<float> scratch_;
  std::vector<std::uint16_t> smear_;  // a row of the look, summed over places of the eye
};

}  // namespace trammel::sim
