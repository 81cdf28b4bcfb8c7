// Layout of targets on printed pages.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

namespace trammel::part_alignment {

struct SheetRequest {
  int bits = 14;                ///< 12, 14 or 20; see code_book.h
  double radius_mm = 5;         ///< disc radius, 0.5 … 60
  int first = 1;                ///< number of the first target
  int count = 12;               ///< coded targets, 0 … 2000
  int plain = 0;                ///< plain discs of the same radius behind them, 0 … 2000
  bool bright = false;          ///< white targets on black squares, for retroreflective sheet
  double page_width_mm = 210;   ///< 50 … 2000
  double page_height_mm = 297;  ///< 50 … 2000
};

struct PlacedTarget {
  int page = 0;            ///< from 0
  int number = 0;          ///< 0: a plain disc
  std::uint32_t word = 0;  ///< ring's code word
  double x_mm = 0;         ///< of the centre, from the page's left edge
  double y_mm = 0;         ///< from the page's upper edge
};

/// Line of known length on every page, between two ticks.
struct PrintedScaleBar {
  double x_mm = 0;  ///< first tick
  double y_mm = 0;
  double length_mm = 0;
};

struct TargetSheet {
  SheetRequest request;
  int pages = 0;
  /// Side of a target's square, which contains all that the finder needs: cut along it.
  double square_mm = 0;
  double label_mm = 0;  ///< height of the number's letters below the square
  PrintedScaleBar scale_bar;
  std::vector<PlacedTarget> targets;
};

/// Plans rows of squares from the upper left, numbers below them, the scale bar at the foot. Errors
/// (kInput): a number out of its range, numbers beyond the code book's, a page too small for one
/// target; each names the field and the bound.
[[nodiscard]] Result<TargetSheet> PlanTargetSheet(const SheetRequest& request);

}  // namespace trammel::part_alignment
