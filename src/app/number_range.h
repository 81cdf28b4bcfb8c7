// Bounds for numbers on the command line.
#pragma once

#include <CLI/CLI.hpp>

namespace trammel::app {

/// Refuses what does not lie in low … high, NaN included, which CLI::Range lets pass.
[[nodiscard]] CLI::Validator NumberIn(double low, double high);

/// Refuses what is no whole number from 0 to 2^64 - 1: CLI11 turns -1 into the largest.
[[nodiscard]] CLI::Validator SeedNumber();

}  // namespace trammel::app
