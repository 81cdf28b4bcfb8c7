// Pictures of a photographed part for the tests of surveys.
#pragma once

#include "base/page.h"
#include "base/random.h"
#include "part_alignment/survey/survey_world_test_support.h"
#include "part_alignment/targets/code_book.h"

namespace trammel::part_alignment::test {

/// The targets that a shot sees, discs of 13 mm, through a lens that bends nothing; noise of one
/// grey level. Numbers must be those of `book`.
[[nodiscard]] Page PictureOf(const SurveyWorld& world, const WorldShot& shot, const CodeBook& book,
                             Random& random);

/// Gives the ends of the bars numbers from `first` on, which the book has.
void NumberBarEnds(SurveyWorld& world, int first);

}  // namespace trammel::part_alignment::test
