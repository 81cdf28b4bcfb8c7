// Finds targets in a picture, reads their codes and measures their centres.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/page.h"
#include "base/result.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/image_ellipse.h"
#include "part_alignment/targets/reject_reason.h"
#include "part_alignment/targets/row_runs.h"
#include "part_alignment/targets/square_shape.h"

namespace trammel::part_alignment {

enum class Polarity { kBoth, kDarkOnBright, kBrightOnDark };

struct FinderOptions {
  Polarity polarity = Polarity::kBoth;  ///< of disc and ring against what surrounds them
  double min_radius_px = 4;             ///< of the disc; >= 3. Smaller ones are rejected
  double max_radius_px = 150;           ///< of the disc; larger ones are not seen
  double min_contrast = 20;  ///< between disc and surroundings, grey levels, 8 … 255; what
                             ///< is fainter is rejected
  bool plain_discs = false;  ///< also reports discs without a ring
  /// Rings run counter-clockwise in the picture: of a camera that looks along -z with rows that run
  /// down (camera.h), or that was mirrored.
  bool mirrored = false;
};

struct FoundTarget {
  /// In the code book, from 1; absent for a plain disc. A square marker's id.
  std::optional<int> number;
  /// The disc's image. Its centre is not the image of the disc's centre where the view is oblique:
  /// see eccentricity.h.
  ImageEllipse disc;
  double sigma_column_px = 0;  ///< k = 1, from the pixels' own scatter about the model
  double sigma_row_px = 0;
  double contrast = 0;         ///< grey levels, disc less surroundings: negative for dark discs
  double noise = 0;            ///< scatter of the pixels about the model, grey levels
  double blur_px = 0;          ///< standard deviation of the edge's profile
  double ring_start_rad = 0;   ///< where bit 0 of the word begins, in the ellipse's own angle
  double saturated_share = 0;  ///< of the samples, 0 … 1
  std::optional<SquareShape> square;  ///< of a square marker (square_finder.h)
};

struct RejectedTarget {
  RejectReason reason = RejectReason::kWrongCode;
  double column_px = 0;
  double row_px = 0;
  double radius_px = 0;
  std::optional<int> number;  ///< where it was read
};

struct FoundTargets {
  std::vector<FoundTarget> targets;      ///< ascending by number, then from the top
  std::vector<RejectedTarget> rejected;  ///< from the top
};

/// Memory of FindTargets, to be used again for the next picture.
struct FinderWorkspace {
  std::vector<RowEdge> edges;
  std::vector<Run> runs;
  std::vector<Run> left_over;
  std::vector<std::uint8_t> seen;
  std::vector<std::uint8_t> quiet;
};

/// Method: docs/part-alignment.md, "Targets". Discs are looked for on every few rows, their
/// outline is walked, the ring is read, and the disc's blurred ellipse is fitted to the pixels by
/// least squares.
/// @param picture  8-bit grey: 1 channel, at least 16 x 16 px, at most 32,767 a side.
/// Errors (kInput): a picture of another kind, options out of range. A picture without targets is
/// a result with none.
/// Accuracy: root-mean-square error per axis within 1.3 of the Cramér-Rao bound from a radius of
/// 5 px (target_finder_test). Cost: docs/part-alignment.md.
[[nodiscard]] Result<FoundTargets> FindTargets(const PageView& picture, const CodeBook& book,
                                               const FinderOptions& options,
                                               FinderWorkspace& workspace);

}  // namespace trammel::part_alignment
