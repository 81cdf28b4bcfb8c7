// Finds the laser line's centre in each row of a frame.
#pragma once

#include <span>
#include <vector>

#include "base/frame.h"

namespace trammel::vision {

/// Model of one laser line: the colour weights that separate its light from all else, and its
/// width. Learnt once from frames that show the same line (LearnStripe), used for all of them.
struct StripeModel {
  float weight_b = 0;  ///< signal = weight_b·B + weight_g·G + weight_r·R
  float weight_g = 0;
  float weight_r = 1;
  float sigma_px = 2.5F;  ///< of the Gaussian with the least scatter of the stripe
  float contrast = 0;     ///< mean response on the line over the noise beside it
  float scatter_px = 0;   ///< 1 sigma of one row's centre before rows support each other, in the
                          ///< typical frame
};

struct LaserLineOptions {
  double max_sigma_px = 6;  ///< >= 1; a wider Gaussian is steadier in speckle, but takes more of
                            ///< what lies beside a bead
  double detection = 1.5;   ///< a row's stripe must exceed the noise of its surroundings so often
  double slope_cost = 0.1;  ///< price of one pixel sideways from row to row, where a row fully on
                            ///< the stripe is worth 1
  double jump_cost = 1.5;   ///< price of a step of any size (a bead's edge in shadow), in stripe
                            ///< sigmas of rows
  double row_smoothing = 1.5;  ///< stripe sigmas along the line over which rows support each other,
                               ///< never across a step; 0: each row for itself
  double as_good = 1;  ///< >= 1; learning takes the narrowest stripe that finds the line at most so
                       ///< many times less steadily than the best
};

/// One sample per row.
struct LaserLine {
  std::vector<float> centre_px;  ///< column, pixel-centre origin; never NaN
  std::vector<float> sigma_px;   ///< 1 sigma; 0 where the row has no stripe (centre_px is then 0)
  float contrast = 0;            ///< mean response on the line over the noise beside it

  [[nodiscard]] bool found(std::size_t row) const { return sigma_px[row] > 0; }
};

/// Buffers, reused from frame to frame; grow to the largest frame seen. Images are stored in bands
/// of rows (stripe_search.h).
struct LaserLineWorkspace {
  std::vector<float> signal;
  std::vector<float> core;      ///< the signal without the colours that are subtracted from it
  std::vector<float> response;  ///< signal behind the zero-mean matched filter
  std::vector<float> best;      ///< response, per row
  std::vector<float> cost;      ///< for the shortest-path search, row by row
  std::vector<float> cheapest;  ///< cost, per row
  std::vector<float> on_path;   ///< response, per row
  std::vector<float> padded, sums, kernel, ramp, way, window, sample, raw_centre, raw_weight;
  std::vector<int> path, rows;
};

/// Minimum frame width: a stripe of 1 px sigma with its background to both sides.
inline constexpr int kNarrowestFrame_px = 8;

/// Determines which mixture of colours and which width find the one stripe that all frames show
/// most steadily from row to row. All are tried on two of the frames, the best of them on the
/// others. The mixtures are: red alone, red against white glints, and red with green if a bright
/// plate saturates red.
/// @param frames  at least one, all of one size; the stripe runs down the image.
///                REQUIRES width >= kNarrowestFrame_px, height >= 1.
[[nodiscard]] StripeModel LearnStripe(std::span<const BgrView> frames,
                                      const LaserLineOptions& options,
                                      LaserLineWorkspace& workspace);

/// Finds the laser line's centre in each row: matched filter, shortest path over the rows (so that
/// glints, halo and lamps beside the line do not capture it), then per row the maximum likelihood
/// position of a Gaussian stripe.
/// @param frame  8-bit BGR, width >= 3, height >= 1; the stripe runs down the image.
/// @param line   one sample per row; its memory is reused.
/// sigma_px comes from sensor noise and speckle, scaled to the scatter from row to row.
/// Cost: O(height·width·sigma), no allocation once the workspace has grown.
void FindLaserLine(const BgrView& frame, const StripeModel& model, const LaserLineOptions& options,
                   LaserLineWorkspace& workspace, LaserLine& line);

}  // namespace trammel::vision
