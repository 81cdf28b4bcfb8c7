// Other ways to find a stripe's centre in each row of a picture, to compare trammel's with.
#pragma once

#include <vector>

namespace trammel::test {

/// What all of them are given: one value per pixel, row by row, and how wide the stripe is.
struct RowPicture {
  int width = 0;
  int height = 0;
  std::vector<double> value;
  double sigma_px = 1;

  [[nodiscard]] const double* row(int y) const {
    return value.data() + static_cast<std::ptrdiff_t>(y) * width;
  }
};

/// Column of the centre per row; NaN: no answer.
using Centres = std::vector<double>;

/// Centre of gravity within three sigmas of the brightest place, above the row's median.
[[nodiscard]] Centres CentreOfGravity(const RowPicture& picture);

/// Parabola through the logarithms of the brightest pixel and its neighbours.
[[nodiscard]] Centres GaussianParabola(const RowPicture& picture);

/// Where a finite difference as long as the stripe is wide passes through zero (Blais and Rioux
/// 1986).
[[nodiscard]] Centres BlaisRioux(const RowPicture& picture);

/// Steger's ridge (1998) in one dimension: of the row behind a Gaussian's first and second
/// derivatives, the zero of the slope where it bends most.
[[nodiscard]] Centres StegerRidge(const RowPicture& picture);

/// The brightest way down the rows, then a parabola through the smoothed row.
[[nodiscard]] Centres ShortestPathRidge(const RowPicture& picture);

}  // namespace trammel::test
