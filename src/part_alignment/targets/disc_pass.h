// One pass over the pixels about a disc's edge: the normal equations of its model.
#pragma once

#include <array>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/small_cholesky.h"

namespace trammel::part_alignment {

/// Of DiscModel, in its order: c, W, blur, contrast, background, gradient.
inline constexpr int kDiscParameters = 10;

using DiscVector = SmallVector<kDiscParameters>;
using DiscMatrix = SmallMatrix<kDiscParameters>;

/// The system J^T J x = J^T r, lower triangle; sums of floats, right to some 1e-5.
struct DiscNormal {
  DiscMatrix jtj = DiscMatrix::Zero();
  DiscVector jtr = DiscVector::Zero();
  double rss = 0;
  int samples = 0;
  int saturated = 0;
};

/// Residuals about an eighth of the edge, in three ways that light which is no plane shows in.
struct SectorSum {
  double edge = 0;  ///< residual times what the edge's shift by 1 px would change
  double edge2 = 0;
  double inside = 0;
  double outside = 0;
  int inside_count = 0;
  int outside_count = 0;
};
using SectorSums = std::array<SectorSum, 8>;

/// Of the pixels that SumOverPixels takes of every row, saturated ones left out.
[[nodiscard]] SectorSums SumBySectors(const PageView& picture, const DiscModel& model,
                                      const RingShade& ring);

/// Sums over the pixels within 3.5 blurs + 1.5 px of the edge, short of the ring.
/// @param picture  1 channel, at least 4 px wide.
/// @param every    looks at one row in so many, >= 1.
[[nodiscard]] DiscNormal SumOverPixels(const PageView& picture, const DiscModel& model,
                                       const RingShade& ring, int every);

}  // namespace trammel::part_alignment
