// Virtual sheets for the study and the tests of tool offset: printed and scanned by sim, read by
// tool_offset.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "sim/scanner/scanner_page.h"
#include "sim/sheet/original_sheet.h"
#include "sim/sheet/sheet_print.h"
#include "tool_offset/offset/analyse.h"

namespace trammel {

struct PatternFile {
  tool_offset::SheetPlan plan;
  std::string gcode;
};
[[nodiscard]] PatternFile WritePattern(const tool_offset::SheetSettings& settings);
/// The sheet of tools 0 … count - 1, of PLA on a bed of 300 mm.
[[nodiscard]] PatternFile SheetOfTools(int count);
/// The original generator's sheet, with the plan that its G-code gives. Throws where it is refused.
[[nodiscard]] PatternFile OriginalPattern(const sim::OriginalSheet& sheet);

using MachineChange = std::function<void(sim::SheetMachine&, sim::SheetPaper&)>;
using ScannerChange = std::function<void(sim::ScannerTraits&)>;

/// Prints the pattern, black on white, by the machine that the name draws.
[[nodiscard]] sim::PrintedSheet PrintPattern(const std::string& gcode, const sim::SheetName& name,
                                             const MachineChange& machine = {});

struct SeenSheet {
  sim::PrintedSheet sheet;
  Result<tool_offset::SheetResult> result;
};

/// Prints, scans and reads the sheet that the name draws.
[[nodiscard]] SeenSheet SeeSheet(const PatternFile& pattern, const sim::SheetName& name,
                                 const MachineChange& machine, const ScannerChange& scanner);

/// Errors and their stated intervals.
struct Tally {
  std::vector<double> error_um;
  std::vector<double> half_width_um;
  int covered = 0;
  int missing = 0;

  void Add(const Measured& measured, double truth_mm);
  [[nodiscard]] double Mean() const;
  [[nodiscard]] double Quantile(double share) const;  ///< of the absolute errors
  [[nodiscard]] double Coverage() const;
  [[nodiscard]] double MeanHalfWidth_um() const;
};

}  // namespace trammel
