// Writes the page of an alignment, and the picture of each view.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frame.h"
#include "document/figure.h"
#include "part_alignment/report/alignment_report.h"

namespace trammel::report {

/// Target in a view; found, projected, or both.
struct DrawnTarget {
  std::string id;
  std::optional<Eigen::Vector2d> found_px;      ///< (column, row)
  std::optional<Eigen::Vector2d> projected_px;  ///< by the solution
  bool left_out = false;                        ///< taken for wrong, so that it did not count
  double sigma_px = 0;                          ///< residual's, per axis (k = 1); 0: not drawn
};

/// Computes the common enlargement of a report's residuals, so that one of `rms_px` is 11 … 27 px
/// of the page long. Values: 1, 2 or 5 times a power of ten, 1 … 1e6.
/// @param rms_px  root mean square over the report, >= 0
/// @param width_px, height_px  of the camera, >= 1
[[nodiscard]] double ResidualEnlargement(double rms_px, int width_px, int height_px);

/// "view-01" and so on: the picture, a circle where each target was found, a cross where the
/// solution projects it, the residual between them enlarged, with its size beside it and one sigma
/// as a dashed ring; below, what the marks mean and how long a residual of a round size is drawn.
/// Orange circle: left out; dashed cross: in the picture, but not found.
/// @param view     from 0; people read it from 1
/// @param picture  without pixels: a grey area in its place.
/// @param width_px, height_px  of the camera, >= 1
/// @param enlarged  of residuals, in px of the camera; > 0
[[nodiscard]] Figure AlignmentPicture(std::size_t view, const BgrView& picture, int width_px,
                                      int height_px, const std::vector<DrawnTarget>& targets,
                                      double enlarged);

/// Formats the part's pose, the lines for each control, the uncertainty's components, and all in
/// words. result.json has covariance and residuals. Self-contained; text from outside may contain
/// any bytes.
/// @param views  of AlignmentPicture: those to show on the page.
[[nodiscard]] std::string AlignmentPage(const AlignmentOutput& output,
                                        std::span<const Figure> views);

}  // namespace trammel::report
