// Tables 4 to 6 of Mendikute et al. 2017 with our budget beside, and their gauging, simulated.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "part_alignment/budget/budget.h"

namespace trammel::part_alignment {

/// One axis; µm as the paper prints them, standard uncertainties but for the totals (k = 2).
struct StudyRow {
  char axis = 'X';
  double paper_out_um = 0;  ///< 0 in table 4, which has none
  double paper_ip_um = 0;
  double paper_it_um = 0;
  double paper_total_um = 0;
  double paper_sum_um = 0;  ///< 2 · root sum of squares of the paper's own three
  double out_um = 0;        ///< ours
  double ip_um = 0;
  double it_um = 0;
  double total_um = 0;
  double simulated_um = 0;  ///< half of the simulation's 95 % interval
};

struct StudyTable {
  std::string title;
  std::vector<StudyRow> rows;
  std::vector<std::string> notes;  ///< assumptions, and the paper's slips
};

/// What the paper does not print (where the frame's origin is, that poses add to targets) is chosen
/// and said in the notes. Errors: those of MakeBudget.
[[nodiscard]] Result<std::vector<StudyTable>> BudgetTables(int trials, Random& random);

/// A part that is gauged with a probe after each of several alignments.
struct GaugingScene {
  BudgetScene scene;
  int points = 10;  ///< at far corners of the box, along x, y and z in turn
  int measurements = 10;
  double probe_sigma_mm = 0.002;  ///< of the probe and the machine, each touch
};

/// Over many repeats of the whole experiment. The error out of the machine belongs to a point and
/// stays from measurement to measurement; pose and temperature are drawn for each.
struct GaugingResult {
  double two_sigma_mm = 0;  ///< median of 2 σ of all probing errors
  double two_sigma_low_mm = 0;
  double two_sigma_high_mm = 0;  ///< 95 % of the repeats lie between
  double largest_mm = 0;         ///< median of the largest error's size
  double within = 0;             ///< share of repeats whose errors all stay within the limit
};
/// Errors: those of MakeBudget. REQUIRES repeats >= 1, points and measurements >= 1.
[[nodiscard]] Result<GaugingResult> SimulateGauging(const GaugingScene& gauging, double limit_mm,
                                                    int repeats, Random& random);

/// The paper's laboratory (1.5 x 1 x 0.5 m, measured along Z) and industrial (10 x 3 x 5 m, along
/// Y) scenes, as BudgetTables has them.
[[nodiscard]] BudgetScene PaperLaboratory();
[[nodiscard]] BudgetScene PaperIndustry();
/// The same with Table 3's angles, which do not shrink with the part.
[[nodiscard]] BudgetScene PaperIndustryWithLaboratoryAngles();

}  // namespace trammel::part_alignment
