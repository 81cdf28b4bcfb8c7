// Straight lines of ink on paper as a scanner's pixels see them: a picture whose truth is known.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/random.h"

namespace trammel::support {

/// A bar with square ends. Page coordinates: mm, x right, y down from the page's upper left corner.
struct PaperStroke {
  double x0_mm = 0;
  double y0_mm = 0;
  double x1_mm = 0;
  double y1_mm = 0;
  double width_mm = 0.4;
  std::array<double, 3> ink{20, 20, 20};  ///< blue, green, red of full cover
};

struct PaperOptions {
  double width_mm = 100;
  double height_mm = 100;
  double dpi_x = 600;
  double dpi_y = 600;
  int channels = 1;  ///< 1: the mean of the colours
  std::array<double, 3> paper{235, 235, 235};
  /// 0: a pixel is the exact mean over its area. Otherwise Gaussian, which stands for both.
  double blur_px = 0;
  /// Standard deviation of where each edge of a stroke lies, piece by piece of `rough_step_mm`.
  double rough_mm = 0;
  double rough_step_mm = 0.15;
  double noise = 0;     ///< standard deviation of a pixel
  double gradient = 0;  ///< relative change of all levels from the left to the right side
};

struct PaperPage {
  int width = 0;
  int height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;  ///< shape (height, width, channels)
};

[[nodiscard]] PaperPage DrawPaper(const PaperOptions& options,
                                  const std::vector<PaperStroke>& strokes, Random& random);

}  // namespace trammel::support
