// What clients ask of the virtual camera, and the target of a request to the virtual Moonraker.
#include <string>

#include "fuzz.h"
#include "sim/camera/camera_headers.h"
#include "sim/moonraker/http_api.h"

TRAMMEL_FUZZ_TARGET(sim_camera_request)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string text(fuzz::Text(data, size));
  (void)sim::ParseTarget(std::string_view(text));
  const sim::Target target = sim::ParseTarget(text);
  fuzz::Require(target.path.size() <= text.size(), "a path is part of its target");
  return 0;
}
