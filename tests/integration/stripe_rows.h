// Draws laser stripes of which the true centre is known, by a model of its own: exact integrals
// over pixels, speckle that neighbours share, light and sensor noise, eight bits.
#pragma once

#include <string>
#include <vector>

#include "base/frame.h"
#include "base/random.h"

namespace trammel::test {

/// How rows look. Levels are of 255.
struct StripeLook {
  std::string name;
  double sigma_px = 2.5;        ///< of the stripe's Gaussian, 1 … 6
  double signal_to_noise = 30;  ///< the stripe's peak over the noise there
  double speckle = 0.2;         ///< contrast; 0: none
  double grain_px = 1.2;        ///< 1 sigma of the speckle's correlation over columns and over rows
  double lobe = 0;              ///< peak of a second Gaussian, 1.6 sigma to the right, of the first
  double halo = 0;              ///< light that comes out again to the right, of the stripe's
  double over_full_scale = 0;   ///< the peak without the sensor's limit; 0: below full scale
  bool bead = false;   ///< half as bright, up to 10 px to the left, over a fifth of the rows
  bool steep = false;  ///< the bead has walls, from one row to the next
  int glints = 0;      ///< white, brighter than the line, beside it, per frame
};

/// Frames and where their stripe is.
struct StripeSweep {
  std::vector<Frame> frames;
  std::vector<double> centre_px;  ///< per row, one frame's after the other's
};

/// Draws one sweep: the stripe leans and stands the same in all frames, speckle and noise are new.
[[nodiscard]] StripeSweep DrawStripes(const StripeLook& look, int frames, Random& random);

/// What limits a row's centre, 1 sigma, px.
struct StripeBound {
  double white_px = 0;    ///< Gaussian stripe in white noise: (sigma / A)·sqrt(2 s / sqrt(pi))
  double speckle_px = 0;  ///< centre of gravity of a Gaussian in speckle alone
  double joint_px = 0;  ///< who knows shape, noise and speckle's covariance, but not brightness and
                        ///< background; to first order
};

[[nodiscard]] StripeBound BoundOf(const StripeLook& look);

}  // namespace trammel::test
