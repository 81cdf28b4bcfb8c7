// Finds discs with coded rings in a picture, reads their codes and measures their centres.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/page.h"
#include "base/result.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/target.h"

namespace trammel::part_alignment {

/// Computes the luma of BT.601; a grey camera's three equal channels are unchanged. REQUIRES 3 ·
/// width · height bytes: BGR, row-major.
[[nodiscard]] Page GreyPicture(int width, int height, std::span<const std::uint8_t> bgr);

struct FinderOptions {
  double min_radius_px = 4;    ///< disc radius; >= 3. Smaller ones are rejected
  double max_radius_px = 150;  ///< disc radius; larger ones are not found
  double min_contrast = 20;    ///< between disc and surroundings, grey levels, 8 … 255; what
                               ///< is fainter is rejected
  bool plain_discs = false;    ///< also reports discs without a ring
  /// True: rings run counter-clockwise in the picture, as of a camera that looks along -z with rows
  /// that run down (camera.h), or of a mirrored picture.
  bool mirrored = false;
};

/// Memory of FindTargets, reused for the next picture.
struct FinderWorkspace {
  std::vector<std::uint8_t> seen;
  std::vector<std::uint8_t> quiet;
};

/// Finds targets by the method of docs/howto/part-alignment.md, "Targets". Blobs are outlined by a
/// threshold that follows the mean around (OpenCV), the ring about each ellipse is read, and the
/// disc's blurred ellipse is fitted to the pixels by least squares.
/// @param picture  8-bit grey: 1 channel, at least 16 x 16 px, at most 32,767 a side.
/// Errors (kInput): a picture of another kind, options out of range. A picture without targets is a
/// result with none.
/// Accuracy: root-mean-square error per axis within 1.3 of the Cramér-Rao bound from a radius of 5
/// px (ring_finder_test). Cost: docs/howto/part-alignment.md.
[[nodiscard]] Result<FoundTargets> FindTargets(const PageView& picture, const CodeBook& book,
                                               const FinderOptions& options,
                                               FinderWorkspace& workspace);

}  // namespace trammel::part_alignment
