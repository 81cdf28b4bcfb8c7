// The least standard deviation that any unbiased estimator of the contact height can have.
#pragma once

#include <span>
#include <vector>

#include "sim/contact_law.h"

namespace trammel {

/// A model of force against height: a baseline, flat or sloped, and below the break a press whose
/// polynomial has so many terms.
struct PressModel {
  bool sloped_baseline = true;
  int press_terms = 1;  ///< 1 … 3
};

/// Cramér-Rao bound of the break in mm: from the Fisher matrix of break, baseline and press terms
/// for independent normal noise, at the press of `law`.
/// @param height_mm  of each sample above the contact.
/// REQUIRES noise_g > 0 and samples on both sides; NaN where they do not determine the model.
[[nodiscard]] double ContactBound(std::span<const double> height_mm, double noise_g,
                                  const sim::ContactLaw& law, const PressModel& model);

/// How far a quiet tap is from all that a smooth press on a sloped baseline can explain.
struct SmoothPress {
  double misfit = 0;    ///< of the nearest one, in standard deviations of the noise, all samples
  double shift_mm = 0;  ///< of its break from the true one
  std::vector<double> force_g;  ///< of the nearest one, at the heights
};

/// Scans the break for the smooth press of three terms, nowhere softer than 0, that is nearest to a
/// tap without noise. tap_miss_bound.h says what follows from it.
/// @param height_mm  of each sample above the contact; @param force_g  without noise.
/// REQUIRES noise_g > 0 and a press that counts upwards; the misfit is infinite where no press will
/// do.
[[nodiscard]] SmoothPress NearestSmoothPress(std::span<const double> height_mm,
                                             std::span<const double> force_g, double noise_g);

}  // namespace trammel
