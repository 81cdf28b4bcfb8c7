// Dirt of the paper: specks, hairs, the creases of folds.
#pragma once

#include <vector>

#include "base/random.h"
#include "sim/sheet/sheet_paper.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// Appends paper.dirt_count specks over and around the strokes, hairs across them, and the folds'
/// creases.
void AddDirt(const SheetPaper& paper, Random random, std::vector<InkStroke>& strokes);

}  // namespace trammel::sim
