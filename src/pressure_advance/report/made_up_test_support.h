// Made-up analyses for the tests of the report: plausible shapes, no claim about any estimator.
#pragma once

#include <cstddef>

#include "pressure_advance/laser/plate.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report::test {

struct MadeUp {
  std::size_t lines = 10;
  std::size_t frames = 100;  ///< samples along each line
  bool photo = false;        ///< positions in line lengths, widths in px, no scores, no heights
};

/// A good analysis with one unused line (where there are more than four) and one notice.
[[nodiscard]] pressure_advance::Analysis MakeAnalysis(const MadeUp& made_up);

/// A good flow ratio of 1.031: the printer lays 3.0 % too little.
[[nodiscard]] pressure_advance::FlowRatio MakeFlow();

/// The same lines as a laser scan would show them.
[[nodiscard]] pressure_advance::LaserScanView MakeScanView(const MadeUp& made_up);

/// A rectified picture of the lines with their edges traced.
[[nodiscard]] pressure_advance::PhotoView MakePhotoView(const MadeUp& made_up);

}  // namespace trammel::report::test
