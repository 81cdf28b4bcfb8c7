// The study's virtual workshop: one printer, two filaments, three plates, two lights.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "sim/print/conditions.h"

namespace trammel::app {

struct StudyOptions {
  int seed = 1000;    ///< names the whole study, 0 ... 1e9
  int patterns = 27;  ///< prints for each plate and filament, 1 ... 999; the paper's
  std::vector<sim::Condition> conditions;
  std::filesystem::path folder;  ///< for the results of the scans
};

/// One print, scanned in each light that is asked for.
struct StudyPrint {
  sim::Plate plate = sim::Plate::kMatte;
  sim::Filament filament = sim::Filament::kBlack;
  int pattern = 0;
};

/// All prints of the study, the first pattern of all conditions before the second.
[[nodiscard]] std::vector<StudyPrint> StudyPrints(const StudyOptions& options);

/// Prints, scans and analyses; each result is a file of its own, written whole. What is there
/// already is not done again, so that a study that was cut off goes on where it was. The first
/// pattern of each condition is followed by the comparison with lines without pressure advance.
/// The truth is 31.5 ms with black filament and 33.5 ms with white: cubics through virtual prints
/// have their minima some ms above the truth, so that these come near where the paper's lie on
/// average (34.8 and 36.7 ms). Recordings stand below `folder`/work meanwhile. Safe on several
/// threads and in several processes for different prints. Errors: the folder or a result cannot be
/// written or read.
[[nodiscard]] Result<void> RunStudyPrint(const StudyOptions& options, const StudyPrint& print);

}  // namespace trammel::app
