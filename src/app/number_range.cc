#include "app/number_range.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <string>
#include <system_error>

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

CLI::Validator SeedNumber() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        std::uint64_t value = 0;
        const char* end = text.data() + text.size();
        const auto [rest, error] = std::from_chars(text.data(), end, value);
        if (error == std::errc() && rest == end) return {};
        return fmt::format("{} is no whole number in 0 … {}", text, UINT64_MAX);
      },
      "UINT");
}

}  // namespace trammel::app
