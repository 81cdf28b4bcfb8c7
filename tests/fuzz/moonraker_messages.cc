// Whatever a Moonraker sends: answers, notifications, status updates, moves, requests.
#include <cmath>
#include <nlohmann/json.hpp>

#include "fuzz.h"
#include "machine/moonraker/moonraker_printer_impl.h"
#include "scripted_connection.h"

namespace {

using namespace trammel;

/// No wait is ever worth it: all that comes has come.
machine::WaitLimit Now() { return {1e-9, {}}; }

void RequireSense(const machine::PrinterState& state) {
  for (const double position_mm : state.position_mm) {
    fuzz::Require(std::isfinite(position_mm), "a position is finite");
  }
  for (const auto& [name, heater] : state.heaters) {
    fuzz::Require(std::isfinite(heater.temperature_c) && std::isfinite(heater.target_c),
                  "a temperature is finite");
  }
}

}  // namespace

TRAMMEL_FUZZ_TARGET(moonraker_messages)(const std::uint8_t* data, std::size_t size) {
  fuzz::SetMessages(fuzz::Text(data, size));
  machine::MoonrakerPrinter printer(*machine::ParseMoonrakerAddress("localhost"), {});
  printer.OnMessage([](const std::string&) {});
  printer.OnRequest([](const std::string& method, const nlohmann::json& params) {
    return method == "status" ? machine::RpcAnswer{.result = params}
                              : machine::RpcAnswer::UnknownMethod(method);
  });
  (void)fuzz::Good(printer.Start(Now()));
  (void)fuzz::Good(printer.RegisterRemoteMethod(
      "trammel_call", [](const nlohmann::json&) {}, Now()));
  (void)fuzz::Good(printer.Run("G28\nLASER_ON", Now()));
  if (fuzz::Good(printer.RecordMoves(Now()))) (void)fuzz::Good(printer.Moves(0, 1, Now()));
  const auto state = printer.State(Now());
  if (fuzz::Good(state)) RequireSense(*state);
  const auto clock = printer.Clock(1, Now());
  if (fuzz::Good(clock)) (void)clock->PrintTimeBound(0);
  (void)fuzz::Good(printer.HasCommand("laser_on", Now()));
  (void)fuzz::Good(printer.Webcams(Now()));
  RequireSense(printer.LastState());
  return 0;
}
