#include "part_alignment/budget/budget_study.h"

#include <gtest/gtest.h>

namespace trammel::part_alignment {
namespace {

TEST(BudgetStudy, SaysWhereThePapersOwnSumsAreOff) {
  Random random(101);
  const auto tables = BudgetTables(0, random);
  ASSERT_TRUE(tables) << tables.error().message;
  ASSERT_EQ(tables->size(), 4U);
  // Table 4 is consistent to its last digit, Table 5's X is not.
  for (const StudyRow& row : (*tables)[0].rows)
    EXPECT_NEAR(row.paper_sum_um, row.paper_total_um, 0.1);
  EXPECT_NEAR((*tables)[1].rows[0].paper_sum_um, 148.6, 0.05);
  EXPECT_NEAR((*tables)[1].rows[1].paper_sum_um, 151.8, 0.05);
  for (const StudyRow& row : (*tables)[2].rows)
    EXPECT_NEAR(row.paper_sum_um, row.paper_total_um, 0.2);
}

TEST(BudgetStudy, TermsWithAStatedFormulaAreReproduced) {
  Random random(102);
  const auto tables = BudgetTables(0, random);
  ASSERT_TRUE(tables);
  for (const StudyRow& row : (*tables)[0].rows) EXPECT_NEAR(row.it_um, row.paper_it_um, 0.06);
  EXPECT_NEAR((*tables)[2].rows[0].out_um, 144.3, 0.05);
  EXPECT_NEAR((*tables)[2].rows[1].out_um, 63.5, 0.05) << "not the paper's 89.3";
  EXPECT_NEAR((*tables)[2].rows[2].out_um, 86.6, 0.05) << "not the paper's 112.4";
  // The geometry is not printed: within a third of the paper's figures in the laboratory.
  for (const StudyRow& row : (*tables)[0].rows) {
    EXPECT_NEAR(row.ip_um / row.paper_ip_um, 1, 0.34) << row.axis;
  }
}

TEST(Gauging, WithoutErrorsOutOfTheMachineTheScatterIsThePosesOwn) {
  GaugingScene gauging;
  gauging.scene = PaperLaboratory();
  gauging.scene.out_sigma_mm = Eigen::Vector3d(0, 0, 0);
  gauging.scene.temperature_half_width_k = 0;
  gauging.scene.target_sigma_mm.setConstant(1e-6);
  gauging.scene.pose_sigma.setZero();
  gauging.probe_sigma_mm = 0.005;
  Random random(103);
  const auto result = SimulateGauging(gauging, 0.03, 300, random);
  ASSERT_TRUE(result);
  // 2 σ of 100 normal numbers, to 1 / sqrt(200) of itself each and a tenth of it in the median.
  EXPECT_NEAR(result->two_sigma_mm, 0.010, 0.0005);
  EXPECT_GT(result->within, 0.99);
}

TEST(Gauging, ComesOutAsThePaperSawIt) {
  GaugingScene gauging;
  gauging.scene = PaperLaboratory();
  Random random(104);
  const auto laboratory = SimulateGauging(gauging, 0.15, 500, random);
  ASSERT_TRUE(laboratory);
  EXPECT_LT(laboratory->two_sigma_low_mm, 0.10);
  EXPECT_GT(laboratory->two_sigma_high_mm, 0.09);
  EXPECT_GT(laboratory->within, 0.5);
}

}  // namespace
}  // namespace trammel::part_alignment
