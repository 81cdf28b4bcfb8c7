// Virtual sheets for the studies of tool offset: printed and scanned by sim, read by tool_offset.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "sim/scanner/scanner_page.h"
#include "sim/scanner/sheet_world.h"
#include "sim/sheet/sheet_print.h"
#include "tool_offset/offset/analyse.h"

namespace trammel {

/// The printer, its paper and the scanner of one world, before anything is printed.
struct SheetWorld {
  sim::SheetMachine machine;
  sim::SheetPaper paper;
  sim::ScannerTraits scanner;  ///< drawn for the print as the seed has it
};

struct PatternFile {
  tool_offset::SheetPlan plan;
  std::string gcode;
};
[[nodiscard]] PatternFile WritePattern(const tool_offset::SheetSettings& settings);

struct SeenSheet {
  sim::PrintedSheet sheet;
  Result<tool_offset::SheetResult> result;
};

/// Prints, scans and reads the sheet that the name draws.
/// @param machine  changes printer and paper before the print.
/// @param scanner  changes how it is scanned.
[[nodiscard]] SeenSheet SeeSheet(
    const PatternFile& pattern, const sim::SheetName& name,
    const std::function<void(sim::SheetMachine&, sim::SheetPaper&)>& machine,
    const std::function<void(sim::ScannerTraits&)>& scanner,
    sim::SheetScene scene = sim::SheetScene::kBlackOnWhite);

/// Errors and what was claimed of them.
struct Tally {
  std::vector<double> error_um;
  std::vector<double> half_width_um;
  int covered = 0;
  int missing = 0;

  void Add(const Measured& measured, double truth_mm);
  [[nodiscard]] double Quantile(double share) const;
  [[nodiscard]] double Coverage() const;
  [[nodiscard]] double MeanHalfWidth_um() const;
};

/// A whole number from the environment.
[[nodiscard]] std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise);

}  // namespace trammel
