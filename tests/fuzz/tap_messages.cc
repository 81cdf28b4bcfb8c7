// Whatever a Moonraker sends to who waits for taps, behind the first byte.
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz.h"
#include "machine/moonraker/tap_stream.h"
#include "scripted_connection.h"

TRAMMEL_FUZZ_TARGET(tap_messages)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  if (size == 0) return 0;
  fuzz::SetMessages(fuzz::Text(data + 1, size - 1));
  machine::TapStreamOptions options;
  options.remote_method = "trammel_tap";
  const machine::TapStreamEvents events{
      .on_tap = [](const nlohmann::json& tap,
                   double) { fuzz::Require(tap.is_object(), "a tap is an object"); },
      .on_firmware_z = [](double z_mm,
                          double) { fuzz::Require(std::isfinite(z_mm), "a height is finite"); },
      .on_call = [](const nlohmann::json&, double) {},
      .on_news = [](const std::string&) {},
  };
  auto stream = machine::OpenTapStream(options, events, {1e-9, {}});
  if (!fuzz::Good(stream)) return 0;
  (*stream)->Send("TRAMMEL_TAP");
  const auto nozzle_c = (*stream)->NozzleTemperature();
  fuzz::Require(!nozzle_c || std::isfinite(*nozzle_c), "a temperature is finite");
  return 0;
}
