#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>

#include "pressure_advance/response/storage_fit.h"

namespace trammel::pressure_advance {
namespace {

BudgetedValue Value(double value_s, double sigma_s) {
  BudgetedValue value{value_s, {}};
  value.budget.lines = sigma_s * sigma_s;
  return value;
}

CombinedTransitions Crossings(double value_s, double sigma_s) {
  CombinedTransitions crossings;
  crossings.whole = crossings.first = crossings.second = Value(value_s, sigma_s);
  crossings.freedom = 7;
  crossings.tested = {0, 0.06};
  crossings.widest = 0.2;
  return crossings;
}

StorageFit FittedStorage(double value_s, double sigma_s) {
  StorageFit law;
  law.pressure_advance_s = value_s;
  law.sigma_s = sigma_s;
  law.lag_scatter_s = 0.0005;
  law.lines = 10;
  law.slip = {0.002, 0.005};
  law.fast_lag_s = {0.02, 0.0006};
  return law;
}

TEST(WeighStorage, TakesOffWhatCrossingsErrByOnLinesOfTheLaw) {
  // Crossings and their mirror image both stand 1 ms above the law: that much they err by.
  CombinedTransitions crossings = Crossings(0.034, 0.0005);
  WeighWithStorage(FittedStorage(0.033, 0.0005), Crossings(0.034, 0.0005), {}, crossings);
  ASSERT_TRUE(crossings.both.pressure_advance.good());
  EXPECT_NEAR(crossings.both.pressure_advance.quantity().value, 0.033, 1e-9);
  EXPECT_NEAR(crossings.acceleration.quantity().value, 0.033, 1e-9);
  EXPECT_NEAR(crossings.acceleration_shift_s, -0.001, 1e-9);
  EXPECT_TRUE(crossings.notices.empty());
}

TEST(WeighStorage, LeansOnTheLawAsFarAsItIsTheSurer) {
  const auto answer = [](double crossing_sigma_s, double law_sigma_s) {
    // The mirror image says that the crossings do not err.
    CombinedTransitions crossings = Crossings(0.0335, crossing_sigma_s);
    WeighWithStorage(FittedStorage(0.033, law_sigma_s), Crossings(0.0325, crossing_sigma_s), {},
                     crossings);
    return crossings.both.pressure_advance.quantity().value;
  };
  EXPECT_NEAR(answer(0.003, 0.0003), 0.0335 - StorageOptions{}.max_weight * 0.0005, 2e-5);
  EXPECT_GT(answer(0.0004, 0.003), 0.0334);
}

TEST(WeighStorage, CountsTheCrossingsAloneWhereNeighbouringLinesRefuteTheLaw) {
  const auto answer = [](double shared_misfit) {
    StorageFit law = FittedStorage(0.033, 0.0005);
    law.shared_misfit = shared_misfit;
    CombinedTransitions crossings = Crossings(0.036, 0.0008);
    crossings.whole->budget.drift = 1e-6;
    WeighWithStorage(law, Crossings(0.036, 0.0008), {}, crossings);
    return crossings;
  };
  const StorageOptions options;
  const CombinedTransitions trusted = answer(options.trusted_misfit);
  const CombinedTransitions refuted = answer(options.refuted_misfit);
  const CombinedTransitions between =
      answer(std::midpoint(options.trusted_misfit, options.refuted_misfit));
  EXPECT_NEAR(trusted.whole->value_s, 0.033, 1e-9);
  EXPECT_TRUE(trusted.notices.empty());
  EXPECT_EQ(trusted.whole->budget.drift, 0);
  EXPECT_NEAR(refuted.whole->value_s, 0.036, 1e-12);
  EXPECT_NEAR(refuted.acceleration.quantity().value, 0.036, 1e-12);
  EXPECT_EQ(refuted.whole->budget.drift, 1e-6);
  ASSERT_FALSE(refuted.notices.empty());
  EXPECT_NE(refuted.notices[0].find("another law"), std::string::npos);
  EXPECT_GT(between.whole->value_s, 0.0335);
  EXPECT_LT(between.whole->value_s, 0.0355);
}

TEST(WeighStorage, LeavesAPartOfTheValueOpenForOtherLaws) {
  constexpr double kSure_s = 1e-7;
  CombinedTransitions crossings = Crossings(0.033, kSure_s);
  WeighWithStorage(FittedStorage(0.033, kSure_s), Crossings(0.033, kSure_s), {}, crossings);
  const StorageOptions options;
  EXPECT_NEAR(crossings.acceleration.quantity().standard_uncertainty, options.form_sigma * 0.033,
              1e-6);
  // Crossings and fit err by other laws in ways of their own, and are weighed by that.
  EXPECT_NEAR(crossings.both.pressure_advance.quantity().standard_uncertainty,
              0.033 * options.form_sigma * options.law_form_sigma /
                  std::hypot(options.form_sigma, options.law_form_sigma),
              1e-6);
}

TEST(WeighStorage, WidensAndSaysSoWhereTheTransitionsStillDiffer) {
  const auto weighed = [](double apart_s, double twins_apart_s) {
    CombinedTransitions crossings = Crossings(0.033, 0.0005);
    crossings.first->value_s += apart_s / 2;
    crossings.second->value_s -= apart_s / 2;
    CombinedTransitions twin = Crossings(0.033, 0.0005);
    twin.first->value_s += twins_apart_s / 2;
    twin.second->value_s -= twins_apart_s / 2;
    WeighWithStorage(FittedStorage(0.033, 0.0005), twin, {}, crossings);
    return crossings;
  };
  // Lines of the law have crossings that are as far apart: the law explains it.
  EXPECT_TRUE(weighed(0.008, 0.008).notices.empty());
  const CombinedTransitions apart = weighed(0.008, -0.008);
  ASSERT_EQ(apart.notices.size(), 1U);
  EXPECT_NE(apart.notices[0].find("the acceleration (0.0370 s)"), std::string::npos);
  EXPECT_GT(apart.both.pressure_advance.quantity().standard_uncertainty,
            2 * weighed(0, 0).both.pressure_advance.quantity().standard_uncertainty);
}

}  // namespace
}  // namespace trammel::pressure_advance
