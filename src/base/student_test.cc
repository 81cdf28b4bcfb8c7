#include "base/student.h"

#include <gtest/gtest.h>

#include "base/statistics.h"

namespace trammel {
namespace {

TEST(StudentPoint, IsThatOfTheTables) {
  // Printed tables (Fisher & Yates): two-sided 0.05, 0.01 and 0.001.
  EXPECT_NEAR(StudentPoint(0.05, 1), 12.7062, 1e-4);
  EXPECT_NEAR(StudentPoint(0.01, 5), 4.0321, 1e-4);
  EXPECT_NEAR(StudentPoint(0.001, 20), 3.8495, 1e-4);
  EXPECT_NEAR(StudentPoint(0.5, 1), 1, 1e-12);  // Cauchy's quartile
  for (const double freedom : {1.0, 2.5, 7.0, 99.0, 1000.0}) {
    EXPECT_NEAR(StudentPoint(0.05, freedom), StudentT95(freedom), 1e-6) << freedom;
  }
  EXPECT_NEAR(StudentPoint(0.05, 1e6), kNormal95, 1e-5);
}

}  // namespace
}  // namespace trammel
