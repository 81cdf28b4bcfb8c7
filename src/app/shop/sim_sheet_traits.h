// NAME=NUMBER settings of `trammel sim sheet`.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_machine.h"
#include "sim/sheet/sheet_paper.h"

namespace trammel::app {

/// All names, for the help text.
[[nodiscard]] std::string SheetTraitNames();

/// Sets what belongs to the machine or the paper, for example `leg-placement-um=5`. Errors: another
/// form or name, not a number. Bounds are checked where the value is used.
[[nodiscard]] Result<void> SetSheetTrait(std::string_view text, sim::SheetMachine& machine,
                                         sim::SheetPaper& paper);

/// The same for what belongs to the scanner, for example `shadow=0.3`. A text for the other
/// function changes nothing here, and the other way round.
[[nodiscard]] Result<void> SetScannerTrait(std::string_view text, sim::ScannerTraits& scanner);

}  // namespace trammel::app
