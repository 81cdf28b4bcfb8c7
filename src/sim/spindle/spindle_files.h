// Files of `trammel-sim spindle`: pictures, their descriptions, and the truth.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sim/spindle/spindle_camera.h"
#include "sim/spindle/spindle_world.h"

namespace trammel::sim {

/// Returns a station's picture: each target of the part with its pattern. The picture's lens is the
/// camera's; light, clutter and optics are those of `like`.
/// REQUIRES one pattern and one list of wedges (or none at all) per target of the part.
[[nodiscard]] SpindlePicture PictureAt(const SpindleWorld& world, std::size_t stop,
                                       const std::vector<RingPattern>& patterns,
                                       const std::vector<std::vector<HiddenWedge>>& hidden,
                                       const SpindlePicture& like);

/// Returns the camera object of a camera file.
[[nodiscard]] nlohmann::ordered_json SpindleCameraJson(const SpindleLens& lens);

/// "view-01.png" for the first stop.
[[nodiscard]] std::string PictureName(std::size_t stop);

/// Returns the file of observations ("format": 1) for `trammel align solve`: stated camera, ideal
/// positions, stated stops, and the noisy centres of the targets at least `margin_px` from the
/// edge.
[[nodiscard]] std::string ObservationsJson(const SpindleWorld& world, const SpindleName& name,
                                           double margin_px);

/// Returns the same with the name of each view's picture in place of its observations.
[[nodiscard]] std::string ViewsJson(const SpindleWorld& world);

/// Returns the part's place, the camera's clamping, the true positions of spindle and targets, and
/// the exact images of the centres.
[[nodiscard]] std::string SpindleTruthJson(const SpindleWorld& world, const SpindleName& name,
                                           double margin_px);

}  // namespace trammel::sim
