// What plates and beads look like close up, fixed to the bed.
#pragma once

#include "base/random.h"
#include "sim/print/conditions.h"
#include "sim/print/noise_field.h"

namespace trammel::sim {

/// A patch of surface that repeats over the bed. All relative values have a mean near 1.
struct Texture {
  double cell_mm = 0.025;
  Tile bump_mm;  ///< height above the mean surface
  Tile laser;    ///< how strongly it returns laser light, relative
  Tile ambient;  ///< how bright it looks in room light, relative
};

/// Matte: fine grain. Textured: bumps of 20 … 30 um (1 sigma) whose ridges glint. PEI: nearly
/// plain.
[[nodiscard]] Texture MakePlateTexture(Plate plate, Random& random);

/// The surface of a bead: nearly plain, with glossy patches.
[[nodiscard]] Texture MakeFilamentTexture(Random& random);

/// A surface without any structure.
[[nodiscard]] Texture MakePlainTexture();

}  // namespace trammel::sim
