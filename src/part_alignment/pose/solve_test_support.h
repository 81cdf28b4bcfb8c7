// Shared support of Solve's tests.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>

#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

constexpr double kSigma_px = 0.05;

/// Pixels alone: what the tests of residuals, ranks and figures count on.
inline SolveOptions Exact() {
  SolveOptions options;
  options.inputs = ExactInputs();
  return options;
}

inline Alignment Solved(const test_support::AlignmentWorld& world, const SolveOptions& options) {
  const auto alignment = Solve(MeasurementOf(world, kSigma_px), options);
  EXPECT_TRUE(alignment) << (alignment ? "" : alignment.error().message);
  return alignment.value_or(Alignment{});
}

/// Returns the error of the part's position and angles: mm, rad.
inline Eigen::Matrix<double, 6, 1> PartError(const test_support::AlignmentWorld& world,
                                             const Alignment& alignment) {
  Eigen::Matrix<double, 6, 1> error;
  error << alignment.machine_from_part.translation_mm - world.machine_from_part.translation_mm,
      alignment.machine_from_part.angles_rad - world.machine_from_part.angles_rad;
  return error;
}

inline test_support::AlignmentWorld Pictured(test_support::AlignmentWorld world,
                                             double sigma_px = 0, std::uint64_t seed = 1) {
  Random random(seed);
  TakePictures(world, sigma_px, random);
  return world;
}

}  // namespace trammel::part_alignment
