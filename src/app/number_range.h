// A bound for numbers on the command line.
#pragma once

#include <CLI/CLI.hpp>

namespace trammel::app {

/// Refuses what does not lie in low … high, NaN included, which CLI::Range lets pass.
[[nodiscard]] CLI::Validator NumberIn(double low, double high);

}  // namespace trammel::app
