// Virtual sheets of the original generator: drawn, printed and scanned by sim, read by tool_offset
// with the file that was printed or with another one.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "offset_world.h"
#include "sim/sheet/original_sheet.h"

namespace trammel {

/// What is drawn, what the reader is told that was drawn, and how the page lies.
struct OriginalCase {
  sim::OriginalSheet drawn;
  sim::OriginalSheet told;  ///< as G-code
  int way = 0;              ///< 0 … 7: four turns, then the same mirrored
  double dpi = 600;
  bool drives = false;  ///< periodic errors of motors and pulleys, and of the scanner's bar
  std::function<void(Random&, sim::SheetMachine&, sim::SheetPaper&)> machine;
  std::function<void(Random&, sim::ScannerTraits&)> scanner;
};

/// A sheet of the first `pairs` tools in a list from T1, against T2.
[[nodiscard]] sim::OriginalSheet OriginalOf(int pairs);

/// As published, except for what the case changes; a turn of up to 4 degrees beside the quarter.
/// The tools' offsets from the reference tool are up to 0.6 mm along the print's own axes.
[[nodiscard]] SeenSheet SeeOriginal(const OriginalCase& what, std::uint64_t seed);

/// The plan of the G-code that such a sheet is drawn with. Throws where it is not read.
[[nodiscard]] PatternFile OriginalPattern(const sim::OriginalSheet& sheet);

}  // namespace trammel
