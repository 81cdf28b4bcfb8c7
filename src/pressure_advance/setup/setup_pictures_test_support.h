// Test pictures of a printed square and of a laser stripe. Drawn from distances and areas,
// independent of the readers' code.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/frame.h"
#include "base/random.h"

namespace trammel::pressure_advance::testing {

inline std::uint8_t Level(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0));
}

// Share of a normal distribution below t.
inline double Below(double t) { return 0.5 * std::erfc(-t / std::sqrt(2.0)); }

struct MarkPicture {
  int width = 640;
  int height = 360;
  double column_px = 330;  // square's centre
  double row_px = 175;
  double px_per_mm = 20;
  double turn_rad = 0;  // clockwise as seen
  double side_mm = 6;
  double bead_mm = 0.5;
  double plate = 24;  // grey levels
  double bead = 10;
  double blur_px = 1.5;
  double noise = 0;        // grey levels, per pixel and channel
  double grain = 0;        // plate texture: grey levels, cells of 3 px
  double waviness_mm = 0;  // 1 sigma by which pieces of 0.5 mm of bead stand off
  double slope = 0;        // illumination: grey levels from left to right
  double longer = 1;       // factor on one of the square's directions
  double gap_mm = 0;       // left out of the middle of one side

  [[nodiscard]] Frame Draw(Random& random) const {
    Frame frame(width, height);
    const double cosine = std::cos(turn_rad), sine = std::sin(turn_rad);
    const double half = 0.5 * side_mm * px_per_mm, bead_half = 0.5 * bead_mm * px_per_mm;
    constexpr int kPieces = 64;
    double wave[4][kPieces];
    for (auto& side : wave) {
      for (double& piece : side) piece = waviness_mm * px_per_mm * random.Normal();
    }
    std::vector<double> cells(static_cast<std::size_t>((width / 3 + 1) * (height / 3 + 1)));
    for (double& cell : cells) cell = grain * random.Normal();
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double dx = x - column_px, dy = y - row_px;
        const double u = (cosine * dx + sine * dy) / longer, v = -sine * dx + cosine * dy;
        // The nearest of the four sides: distance from its centre line, place along it.
        double near = 1e9;
        int side = 0;
        double along = 0;
        for (int s = 0; s < 4; ++s) {
          const double across = (s % 2 == 0 ? v : u) - (s < 2 ? -half : half);
          const double place = s % 2 == 0 ? u : v;
          const double past = std::max(0.0, std::abs(place) - half);
          const double distance = std::hypot(across, past);
          if (distance < std::abs(near))
            near = across < 0 ? -distance : distance, side = s, along = place;
        }
        const int piece = static_cast<int>(along / px_per_mm / 0.5) + kPieces / 2;
        near -= wave[side][std::clamp(piece, 0, kPieces - 1)];
        double covered = Below((near + bead_half) / blur_px) - Below((near - bead_half) / blur_px);
        if (side == 0 && std::abs(along) < 0.5 * gap_mm * px_per_mm) covered = 0;
        const double light = plate +
                             cells[static_cast<std::size_t>((y / 3) * (width / 3 + 1) + x / 3)] +
                             slope * (static_cast<double>(x) / width - 0.5);
        for (int c = 0; c < 3; ++c) {
          frame.row(y)[3 * x + c] =
              Level(light + (bead - light) * covered + noise * random.Normal());
        }
      }
    }
    return frame;
  }
};

struct StripePicture {
  int width = 320;
  int height = 240;
  double at_middle_px = 171.3;  // column in the middle row
  double slope = 0.05;          // columns per row
  double sigma_px = 2.5;
  double amplitude = 180;
  double ambient = 9;
  double noise = 0;    // grey levels
  double speckle = 0;  // contrast, per row and column
  double bend_px = 0;  // off the straight line at the ends
  int bead_from = 0;   // rows with a bead that shifts the stripe
  int bead_to = 0;
  double bead_shift_px = -12;
  bool down = true;

  [[nodiscard]] Frame Draw(Random& random) const {
    const int length = down ? height : width, across = down ? width : height;
    Frame frame(width, height);
    for (int y = 0; y < length; ++y) {
      const double along = y - 0.5 * (length - 1);
      double centre = at_middle_px + slope * along;
      const double end = 2 * along / length;
      centre += bend_px * end * end;
      if (y >= bead_from && y < bead_to) centre += bead_shift_px;
      for (int x = 0; x < across; ++x) {
        const double t = (x - centre) * std::cos(std::atan(slope)) / sigma_px;
        const double light =
            amplitude * std::exp(-0.5 * t * t) * std::max(0.0, 1 + speckle * random.Normal());
        std::uint8_t* pixel = down ? frame.row(y) + 3 * x : frame.row(x) + 3 * y;
        for (int c = 0; c < 3; ++c) {
          pixel[c] = Level(ambient + (c == 2 ? light : 0.15 * light) + noise * random.Normal());
        }
      }
    }
    return frame;
  }
};

}  // namespace trammel::pressure_advance::testing
