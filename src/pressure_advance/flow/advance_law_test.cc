#include "pressure_advance/flow/advance_law.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

constexpr double kSlow_mm3_s = 0.55;  // 5 mm/s of the default's bead

std::vector<AdvanceValue> Values(const std::vector<double>& flows_mm3_s, double sigma_s,
                                 const std::function<double(double)>& stored_mm3) {
  std::vector<AdvanceValue> values;
  for (const double flow : flows_mm3_s) {
    const double value_s = (stored_mm3(flow) - stored_mm3(kSlow_mm3_s)) / (flow - kSlow_mm3_s);
    values.push_back({kSlow_mm3_s, flow, value_s, sigma_s});
  }
  return values;
}

std::vector<AdvanceValue> Noisy(std::vector<AdvanceValue> values, Random& random) {
  for (AdvanceValue& value : values) value.value_s += value.sigma_s * random.Normal();
  return values;
}

const std::vector<double> kThreeFlows = {6.6, 11, 16.6};

TEST(AdvanceLaw, FindsThePowerThatIsThere) {
  for (const double exponent : {0.3, 0.5, 0.7, 0.9}) {
    const auto values = Values(
        kThreeFlows, 1e-5, [&](double flow_mm3_s) { return 0.1 * std::pow(flow_mm3_s, exponent); });
    const AdvanceLaws laws = FitAdvanceLaws(values);
    ASSERT_TRUE(laws.exponent.good()) << laws.exponent.reason();
    EXPECT_NEAR(laws.exponent.quantity().value, exponent, 0.003);
    EXPECT_TRUE(laws.bends);
  }
}

TEST(AdvanceLaw, FindsTheFormAndTheNumbersThatFirmwareHas) {
  const auto tanh = Values({3, 6.6, 11, 16.6}, 1e-6, [](double flow_mm3_s) {
    return 0.02 * flow_mm3_s + 0.15 * std::tanh(flow_mm3_s / 4);
  });
  const auto reciprocal = Values({3, 6.6, 11, 16.6}, 1e-6, [](double flow_mm3_s) {
    return 0.02 * flow_mm3_s + 0.15 * (1 - 1 / (1 + flow_mm3_s / 4));
  });
  for (const auto& [values, form] :
       {std::pair{tanh, AdvanceForm::kTanh}, {reciprocal, AdvanceForm::kReciprocal}}) {
    const AdvanceLaws laws = FitAdvanceLaws(values);
    ASSERT_TRUE(laws.firmware);
    EXPECT_EQ(laws.firmware->form, form);
    EXPECT_NEAR(laws.firmware->linear_s, 0.02, 0.002);
    EXPECT_NEAR(laws.firmware->offset_mm3, 0.15, 0.015);
    EXPECT_NEAR(laws.firmware->shape, 4, 0.4);
    EXPECT_LT(laws.greatest_miss_s, 1e-4);
  }
}

TEST(AdvanceLaw, IntervalsOfTheExponentHoldItAndAStraightLawIsRarelySaidToBend) {
  constexpr int kWorlds = 400;
  for (const std::vector<double>& flows :
       {std::vector<double>{8, 16.6}, kThreeFlows, std::vector<double>{3, 6.6, 11, 16.6}}) {
    for (const double exponent : {0.3, 0.6, 0.8, 1.0}) {
      int held = 0, bent = 0;
      for (int world = 0; world < kWorlds; ++world) {
        Random random(9100 + static_cast<std::uint64_t>(world));
        const auto values = Noisy(Values(flows, 0.0008,
                                         [&](double flow_mm3_s) {
                                           return 0.04 * 11 * std::pow(flow_mm3_s / 11, exponent);
                                         }),
                                  random);
        const AdvanceLaws laws = FitAdvanceLaws(values);
        ASSERT_TRUE(laws.exponent.good()) << laws.exponent.reason();
        const Interval& interval = laws.exponent.quantity().interval95;
        held += interval.lo <= exponent && exponent <= interval.hi;
        bent += laws.bends;
      }
      EXPECT_GE(held, 0.93 * kWorlds) << flows.size() << " flows, " << exponent;
      if (exponent == 1) EXPECT_LE(bent, 0.07 * kWorlds) << flows.size();
    }
  }
}

// Between the flows that were measured the fitted law is no further off than the values.
TEST(AdvanceLaw, SaysTheValueBetweenTheFlowsOfWhateverExtruderItIs) {
  constexpr double kSigma_s = 0.0008;
  constexpr double kBetween_mm3_s = 8.5;
  const std::vector<std::function<double(double)>> extruders = {
      [](double q) { return 0.15 * std::pow(q, 0.4); },
      [](double q) { return 0.08 * std::pow(q, 0.7); },
      [](double q) { return 0.02 * q + 0.25 * std::tanh(q / 5); },
      [](double q) { return 0.015 * q + 0.3 * (1 - 1 / (1 + q / 3)); },
      [](double q) { return 0.2 * std::log(1 + q); }};
  constexpr int kWorlds = 200;
  for (std::size_t i = 0; i < extruders.size(); ++i) {
    const auto truth = Values({kBetween_mm3_s}, kSigma_s, extruders[i]).front();
    double squares = 0;
    int said = 0;
    for (int world = 0; world < kWorlds; ++world) {
      Random random(9200 + static_cast<std::uint64_t>(world));
      const AdvanceLaws laws =
          FitAdvanceLaws(Noisy(Values(kThreeFlows, kSigma_s, extruders[i]), random));
      if (!laws.firmware) continue;
      ++said;
      const double value_s = PressureAdvanceBetween(*laws.firmware, kSlow_mm3_s, kBetween_mm3_s);
      squares += (value_s - truth.value_s) * (value_s - truth.value_s);
    }
    EXPECT_GE(said, 0.9 * kWorlds) << "extruder " << i;
    EXPECT_LE(std::sqrt(squares / said), 1.2 * kSigma_s) << "extruder " << i;
  }
}

TEST(AdvanceLaw, WidensWhereValuesScatterBeyondTheirSigmas) {
  auto values = Values({3, 6.6, 11, 16.6}, 0.0005, [](double q) { return 0.04 * q; });
  const AdvanceLaws calm = FitAdvanceLaws(values);
  values[1].value_s += 0.006;
  values[2].value_s -= 0.006;
  const AdvanceLaws rough = FitAdvanceLaws(values);
  ASSERT_TRUE(calm.exponent.good());
  const Interval& narrow = calm.exponent.quantity().interval95;
  if (rough.exponent.good()) {
    const Interval& wide = rough.exponent.quantity().interval95;
    EXPECT_GT(wide.hi - wide.lo, 4 * (narrow.hi - narrow.lo));
  }
  EXPECT_FALSE(rough.bends);
}

TEST(AdvanceLaw, CannotTellFromTooLittle) {
  const auto straight = [](double q) { return 0.04 * q; };
  for (const auto& values : {std::vector<AdvanceValue>{}, Values({8}, 0.0008, straight),
                             Values({8, 8.1, 8.5}, 0.0008, straight)}) {
    const AdvanceLaws laws = FitAdvanceLaws(values);
    EXPECT_EQ(laws.exponent.verdict(), Verdict::kCannotTell);
    EXPECT_THAT(laws.exponent.reason(), HasSubstr("two flows"));
    EXPECT_FALSE(laws.bends);
  }
  const AdvanceLaws unsure = FitAdvanceLaws(Values({8, 12}, 0.05, straight));
  EXPECT_EQ(unsure.exponent.verdict(), Verdict::kCannotTell);
  EXPECT_THAT(unsure.exponent.reason(), HasSubstr("any law fits"));
  // Two flows tell that it bends, not how.
  const AdvanceLaws two =
      FitAdvanceLaws(Values({8, 16}, 0.0005, [](double q) { return 0.1 * std::sqrt(q); }));
  EXPECT_TRUE(two.bends);
  EXPECT_FALSE(two.firmware);
}

// Results are read from files: numbers that no printer has end in a verdict all the same.
TEST(AdvanceLaw, SurvivesNumbersThatNoPrinterHas) {
  for (const double value_s : {-1.0, 0.0, 1e-300, 1e300}) {
    for (const double sigma_s : {1e-300, 1e-12, 1e300}) {
      for (const double flow : {1e-9, 1.0, 1e200}) {
        const std::vector<AdvanceValue> values = {{0, flow, value_s, sigma_s},
                                                  {0, 2 * flow, value_s, sigma_s},
                                                  {flow, 4 * flow, value_s, sigma_s}};
        const AdvanceLaws laws = FitAdvanceLaws(values);
        if (!laws.exponent.good()) continue;
        const Interval& interval = laws.exponent.quantity().interval95;
        EXPECT_LE(interval.lo, laws.exponent.quantity().value);
        EXPECT_GE(interval.hi, laws.exponent.quantity().value);
      }
    }
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
