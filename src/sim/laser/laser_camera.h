// Renders the laser reader's view of a bed, from the geometry of sheet, surface and camera.
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

/// Part of the sensor that is read out.
struct SensorWindow {
  int x = 0;
  int y = 0;
  int width = kSensorWidthPx;
  int height = kSensorHeightPx;
};

/// Returns a window of the given size around the centre of the paper's crop, shifted onto the
/// sensor. REQUIRES 64 … 1280 by 64 … 720.
[[nodiscard]] SensorWindow WindowAroundCrop(int width, int height);

/// Part of the bed below the laser and camera, for example one printed line and its surroundings.
/// Coordinates: x along image +x, y against image +y (up in the image), z above the plate.
struct LaserScene {
  Relief relief;
  std::vector<std::uint8_t> look_bgr;  ///< without laser; relief's grid, 3 bytes a node
  double line_y_mm = 0;                ///< centre of the printed line, where there is one
  double level_x_mm = 0;               ///< point of nominal height on a sloping plate
  std::optional<BedRegion> plate;      ///< beyond it is nothing that light falls on
};

/// State of the laser and camera in one exposure.
struct Exposure {
  double laser_x_mm = 0;   ///< laser on the plate at mid-exposure,
  double laser_y_mm = 0;   ///< in the row of the printed line in the traits
  double travel_x_mm = 0;  ///< camera travel during the exposure
  double travel_y_mm = 0;
  double gain = 1;  ///< multiplies all light
  bool laser_on = true;
  /// Seed of the speckle, which is then reproducible at a position. Absent: drawn anew.
  std::optional<std::uint64_t> speckle = {};
};

/// Not thread-safe: it reuses its buffers.
class LaserCamera {
 public:
  /// @param random  Draws the textures of plate and filament and the speckle.
  LaserCamera(const Condition& condition, const LaserTraits& traits, const SensorWindow& window,
              Random random);

  /// Changes geometry, brightness or sharpness; the surfaces and their speckle remain. Earlier
  /// scenes retain the appearance of their light. Cost: 0.1 ms.
  void SetTraits(const LaserTraits& traits);

  /// Returns the part of the bed in a frame while the laser meets the plate at (laser_x, laser_y),
  /// with neighbours that cast shadows into it.
  [[nodiscard]] BedRegion RegionInView(double laser_x_mm, double laser_y_mm) const;

  /// Prepares one part of the bed. REQUIRES cell_mm a power of two times 0.0125, at most 0.2.
  /// Cost: about 15 ns a cell.
  [[nodiscard]] LaserScene MakeScene(const Bed& bed, const BedRegion& region, double cell_mm,
                                     const std::optional<BedRegion>& plate) const;

  /// Prepares a sweep with the laser at x = from_mm … to_mm on the plate.
  [[nodiscard]] LaserScene MakeScene(const Bed& bed, double line_y_mm, double from_mm,
                                     double to_mm) const;

  /// Renders one frame of the size of the window.
  /// @param laser_mm   laser position on the plate, in the line's row, at mid-exposure.
  /// @param travel_mm  motion during the exposure.
  /// @param gain       multiplies all light.
  /// Accuracy: without noise, speckle and texture the line's centre is within 0.05 px of the
  /// geometry. Cost: under 1 ms at 160 x 120.
  void Render(const LaserScene& scene, double laser_mm, double travel_mm, double gain,
              Random& random, Frame& frame);
  /// Renders the same for any motion. Beyond the scene, its border is extended.
  void Render(const LaserScene& scene, const Exposure& exposure, Random& random, Frame& frame);

 private:
  static constexpr int kGlowCell = 4;       // px; light below a surface is smooth
  static constexpr double kBareMm = 0.004;  // lower heights are plate

  struct View {              // one position of the eye
    double laser_x_mm = 0;   // on the plate, in the line's row
    double laser_y_mm = 0;   // the line's row
    double camera_x_mm = 0;  // foot of the optical axis
    double camera_y_mm = 0;
    double centre_column_px = 0;  // optical axis, in the window
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
  std::vector<float> profile_;       // line profile, per sub-pixel phase
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
