#include "app/study/study_paper.h"

#include <cstddef>

namespace trammel::app {
namespace {

// By plate (matte, textured, PEI), then black ambient, black dark, white ambient, white dark. The
// slope of each cubic vanishes at the minimum that the paper states beside it, to its last digit.
constexpr PaperFigures kPaper[3][4] = {{{0.00490492, {113, -5102, 102573, -5.20e5}, 0.79, 0.033},
                                        {0.00291268, {104, -3785, 59849, -1.37e5}, 0.79, 0.036},
                                        {0.00339450, {126, -4000, 35596, 2.23e5}, 0.91, 0.041},
                                        {0.00282440, {96, -3142, 34119, 1.19e5}, 0.90, 0.038}},
                                       {{0.00700020, {168, -4096, 77136, -3.70e5}, 0.54, 0.036},
                                        {0.00664765, {146, -3688, 64970, -2.54e5}, 0.78, 0.036},
                                        {0.00873800, {205, -5422, 84487, -2.20e5}, 0.68, 0.038},
                                        {0.00582500, {154, -4706, 89052, -3.88e5}, 0.77, 0.034}},
                                       {{0.00667616, {218, -9425, 181366, -8.88e5}, 0.63, 0.035},
                                        {0.00690000, {194, -9353, 205082, -1.25e6}, 0.63, 0.033},
                                        {0.00584705, {234, -10444, 203146, -1.06e6}, 0.64, 0.036},
                                        {0.00598616, {220, -11610, 261113, -1.70e6}, 0.71, 0.033}}};

}  // namespace

PaperFigures PaperOf(const sim::Condition& condition) {
  const std::size_t column =
      (condition.filament == sim::Filament::kWhite ? 2 : 0) + (condition.ambient ? 0 : 1);
  return kPaper[static_cast<std::size_t>(condition.plate)][column];
}

}  // namespace trammel::app
