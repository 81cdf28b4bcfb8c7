#include "base/chi_square.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/check.h"

namespace trammel {
namespace {

TEST(ChiSquare, QuantilesAreThoseOfTheTables) {
  // Printed tables (Pearson & Hartley): 0.95 and 0.999.
  EXPECT_NEAR(ChiSquareQuantile(0.95, 1), 3.841459, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 9), 16.918978, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.999, 9), 27.877165, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.05, 9), 3.325113, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 100), 124.342113, 1e-4);
}

TEST(ChiSquare, TailsAreExactWithTwoDegreesAndFallWithTheValue) {
  EXPECT_NEAR(ChiSquareTail(2 * std::log(2.0), 2), 0.5, 1e-14);
  EXPECT_NEAR(ChiSquareTail(2 * std::log(1000.0), 2), 0.001, 1e-15);
  EXPECT_EQ(ChiSquareTail(std::numeric_limits<double>::infinity(), 3), 0);
}

TEST(ChiSquare, WithoutASumOrAFreedomNothingIsUnlikely) {
  EXPECT_EQ(ChiSquareTail(0, 3), 1);
  EXPECT_EQ(ChiSquareTail(std::numeric_limits<double>::quiet_NaN(), 3), 1);
  EXPECT_EQ(ChiSquareTail(100, 0), 1);
  EXPECT_THROW((void)ChiSquareQuantile(0.95, 0), Bug);
}

}  // namespace
}  // namespace trammel
