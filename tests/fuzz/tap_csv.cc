// Recorded taps as tables, their moves beside them or derived from z.
#include "tap/files/tap_csv.h"

#include "fuzz.h"
#include "tap/files/moves_from_z.h"

TRAMMEL_FUZZ_TARGET(tap_csv)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  auto tap = files::ParseTapCsv(parts[0], "tap.csv");
  if (!fuzz::Good(tap)) return 0;
  fuzz::Require(tap->time_s.size() == tap->force_g.size(), "each sample has a time and a force");
  fuzz::Require(tap->z_mm.empty() || tap->z_mm.size() == tap->time_s.size(), "or a z, too");
  (void)files::MovesFromZ(tap->time_s, tap->z_mm);
  (void)fuzz::Good(files::ParseMovesCsv(parts[1], "tap.moves.csv", *tap));
  return 0;
}
