// {name} in the user's own G-code.
#include "gcode/placeholders.h"

#include <array>

#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(placeholders)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::array<gcode::Placeholder, 2> known = {{{"bed", "60"}, {"a", "{bed}"}}};
  (void)fuzz::Good(gcode::ExpandPlaceholders(fuzz::Text(data, size), known));
  return 0;
}
