// Addresses of printers and of cameras, as people and servers write them.
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz.h"
#include "machine/camera/camera_url.h"
#include "machine/moonraker/moonraker_address.h"

TRAMMEL_FUZZ_TARGET(addresses)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string text(fuzz::Text(data, size));
  (void)machine::IsHttpUrl(text);
  const auto url = machine::ParseCameraUrl(text);
  if (fuzz::Good(url)) {
    (void)nlohmann::json(url->ToString()).dump();  // which throws unless it is UTF-8
    const auto again = machine::ParseCameraUrl(url->Address());
    fuzz::Require(fuzz::Good(again), "a camera's address can be read as it is written");
    fuzz::Require(again->host == url->host && again->port == url->port, "and names the same place");
  }
  const auto address = machine::ParseMoonrakerAddress(text);
  if (!fuzz::Good(address)) return 0;
  const auto again = machine::ParseMoonrakerAddress(address->WebSocketUrl());
  fuzz::Require(fuzz::Good(again), "a printer's address can be read as it is shown");
  fuzz::Require(again->host == address->host && again->port == address->port &&
                    again->unix_path == address->unix_path,
                "and names the same place");
  if (address->transport != machine::Transport::kUnix) {
    (void)address->HttpUrl();
    (void)address->Authority();
  }
  return 0;
}
