// Clutter on a machined surface.
#pragma once

#include <opencv2/core/mat.hpp>

#include "base/random.h"
#include "sim/spindle/spindle_camera.h"

namespace trammel::sim {

/// Returns the bare surface with edges, holes and lettering, CV_32F in grey levels.
[[nodiscard]] cv::Mat SurfaceOf(const SpindlePicture& picture, Random& random);

/// Adds scratches and chips to the picture. `grey` is CV_32F.
void Litter(const SpindleClutter& clutter, double surface_grey, Random& random, cv::Mat& grey);

}  // namespace trammel::sim
