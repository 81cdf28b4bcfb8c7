// An upload to the virtual Moonraker: the content type, then the body.
#include "fuzz.h"
#include "sim/moonraker/multipart.h"

TRAMMEL_FUZZ_TARGET(sim_multipart)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  const auto form = sim::ParseMultipart(parts[0], parts[1]);
  if (!fuzz::Good(form)) return 0;
  std::size_t bytes = 0;
  for (const sim::FormPart& part : *form) bytes += part.body.size();
  fuzz::Require(bytes <= parts[1].size(), "parts are no longer than what brought them");
  return 0;
}
