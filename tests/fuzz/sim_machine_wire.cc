// Bytes between the virtual printer and its camera.
#include <cmath>

#include "fuzz.h"
#include "sim/camera/machine_wire.h"

TRAMMEL_FUZZ_TARGET(sim_machine_wire)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view bytes = fuzz::Text(data, size);
  const auto question = sim::DecodeQuestion(bytes);
  if (fuzz::Good(question)) {
    fuzz::Require(sim::Encode(*question) == bytes, "a question has one form");
  }
  const auto world = sim::DecodeWorld(bytes);
  if (fuzz::Good(world)) fuzz::Require(sim::Encode(*world) == bytes, "a world has one form");
  const auto view = sim::DecodeView(bytes);
  if (fuzz::Good(view))
    fuzz::Require(fuzz::Good(sim::DecodeView(sim::Encode(*view))), "a view too");
  const auto bed = sim::DecodeBed(bytes);
  if (fuzz::Good(bed)) fuzz::Require(fuzz::Good(sim::DecodeBed(sim::Encode(*bed))), "and a bed");
  return 0;
}
