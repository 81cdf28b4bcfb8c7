// G-code of a sheet of tool offsets, as each firmware takes it, with macros of the machine's own:
// the macros' configuration, then the file.
#include "fuzz.h"
#include "sim/sheet/sheet_gcode.h"
#include "sim/sheet/sheet_macros.h"

TRAMMEL_FUZZ_TARGET(sim_sheet_gcode)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  sim::SheetSetup setup;
  setup.firmware = sim::GuessSheetFirmware(parts[1]);
  setup.tool_commands = {"PICK {tool}"};
  auto macros = sim::ParseSheetMacros(parts[0]);
  if (fuzz::Good(macros)) setup.macros = std::move(*macros);
  (void)fuzz::Good(sim::InterpretSheet(parts[1], setup));
  return 0;
}
