// A server's list of webcams: the printer's address, then the answer.
#include "machine/moonraker/webcam_list.h"

#include <nlohmann/json.hpp>

#include "fuzz.h"
#include "machine/camera/camera_url.h"
#include "machine/moonraker/moonraker_address.h"
#include "machine/moonraker/printer.h"

TRAMMEL_FUZZ_TARGET(webcam_list)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  auto address = machine::ParseMoonrakerAddress(parts[0]);
  if (!address) address = machine::ParseMoonrakerAddress("localhost");
  const auto answer = nlohmann::json::parse(parts[1], nullptr, false);
  for (const machine::Webcam& webcam : machine::ReadWebcams(answer, *address)) {
    (void)fuzz::Good(machine::ParseCameraUrl(webcam.stream_url));
  }
  return 0;
}
