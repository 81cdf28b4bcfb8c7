// Shared support of the surveys' tests.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>

#include "base/statistics.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/survey/survey_world_test_support.h"
#include "support/matchers.h"

namespace trammel::part_alignment {

inline test::SurveyScene SmallScene() {
  test::SurveyScene scene;
  scene.codes = 40;
  scene.pictures = 40;
  return scene;
}

inline test::SurveyWorld SmallWorld(std::uint64_t seed) {
  return test::MakeSurveyWorld(SmallScene(), seed);
}

inline Survey Solved(const SurveyInput& input) { return Must(SolveSurvey(input, {})); }

/// True if the coordinates' errors exceed the covariance, by a chance of 1e-5.
inline bool IsWrong(const test::SurveyWorld& world, const Survey& survey) {
  const auto errors = test::ErrorsOf(world, survey);
  return errors.nees > ChiSquareQuantile(1 - 1e-5, errors.freedom);
}

}  // namespace trammel::part_alignment
