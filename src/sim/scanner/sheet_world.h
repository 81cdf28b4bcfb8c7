// A seed names a machine with its tools, every sheet it prints and every scan of each.
#pragma once

#include <cstdint>
#include <string>

#include "base/random.h"
#include "sim/scanner/scanner_page.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_machine.h"
#include "sim/sheet/sheet_paper.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// Which sheet of the world of a seed, and which scan of it. Two sheets of one seed share their
/// machine; two scans of one sheet share their ink. Seeds below 1000 are for development.
struct SheetName {
  std::uint64_t seed = 0;
  std::uint64_t sheet = 0;  ///< 0 … 9999
  std::uint64_t scan = 0;   ///< 0 … 9999
};

[[nodiscard]] SheetMachine MachineOf(const SheetName& name, SheetScene scene);
[[nodiscard]] SheetPaper PaperOf(const SheetName& name, SheetScene scene);
/// The generator of everything that PrintSheet leaves to chance.
[[nodiscard]] Random PrintingOf(const SheetName& name);
[[nodiscard]] ScannerTraits ScannerOf(const SheetName& name, const PrintedSheet& sheet);
/// The generator of a scan's noise.
[[nodiscard]] Random ScanningOf(const SheetName& name);

/// The truth behind a scan as JSON (docs/formats.md): the offset of each tool that the file draws
/// with from `reference`, null where the reference draws nothing; the play; the scanner's errors.
[[nodiscard]] std::string SheetTruthJson(const SheetName& name, const PrintedSheet& sheet,
                                         int reference, const ScannerTraits& scanner,
                                         const PageFormat& format);

}  // namespace trammel::sim
