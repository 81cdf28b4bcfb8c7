// Periodic random fields: speckle, plate texture, sensor noise.
#pragma once

#include <cstddef>
#include <vector>

#include "base/random.h"
#include "sim/print/conditions.h"

namespace trammel::sim {

/// Square of values, periodic in both directions. `size` is a power of two.
struct Tile {
  int size = 0;
  std::vector<float> value;

  [[nodiscard]] float At(int x, int y) const {
    const int mask = size - 1;
    return value[static_cast<std::size_t>(y & mask) * static_cast<std::size_t>(size) +
                 static_cast<std::size_t>(x & mask)];
  }
};

/// Returns Gaussian noise with mean 0 and standard deviation 1 whose correlation is a Gaussian:
/// white noise smoothed with a kernel of `sigma` cells.
/// REQUIRES size a power of two in 8 … 4096 and 0 <= sigma <= size / 8.
[[nodiscard]] Tile SmoothNoise(int size, double sigma, Random& random);

/// Returns a Gaussian kernel with 2 * radius + 1 taps that sum to 1, radius = ceil(3 sigma).
[[nodiscard]] std::vector<float> GaussianKernel(double sigma);

/// Patch of surface that repeats over the bed. All relative values have a mean near 1.
struct Texture {
  double cell_mm = 0.025;
  Tile bump_mm;  ///< height above the mean surface
  Tile laser;    ///< laser reflectance, relative
  Tile ambient;  ///< brightness in room light, relative
};

/// Matte: fine grain. Textured: bumps of 20 … 30 um (1 sigma) whose ridges glint. PEI: nearly
/// plain.
[[nodiscard]] Texture MakePlateTexture(Plate plate, Random& random);

/// Returns the surface of a bead: nearly plain, with glossy patches.
[[nodiscard]] Texture MakeFilamentTexture(Random& random);

/// Returns a surface without any structure.
[[nodiscard]] Texture MakePlainTexture();

}  // namespace trammel::sim
