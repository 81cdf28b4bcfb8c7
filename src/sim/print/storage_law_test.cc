#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/check.h"
#include "sim/print/printer_traits.h"

namespace trammel::sim {
namespace {

std::vector<StorageLaw> AllLaws() {
  return {{StorageKind::kLinear, 0.04, 1, 0, 1},
          {StorageKind::kPower, 0.15, 0.4, 0, 1},
          {StorageKind::kPower, 0.05, 0.85, 0, 1},
          {StorageKind::kTanh, 0.06, 1, 0.7, 1.5},
          {StorageKind::kReciprocal, 0.06, 1, 0.95, 0.3}};
}

TEST(StorageLaw, FlowFromStoredUndoesStored) {
  // Newton stops at 1e-12 of the flow; the power law rounds in two calls of pow.
  constexpr double kRelative = 1e-10;
  for (const StorageLaw& law : AllLaws()) {
    for (const double flow : {1e-3, 0.23, 1.0, 6.9, 40.0}) {
      EXPECT_NEAR(FlowFromStored(law, Stored(law, flow)).flow_mm_s, flow, kRelative * flow)
          << ToString(law.kind);
      EXPECT_NEAR(FlowFromStored(law, Stored(law, -flow)).flow_mm_s, -flow, kRelative * flow)
          << ToString(law.kind);
    }
    EXPECT_EQ(FlowFromStored(law, 0).flow_mm_s, 0);
  }
}

TEST(StorageLaw, SlopeIsTheFlowsDerivative) {
  // Central differences with a relative step of 1e-5 err by about 1e-10 of the value.
  constexpr double kRelative = 1e-6;
  for (const StorageLaw& law : AllLaws()) {
    for (const double flow : {0.23, 6.9}) {
      const double stored = Stored(law, flow);
      const double step = 1e-5 * stored;
      const double slope = (FlowFromStored(law, stored + step).flow_mm_s -
                            FlowFromStored(law, stored - step).flow_mm_s) /
                           (2 * step);
      EXPECT_NEAR(FlowFromStored(law, stored).slope_per_s, slope, kRelative * slope)
          << ToString(law.kind);
    }
  }
}

TEST(StorageLaw, IdealPressureAdvanceIsTheChordOfEachLaw) {
  // Worked by hand between 1 and 4 mm/s.
  const StorageLaw linear{StorageKind::kLinear, 0.04, 1, 0, 1};
  EXPECT_NEAR(IdealPressureAdvance(linear, 1, 4), 0.04, 1e-15);
  const StorageLaw power{StorageKind::kPower, 0.09, 0.5, 0, 1};
  EXPECT_NEAR(IdealPressureAdvance(power, 1, 4), 0.09 * (2 - 1) / 3, 1e-15);
  const StorageLaw tanh_law{StorageKind::kTanh, 0.1, 1, 0.6, 2};
  EXPECT_NEAR(IdealPressureAdvance(tanh_law, 1, 4),
              0.1 * (0.4 * 3 + 0.6 * 2 * (std::tanh(2.0) - std::tanh(0.5))) / 3, 1e-15);
  const StorageLaw reciprocal{StorageKind::kReciprocal, 0.1, 1, 0.6, 2};
  EXPECT_NEAR(IdealPressureAdvance(reciprocal, 1, 4),
              0.1 * (0.4 * 3 + 0.6 * 2 * (4.0 / 6 - 1.0 / 3)) / 3, 1e-15);
}

TEST(StorageLaw, ScaledToReachesTheWantedTruthAtAnySpeeds) {
  constexpr double kRelative = 1e-12;
  for (const StorageLaw& law : AllLaws()) {
    for (const double k_star_s : {1e-4, 0.036, 1.0}) {
      for (const double fast : {0.01, 7.0, 100.0}) {
        const StorageLaw scaled = ScaledTo(law, k_star_s, 0.1 * fast, fast);
        EXPECT_NEAR(IdealPressureAdvance(scaled, 0.1 * fast, fast), k_star_s, kRelative * k_star_s);
        EXPECT_NEAR(IdealPressureAdvance(ScaledTo(law, k_star_s, 0, fast), 0, fast), k_star_s,
                    kRelative * k_star_s);
      }
    }
  }
  EXPECT_THROW((void)ScaledTo({}, 0.036, 5, 5), Bug);
  EXPECT_THROW((void)ScaledTo({}, 0, 1, 5), Bug);
}

}  // namespace
}  // namespace trammel::sim
