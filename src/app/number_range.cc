#include "app/number_range.h"

#include <fmt/format.h>

#include <string>

namespace trammel::app {

CLI::Validator NumberIn(double low, double high) {
  return CLI::Validator(
      [low, high](const std::string& text) -> std::string {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return {};
        return fmt::format("{} is no number in {} … {}", text, low, high);
      },
      fmt::format("FLOAT in {} … {}", low, high));
}

}  // namespace trammel::app
