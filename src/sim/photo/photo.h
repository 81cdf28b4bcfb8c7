// Takes a photo of a printed bed.
#pragma once

#include <filesystem>

#include "base/frame.h"
#include "base/random.h"
#include "base/result.h"
#include "sim/photo/photo_camera.h"
#include "sim/print/bed.h"

namespace trammel::sim {

/// Returns the smallest region that contains all filament. Error (kInput): there is none on the
/// bed.
[[nodiscard]] Result<BedRegion> PrintedRegion(const Bed& bed);

/// Renders the camera's view of the whole print, before JPEG.
/// @param random  Draws plate texture and noise.
/// Error (kInput): nothing was printed; a size outside the range of PhotoTraits.
/// Accuracy: bead edges are within 0.25 px of PhotoCamera::Project of the bead's edge if the
/// picture has at least 3 px per bead width. Cost: about 0.5 s per million pixels.
[[nodiscard]] Result<Frame> RenderPhoto(const Bed& bed, const PhotoTraits& traits, Random random);

/// Encodes into a new file. Error (kInput): it exists already or cannot be written.
[[nodiscard]] Result<void> WriteJpegFile(const Frame& frame, int quality,
                                         const std::filesystem::path& path);

}  // namespace trammel::sim
