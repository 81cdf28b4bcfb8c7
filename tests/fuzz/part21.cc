// The frame of a STEP file: what passes ends as it must, and has what it refers to.
#include "machine/cad/part21.h"

#include <string_view>

#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(part21)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  const auto checked = machine::CheckPart21(text);
  if (!fuzz::Good(checked)) return 0;
  fuzz::Require(machine::LooksLikePart21(text), "what passes begins as a STEP file");
  fuzz::Require(text.find("END-ISO-10303-21") != std::string_view::npos, "and has its end");
  return 0;
}
