#include "pressure_advance/response/flow_ratio.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

constexpr double kCommandedArea_mm2 = 0.11;
constexpr double kScaleShare = 0.006;  // of areas, 1 sigma

// Lines as the preset quick has them, and one with a steady fast stretch.
struct FlowScan {
  LineMotion motion;
  FlowPremises premises;
};

FlowScan FlowScanOf(bool steady_middle = false) {
  FlowScan scan;
  scan.motion = {{{0.16, 10}, {0.6, 150}, {0.24, 10}}, 25.0, 3000.0};
  if (steady_middle) scan.motion = {{{0.25, 10}, {0.5, 50}, {0.25, 10}}, 100.0, 3000.0};
  scan.premises = {kCommandedArea_mm2, HeightScale{40, 1 / 40.0, 0.0045, kScaleShare}, true};
  return scan;
}

/// What is laid and read, over the commanded area.
struct FlowWorld {
  double laid = 1;
  double slip = 0;        ///< of the fast segment
  double scatter = 0.01;  ///< of the lines, greatest
  double tilt = 0;        ///< change of area and height over the pattern
  std::size_t lines = 10;
};

// Lines whose offsets are fixed and sum to about zero: the mean is the laid share.
std::vector<LineProfile> FlowLines(const FlowWorld& world, const LineMotion& motion) {
  constexpr std::array kOff = {0.3, -0.7, 0.9, -0.2, -0.5, 0.6, -1.0, 0.4, 0.8, -0.6};
  std::vector<LineProfile> lines;
  for (std::size_t i = 0; i < world.lines; ++i) {
    LineProfile line;
    line.pressure_advance_s = 0.06 * static_cast<double>(i) / 9;
    const double along = static_cast<double>(i) / static_cast<double>(world.lines - 1) - 0.5;
    const double level =
        world.laid * (1 + world.scatter * kOff[i % kOff.size()]) * (1 + world.tilt * along);
    const double begin_mm = motion.segments[0].fraction * *motion.length_mm;
    const double end_mm = begin_mm + motion.segments[1].fraction * *motion.length_mm;
    for (double at_mm = 1; at_mm < *motion.length_mm - 0.5; at_mm += 0.5) {
      const bool fast = at_mm >= begin_mm && at_mm <= end_mm;
      ProfileSample sample;
      sample.position = at_mm;
      sample.area = {kCommandedArea_mm2 * level * (fast ? 1 - world.slip : 1), 0.002};
      sample.height = {0.25 * (1 + 0.8 * world.tilt * along + 0.002 * kOff[i % kOff.size()]),
                       0.002};
      line.samples.push_back(sample);
    }
    lines.push_back(line);
  }
  return lines;
}

FlowRatio EstimateFlow(const FlowWorld& world, const FlowScan& scan = FlowScanOf(),
                       const std::optional<AreaReading>& reading = AreaReading{1, 0.003, true}) {
  return EstimateFlowRatio(FlowLines(world, scan.motion), scan.motion, scan.premises, reading);
}

TEST(FlowRatio, IsAboveOneWhereThePrinterLaysTooLittle) {
  for (const double laid : {0.97, 1.0, 1.04}) {
    const FlowRatio flow = EstimateFlow({.laid = laid});
    ASSERT_TRUE(flow.ratio.good()) << flow.ratio.reason();
    const Quantity& ratio = flow.ratio.quantity();
    EXPECT_NEAR(ratio.value, 1 / laid, 0.003);
    EXPECT_LT(ratio.interval95.lo, 1 / laid);
    EXPECT_GT(ratio.interval95.hi, 1 / laid);
    EXPECT_LT(ratio.interval95.hi - ratio.interval95.lo, 0.04);
  }
  EXPECT_GT(EstimateFlow({.laid = 0.97}).ratio.quantity().interval95.lo, 1);
  EXPECT_LT(EstimateFlow({.laid = 1.04}).ratio.quantity().interval95.hi, 1);
}

TEST(FlowRatio, HasTheUncertaintiesOfLinesScaleReadingAndWander) {
  const FlowRatio flow = EstimateFlow({}, FlowScanOf(), std::nullopt);
  ASSERT_TRUE(flow.ratio.good()) << flow.ratio.reason();
  const FlowBudget& parts = flow.budget;
  const double total =
      std::hypot(std::hypot(parts.lines, parts.wander), std::hypot(parts.scale, parts.reading));
  EXPECT_NEAR(flow.ratio.quantity().standard_uncertainty, total * flow.ratio.quantity().value,
              1e-9);
  EXPECT_NEAR(parts.scale, kScaleShare, 1e-12);
  EXPECT_NEAR(parts.lines, 0.0067 / std::sqrt(10), 0.001);  // scatter of the offsets
  EXPECT_NEAR(flow.ratio.quantity().value, kOpaqueReading.share, 0.003);
}

TEST(FlowRatio, IgnoresOneLineThatIsFarOffAndLinesThatParted) {
  auto lines = FlowLines({.laid = 0.95}, FlowScanOf().motion);
  for (ProfileSample& sample : lines[4].samples) sample.area.value *= 1.5;
  lines[7].samples[lines[7].samples.size() - 3].area.value = 0;
  const FlowRatio flow = EstimateFlowRatio(lines, FlowScanOf().motion, FlowScanOf().premises,
                                           AreaReading{1, 0.003, true});
  ASSERT_TRUE(flow.ratio.good()) << flow.ratio.reason();
  EXPECT_NEAR(flow.ratio.quantity().value, 1 / 0.95, 0.006);
  EXPECT_EQ(flow.areas->broken, 1);
}

TEST(FlowRatio, TakesTheSlowStretchesAndShowsTheFastApart) {
  const FlowRatio flow = EstimateFlow({.laid = 1.02, .slip = 0.05}, FlowScanOf(true));
  ASSERT_TRUE(flow.ratio.good()) << flow.ratio.reason();
  EXPECT_NEAR(flow.ratio.quantity().value, 1 / 1.02, 0.003);
  ASSERT_TRUE(flow.areas->fast);
  EXPECT_NEAR(flow.areas->fast->value / flow.areas->slow->value, 0.95, 1e-9);
}

TEST(FlowRatio, OfAScanBesideAReferenceNeedsNeitherPlateNorScalesUncertainty) {
  constexpr double kRead = 0.83, kKnown = 0.96;  // share of any area; ratio known to be right
  FlowScan scan = FlowScanOf();
  scan.premises.opaque_plate = false;
  scan.premises.scale->area_share.reset();
  const auto known = MeasureSteadyAreas(FlowLines({.laid = kRead / kKnown}, scan.motion),
                                        scan.motion, kCommandedArea_mm2);
  ASSERT_TRUE(known.slow);
  const FlowRatio flow =
      EstimateFlow({.laid = kRead * 0.93}, scan, ReadingByReference(*known.slow, kKnown));
  ASSERT_TRUE(flow.ratio.good()) << flow.ratio.reason();
  EXPECT_NEAR(flow.ratio.quantity().value, 1 / 0.93, 0.005);
  EXPECT_TRUE(flow.by_reference);
}

std::string FlowReason(const FlowWorld& world, const FlowScan& scan,
                       const std::optional<AreaReading>& reading = std::nullopt) {
  const FlowRatio flow = EstimateFlow(world, scan, reading);
  EXPECT_EQ(flow.ratio.verdict(), Verdict::kCannotTell);
  return flow.ratio.reason();
}

TEST(FlowRatio, CannotBeToldWithoutItsPremises) {
  FlowScan scan = FlowScanOf();
  scan.premises.commanded_area_mm2.reset();
  EXPECT_THAT(FlowReason({}, scan), HasSubstr("commanded"));
  scan = FlowScanOf();
  scan.premises.scale.reset();
  EXPECT_THAT(FlowReason({}, scan), HasSubstr("pa setup"));
  scan = FlowScanOf();
  scan.premises.scale->area_share.reset();
  EXPECT_THAT(FlowReason({}, scan), HasSubstr("laser_angle_sigma"));
  scan = FlowScanOf();
  scan.premises.opaque_plate = false;
  EXPECT_THAT(FlowReason({}, scan), HasSubstr("opaque_plate"));
  scan = FlowScanOf();
  scan.premises.scale->area_share = 0.04;
  EXPECT_THAT(FlowReason({}, scan), HasSubstr("the scale of the camera's set-up"));
  EXPECT_THAT(FlowReason({.scatter = 0.2}, FlowScanOf()), HasSubstr("the lines' scatter"));
  EXPECT_THAT(FlowReason({.lines = 4}, FlowScanOf()), HasSubstr("at least 5 lines"));
  EXPECT_THAT(FlowReason({}, FlowScanOf(), AreaReading{1, 0.1, true}),
              HasSubstr("what the laser shows"));
}

TEST(FlowRatio, CannotBeToldWhereATiltedBedExplainsTheAreas) {
  EXPECT_THAT(FlowReason({.scatter = 0.003, .tilt = 0.12}, FlowScanOf()), HasSubstr("tilted bed"));
}

}  // namespace
}  // namespace trammel::pressure_advance
