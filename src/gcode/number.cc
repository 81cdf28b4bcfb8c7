#include "gcode/number.h"

#include <fmt/format.h>

#include <cmath>

#include "base/check.h"

namespace trammel::gcode {

std::string FormatNumber(double value, int decimals) {
  TRAMMEL_CHECK(std::isfinite(value) && std::abs(value) < 1e12 && decimals >= 0 && decimals <= 9,
                "value = {}, decimals = {}", value, decimals);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

}  // namespace trammel::gcode
