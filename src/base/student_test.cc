#include "base/student.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/statistics.h"

namespace trammel {
namespace {

TEST(StudentTail, IsThatOfTheTables) {
  // Printed tables (Fisher & Yates): two-sided 0.05, 0.01 and 0.001.
  EXPECT_NEAR(StudentTail(12.7062, 1), 0.05, 1e-6);
  EXPECT_NEAR(StudentTail(-4.0321, 5), 0.01, 1e-6);
  EXPECT_NEAR(StudentTail(3.8495, 20), 0.001, 1e-6);
  EXPECT_NEAR(StudentTail(1, 1), 0.5, 1e-14);  // Cauchy's quartile
}

TEST(StudentTail, AgreesWithThe95PercentPoint) {
  for (const double freedom : {1.0, 2.5, 7.0, 99.0, 1000.0}) {
    EXPECT_NEAR(StudentTail(StudentT95(freedom), freedom), 0.05, 1e-7) << freedom;
    EXPECT_NEAR(StudentPoint(0.05, freedom), StudentT95(freedom), 1e-6) << freedom;
  }
}

TEST(StudentTail, OfNothingIsCertainAndOfInfinityNone) {
  EXPECT_EQ(StudentTail(0, 3), 1);
  EXPECT_EQ(StudentTail(std::numeric_limits<double>::infinity(), 3), 0);
  EXPECT_EQ(StudentTail(std::numeric_limits<double>::quiet_NaN(), 3), 1);
}

}  // namespace
}  // namespace trammel
