// Takes a photo of a printed bed.
#pragma once

#include <filesystem>

#include "base/frame.h"
#include "base/random.h"
#include "base/result.h"
#include "sim/photo/photo_camera.h"
#include "sim/print/bed.h"

namespace trammel::sim {

/// The smallest region that holds all filament. Error (kInput): there is none on the bed.
[[nodiscard]] Result<BedRegion> PrintedRegion(const Bed& bed);

/// Renders the whole print as the camera sees it, before JPEG.
/// @param random  Draws plate texture and noise.
/// Error (kInput): nothing was printed; a size outside what PhotoTraits allows.
/// Accuracy: bead edges lie within 0.25 px of PhotoCamera::Project of the bead's edge where the
/// picture has at least 3 px per bead width. Cost: about 0.5 s per million pixels.
[[nodiscard]] Result<Frame> RenderPhoto(const Bed& bed, const PhotoTraits& traits, Random random);

/// Encodes into a new file. Error (kInput): it exists already or cannot be written.
[[nodiscard]] Result<void> WriteJpegFile(const Frame& frame, int quality,
                                         const std::filesystem::path& path);

}  // namespace trammel::sim
