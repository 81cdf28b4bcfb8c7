// The least standard deviation that any unbiased estimator of the contact height can have.
#pragma once

#include <span>
#include <vector>

#include "sim/cell/contact_law.h"

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

/// A tap without noise in the pull-back's cruise.
struct QuietPress {
  std::span<const double> height_mm;  ///< Of each sample above the contact.
  std::span<const double> force_g;    ///< Counting upwards.
  double noise_g = 0;                 ///< That was left out, > 0.
};

/// How far a quiet tap is from what a smooth press on a sloped baseline can explain: one of three
/// terms that nowhere falls, or one by a power. tap_miss_bound.h says what follows from it.
struct SmoothPress {
  double misfit = 0;            ///< In standard deviations of the noise, all samples; infinite
                                ///< where no press will do.
  double shift_mm = 0;          ///< Of its break from the true one.
  std::vector<double> force_g;  ///< At the heights.
};

/// The nearest with its break there.
[[nodiscard]] SmoothPress SmoothPressAt(const QuietPress& quiet, double shift_mm);

/// The nearest of all within 30 um.
[[nodiscard]] SmoothPress NearestSmoothPress(const QuietPress& quiet);

/// One with its break beyond that of the nearest, as the true break sees it, so far that the square
/// of its misfit is larger by `excess`.
[[nodiscard]] SmoothPress SmoothPressBeyond(const QuietPress& quiet, const SmoothPress& nearest,
                                            double excess);

}  // namespace trammel
