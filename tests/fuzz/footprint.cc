// A print's G-code, of which the footprint is read.
#include <string_view>
#include <utility>

#include "fuzz.h"
#include "gcode/footprint_reader.h"

TRAMMEL_FUZZ_TARGET(footprint)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  constexpr gcode::PlateArea kPlate{-20, 0, 30, 40};
  constexpr double kLow_mm = 1;
  gcode::FootprintReader reader(kPlate, kLow_mm);
  std::string_view text = fuzz::Text(data, size);
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    if (!fuzz::Good(reader.Line(text.substr(0, end)))) return 0;
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  const auto print = std::move(reader).Done();
  if (!fuzz::Good(print)) return 0;
  const auto bounds = print->Bounds();
  fuzz::Require(bounds && !print->Clear(*bounds), "a print is not clear of itself");
  return 0;
}
