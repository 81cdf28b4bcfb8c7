#include "sim/slicer_patterns/slicer_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "sim/photo/photo.h"
#include "sim/print/gcode_interpreter.h"
#include "sim/print/layered_beads.h"
#include "sim/print/printer.h"
#include "sim/slicer_patterns/drawn_pattern_photo.h"
#include "sim/slicer_patterns/pattern_writers.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

constexpr PatternKind kAllKinds[] = {PatternKind::kOrcaLine, PatternKind::kOrcaPattern,
                                     PatternKind::kEllis, PatternKind::kMarlinLines};
constexpr double kRoundingMm = 0.002;  // G-code has three decimals

PatternOptions Options(PatternKind kind, double start, double end, double step) {
  PatternOptions options = PatternDefaults(kind);
  options.start_s = start;
  options.end_s = end;
  options.step_s = step;
  return options;
}

std::size_t CountOf(const PatternOptions& options) {
  const auto values = PatternValues(options);
  EXPECT_TRUE(values) << values.error().message;
  return values ? values->size() : 0;
}

std::string MustWrite(const PatternOptions& options) {
  const auto pattern = WriteSlicerPattern(options);
  EXPECT_TRUE(pattern) << pattern.error().message;
  return pattern ? pattern->gcode : "";
}

std::vector<Move> DepositsOf(const std::string& gcode) {
  const auto program = InterpretGcode(gcode, {});
  EXPECT_TRUE(program) << program.error().message;
  std::vector<Move> deposits;
  if (!program) return deposits;
  for (const Move& move : program->moves) {
    const bool travels =
        std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm) > 0;
    if (travels && move.e_mm > 0) deposits.push_back(move);
  }
  return deposits;
}

double Length(const Move& move) {
  return std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm);
}

// Walls of the highest layer: pairs of arms of 30 mm.
std::vector<Move> WallsOf(const std::vector<Move>& deposits) {
  double top = 0;
  for (const Move& move : deposits) top = std::max(top, move.to.z_mm);
  std::vector<Move> walls;
  for (std::size_t i = 0; i + 1 < deposits.size(); ++i) {
    const Move& a = deposits[i];
    const Move& b = deposits[i + 1];
    if (a.to.z_mm == top && std::abs(Length(a) - 30) < 0.01 && std::abs(Length(b) - 30) < 0.01 &&
        b.to.x_mm < b.from.x_mm && a.to.x_mm > a.from.x_mm) {
      walls.push_back(a);
    }
  }
  return walls;
}

TEST(SlicerPattern, CountsFollowEachToolsOwnRule) {
  PatternOptions orca = Options(PatternKind::kOrcaLine, 0, 0.1, 0.002);
  for (const auto& [depth, count] :
       {std::pair{250.0, 51U}, {220.0, 51U}, {180.0, 48U}, {120.0, 31U}}) {
    orca.bed_y_mm = depth;
    EXPECT_EQ(CountOf(orca), count) << depth;
  }
  EXPECT_EQ(CountOf(PatternDefaults(PatternKind::kOrcaPattern)), 17U);
  EXPECT_EQ(CountOf(Options(PatternKind::kOrcaPattern, 0.03, 0.07, 0.004)), 12U);
  EXPECT_EQ(CountOf(Options(PatternKind::kEllis, 0.03, 0.07, 0.004)), 11U);
  // The sum of steps in double precision, as the tool adds them.
  EXPECT_EQ(CountOf(Options(PatternKind::kMarlinLines, 0, 0.1, 0.005)), 20U);
  EXPECT_EQ(CountOf(Options(PatternKind::kMarlinLines, 0, 1, 0.05)), 20U);
  EXPECT_EQ(CountOf(Options(PatternKind::kMarlinLines, 0, 2, 0.1)), 20U);
  EXPECT_EQ(CountOf(Options(PatternKind::kMarlinLines, 0, 0.1, 0.01)), 11U);
  EXPECT_EQ(CountOf(Options(PatternKind::kMarlinLines, 0, 0.08, 0.005)), 17U);
}

TEST(SlicerPattern, ChevronsHaveTheToolsGeometry) {
  const PatternOptions options = PatternDefaults(PatternKind::kOrcaPattern);
  const std::vector<Move> deposits = DepositsOf(MustWrite(options));
  const std::vector<Move> walls = WallsOf(deposits);
  ASSERT_EQ(walls.size(), 17U * 3);
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const Move& wall = walls[i];
    const double from_first = wall.from.x_mm - walls[0].from.x_mm;
    EXPECT_NEAR(from_first,
                3.6013 * static_cast<double>(i / 3) + 0.5757 * static_cast<double>(i % 3),
                kRoundingMm);
    EXPECT_NEAR(wall.to.x_mm - wall.from.x_mm, 21.213, kRoundingMm);
    EXPECT_NEAR(wall.to.y_mm - wall.from.y_mm, 21.213, kRoundingMm);
    EXPECT_NEAR(wall.pressure_advance_s, 0.005 * static_cast<double>(i / 3), 1e-9);
    EXPECT_NEAR(wall.e_mm * std::numbers::pi / 4 * 1.75 * 1.75 / 30, 0.0814, 1e-4);
    EXPECT_NEAR(wall.to.z_mm, 0.8, 1e-9);
  }
  // The frame is the first rectangle: 84.1 x 42.43 mm, and the last apex is 1.55 mm from its side.
  double left = 1e9;
  double right = -1e9;
  for (std::size_t i = 0; i < 4; ++i) {
    left = std::min(left, deposits[i].to.x_mm);
    right = std::max(right, deposits[i].to.x_mm);
  }
  EXPECT_NEAR(right - left, 84.13, 0.01);
  EXPECT_NEAR(walls[0].from.x_mm - left, 2.594, 0.005);
  EXPECT_NEAR(right - walls.back().to.x_mm, 1.551, 0.005);
}

PatternOptions BatchOptions() {
  PatternOptions options = Options(PatternKind::kOrcaBatch, 0, 0.06, 0.005);
  options.speeds_mm_s = {50, 100, 150};
  options.accelerations_mm_s2 = {1000, 3000, 10000};
  return options;
}

TEST(SlicerPattern, ABatchHasOnePatternForEachSpeedAndAcceleration) {
  const PatternOptions options = BatchOptions();
  const std::string gcode = MustWrite(options);
  EXPECT_THAT(gcode, HasSubstr("; printing object pa_pattern_150_10000 id:0"));
  EXPECT_THAT(gcode, HasSubstr("; printing object pa_pattern_50_3000 id:0"));
  const std::vector<Move> walls = WallsOf(DepositsOf(gcode));
  ASSERT_EQ(walls.size(), 9U * 13 * 3);
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const std::size_t pattern = i / 39;
    EXPECT_NEAR(walls[i].feed_mm_s, options.speeds_mm_s[pattern % 3], 0.1);
    EXPECT_NEAR(walls[i].acceleration_mm_s2, options.accelerations_mm_s2[pattern / 3], 1);
    EXPECT_NEAR(walls[i].pressure_advance_s, 0.005 * static_cast<double>(i % 39 / 3), 1e-9);
    // All patterns are congruent.
    EXPECT_NEAR(walls[i].to.x_mm - walls[39 * pattern].to.x_mm,
                walls[i % 39].to.x_mm - walls[0].to.x_mm, kRoundingMm);
  }
  PatternOptions wide = BatchOptions();
  wide.end_s = 0.08;
  EXPECT_FALSE(WriteSlicerPattern(wide));
  wide.speeds_mm_s = {};
  EXPECT_FALSE(WriteSlicerPattern(wide));
  wide.speeds_mm_s = {std::nan("")};
  EXPECT_FALSE(WriteSlicerPattern(wide));
}

TEST(LayeredPrint, EachPatternOfABatchHasItsTruth) {
  PatternOptions options = BatchOptions();
  options.end_s = 0.01;
  options.numbers = false;
  options.speeds_mm_s = {50, 150};
  options.accelerations_mm_s2 = {1000, 10000};
  PrinterTraits traits;
  traits.law.kind = StorageKind::kPower;
  traits.law.exponent = 0.6;
  Random random(1);
  const auto print = PrintGcode(MustWrite(options), traits, random);
  ASSERT_TRUE(print) << print.error().message;
  const std::vector<CornerTruth>& corners = print->truth.corners;
  ASSERT_EQ(corners.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(corners[i].speed_mm_s, options.speeds_mm_s[i % 2]);
    EXPECT_EQ(corners[i].acceleration_mm_s2, options.accelerations_mm_s2[i / 2]);
    EXPECT_NEAR(corners[i].tangent_s, 0.6 * corners[i].pressure_advance_s, 1e-9);
    EXPECT_GT(corners[i].corner_s, corners[i].tangent_s);
    EXPECT_LT(corners[i].corner_s, corners[i].pressure_advance_s);
  }
  // S = c q^0.6: three times the speed has 3^-0.4 of the secant. A short dip sees the slope. E has
  // five decimals.
  EXPECT_NEAR(corners[1].pressure_advance_s / corners[0].pressure_advance_s, std::pow(3, -0.4),
              2e-5);
  EXPECT_LT(corners[2].corner_s, corners[0].corner_s);
  EXPECT_LT(corners[0].x_mm, corners[1].x_mm);
  EXPECT_LT(corners[0].y_mm, corners[2].y_mm);
}

TEST(SlicerPattern, LinesHaveTheToolsGeometry) {
  for (const PatternKind kind : {PatternKind::kOrcaLine, PatternKind::kMarlinLines}) {
    const bool orca = kind == PatternKind::kOrcaLine;
    const PatternOptions options = PatternDefaults(kind);
    const std::vector<Move> deposits = DepositsOf(MustWrite(options));
    std::vector<Move> fast;
    for (std::size_t i = 1; i + 1 < deposits.size(); ++i) {
      if (deposits[i].feed_mm_s < options.fast_mm_s - 0.1) continue;
      EXPECT_NEAR(Length(deposits[i - 1]), 20, kRoundingMm);
      EXPECT_NEAR(Length(deposits[i]), 40, kRoundingMm);
      EXPECT_NEAR(Length(deposits[i + 1]), 20, kRoundingMm);
      fast.push_back(deposits[i]);
    }
    ASSERT_EQ(fast.size(), orca ? 51U : 20U);
    for (std::size_t i = 1; i < fast.size(); ++i) {
      EXPECT_NEAR(fast[i].from.y_mm - fast[i - 1].from.y_mm, orca ? 3.5 : 5, kRoundingMm);
    }
    // mm^2: Orca's stadium of 0.6 x 0.2, Marlin's rectangle of 0.48 x 0.2.
    EXPECT_NEAR(fast[0].e_mm * std::numbers::pi / 4 * 1.75 * 1.75 / 40, orca ? 0.1114 : 0.096,
                1e-4);
  }
}

TEST(SlicerPattern, RotationAndRoundBedsTurnTheWholePattern) {
  PatternOptions options = PatternDefaults(PatternKind::kMarlinLines);
  const std::vector<Move> level = DepositsOf(MustWrite(options));
  options.rotation_deg = 90;
  options.round_bed = true;
  const std::vector<Move> turned = DepositsOf(MustWrite(options));
  ASSERT_EQ(turned.size(), level.size());
  for (std::size_t i = 0; i < level.size(); ++i) {
    EXPECT_NEAR(turned[i].to.x_mm, -(level[i].to.y_mm - 125), kRoundingMm);
    EXPECT_NEAR(turned[i].to.y_mm, level[i].to.x_mm - 125, kRoundingMm);
  }
}

TEST(SlicerPattern, LabelsAreCutAsOrcaCutsThem) {
  EXPECT_EQ(CutLabel(0.0225, 4, 5), "0.022");
  EXPECT_EQ(CutLabel(0.02, 4, 5), "0.02");
  EXPECT_EQ(CutLabel(2000, 4, 4), "2000");
  EXPECT_EQ(RoundLabel(0.0149999, 3), "0.015");
}

TEST(SlicerPattern, EveryFirmwareIsUnderstoodByTheVirtualPrinter) {
  for (const PatternKind kind : kAllKinds) {
    for (const PatternFirmware firmware :
         {PatternFirmware::kKlipper, PatternFirmware::kMarlin, PatternFirmware::kRepRap,
          PatternFirmware::kBambu, PatternFirmware::kPrusa}) {
      PatternOptions options = PatternDefaults(kind);
      options.firmware = firmware;
      options.absolute_e = firmware == PatternFirmware::kMarlin;
      options.corner_mm_s = 8;
      const std::string gcode = MustWrite(options);
      const auto program = InterpretGcode(gcode, {});
      ASSERT_TRUE(program) << program.error().message;
      EXPECT_TRUE(program->ignored.empty()) << program->ignored.begin()->first;
      const bool klipper = firmware == PatternFirmware::kKlipper;
      const bool smooths = klipper || firmware == PatternFirmware::kPrusa;
      double last = 0;
      for (const Move& move : program->moves) {
        if (move.e_mm > 0) last = std::max(last, move.pressure_advance_s);
        if (move.pressure_advance_s > 0) EXPECT_EQ(move.smooth_time_s, smooths ? 0.04 : 0);
        EXPECT_NEAR(move.corner_velocity_mm_s,
                    klipper || move.e_mm <= 0 ? move.corner_velocity_mm_s : 8 * std::numbers::sqrt2,
                    1e-9);
      }
      EXPECT_NEAR(last, PatternValues(options)->back(), 1e-6);
    }
  }
}

TEST(SlicerPattern, RefusesWhatNoToolPrints) {
  const auto fault = [](const PatternOptions& options) {
    const auto pattern = WriteSlicerPattern(options);
    EXPECT_FALSE(pattern);
    return pattern ? "" : pattern.error().message;
  };
  EXPECT_THAT(fault(Options(PatternKind::kEllis, 0.1, 0, 0.01)), HasSubstr("end = 0"));
  EXPECT_THAT(fault(Options(PatternKind::kEllis, 0, 1, 1e-4)), HasSubstr("more than 400"));
  EXPECT_THAT(fault(Options(PatternKind::kEllis, 0, 0.1, -1)), HasSubstr("step = -1"));
  EXPECT_THAT(fault(Options(PatternKind::kOrcaPattern, 0, 1, 0.01)), HasSubstr("does not fit"));
  PatternOptions turned = PatternDefaults(PatternKind::kMarlinLines);
  turned.rotation_deg = 30;
  EXPECT_THAT(fault(turned), HasSubstr("rotation = 30"));
  turned.rotation_deg = 0;
  turned.fast_mm_s = std::nan("");
  EXPECT_THAT(fault(turned), HasSubstr("fast = nan"));
}

// Prints three chevrons about a known truth by an ideal printer.
Print PrintChevrons(const PrinterTraits& traits, double start, double end, double step) {
  PatternOptions options = Options(PatternKind::kEllis, start, end, step);
  options.numbers = false;
  options.smooth_time_s = 0;
  Random random(1);
  auto print = PrintGcode(MustWrite(options), traits, random);
  EXPECT_TRUE(print) << print.error().message;
  return print ? *print : Print{};
}

double VolumeOf(const Strand& strand) {
  double volume_mm3 = 0;
  for (std::size_t i = 1; i < strand.samples.size(); ++i) {
    const BeadSample& a = strand.samples[i - 1];
    const BeadSample& b = strand.samples[i];
    volume_mm3 += 0.5 * (a.area_mm2 + b.area_mm2) * std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm);
  }
  return volume_mm3;
}

TEST(LayeredPrint, EveryLayerHasItsFilament) {
  PrinterTraits traits;
  traits.foot_mm = 0.1;
  traits.fillet_mm = 0.3;
  const PatternOptions options = [] {
    PatternOptions o = Options(PatternKind::kEllis, 0, 0.08, 0.02);
    o.numbers = false;
    return o;
  }();
  std::map<int, double> commanded;  // by layer's top in um
  for (const Move& move : DepositsOf(MustWrite(options))) {
    commanded[static_cast<int>(std::lround(move.to.z_mm * 1e3))] +=
        move.e_mm * std::numbers::pi / 4 * 1.75 * 1.75;
  }
  Random random(1);
  const auto print = PrintGcode(MustWrite(options), traits, random);
  ASSERT_TRUE(print) << print.error().message;
  std::map<int, double> laid;
  for (const Strand& strand : print->bed.strands) {
    // Every strand rests on one layer but the arms' ends, which lie on the frame as well.
    const BeadSample& middle = strand.samples[strand.samples.size() / 4];
    const double top = middle.base_mm + (middle.base_mm > 0 ? 0.2 : 0.25);
    laid[static_cast<int>(std::lround(top * 1e3))] += VolumeOf(strand);
  }
  ASSERT_EQ(commanded.size(), 4U);
  ASSERT_EQ(laid.size(), 4U);
  for (const auto& [top, volume] : commanded) {
    // The hot end stores 0.04 s of flow from one layer to the next, and beads pushed aside at a
    // corner lengthen their path.
    EXPECT_NEAR(laid[top], volume, 0.01 * volume) << top;
  }
}

TEST(LayeredPrint, PrintsOfOneLayerDoNotChange) {
  PatternOptions options = Options(PatternKind::kMarlinLines, 0, 0.04, 0.01);
  options.numbers = false;
  Random a_random(1);
  Random b_random(1);
  PrinterTraits traits;
  const auto a = PrintGcode(MustWrite(options), traits, a_random);
  traits.foot_mm = 0.1;
  traits.fillet_mm = 0.3;
  traits.corner_round_mm = 0.2;
  const auto b = PrintGcode(MustWrite(options), traits, b_random);
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->bed.strands.size(), b->bed.strands.size());
  for (std::size_t k = 0; k < a->bed.strands.size(); ++k) {
    for (std::size_t i = 0; i < a->bed.strands[k].samples.size(); ++i) {
      ASSERT_EQ(a->bed.strands[k].samples[i].width_mm, b->bed.strands[k].samples[i].width_mm);
      ASSERT_EQ(a->bed.strands[k].samples[i].x_mm, b->bed.strands[k].samples[i].x_mm);
    }
  }
}

// Area within 2.5 mm before and 4 mm behind each apex that layers above the first one cover, in mm
// of a band of three walls. A slot down to the first layer is dark in photos.
std::vector<double> ApexLengths(const Print& print, double start, double end, double step) {
  PatternOptions options = Options(PatternKind::kEllis, start, end, step);
  options.numbers = false;
  const std::vector<Move> walls = WallsOf(DepositsOf(MustWrite(options)));
  std::vector<double> lengths;
  constexpr double kCellMm = 0.03;
  constexpr double kBandMm = 3 * 0.4071;
  constexpr double kFirstLayerMm = 0.35;  // 0.25, and half of the next
  for (std::size_t i = 1; i < walls.size(); i += 3) {
    const Position& apex = walls[i].to;  // of the middle wall
    const Relief relief = RasterizeBed(
        print.bed, {apex.x_mm - 5, apex.y_mm - 5, apex.x_mm + 1.7, apex.y_mm + 5}, kCellMm);
    double cells = 0;
    for (double y = apex.y_mm - 5; y < apex.y_mm + 5; y += kCellMm) {
      for (double x = apex.x_mm - 5; x < apex.x_mm + 1.7; x += kCellMm) {
        const double dx = x - apex.x_mm;
        const double dy = y - apex.y_mm;
        const double along = (-dx + std::abs(dy)) / std::numbers::sqrt2;
        const double across = std::abs(dx + std::abs(dy)) / std::numbers::sqrt2;
        const double most = dy < 0 ? 2.5 : 4.0;
        if (along < most && across < 1.2 && relief.HeightAt(x, y) > kFirstLayerMm) cells += 1;
      }
    }
    lengths.push_back(cells * kCellMm * kCellMm / kBandMm);
  }
  return lengths;
}

TEST(LayeredPrint, TooLittleAdvanceBulgesAtTheApex) {
  PrinterTraits traits;
  traits.k_star_s = 0.04;
  const Print print = PrintChevrons(traits, 0, 0.08, 0.02);
  const std::vector<double> length = ApexLengths(print, 0, 0.08, 0.02);
  ASSERT_EQ(length.size(), 5U);
  // 100 mm/s, 3000 mm/s^2, a linear lag of 40 ms without smoothing: the near lobe has 18 mm/s times
  // the error of advance or more, less what the widest layer and the overlap hide.
  EXPECT_GT(length[0] - length[2], 0.25);
  EXPECT_GT(length[1] - length[2], 0.1);
  EXPECT_GT(length[2] - length[3], 0.1);
  EXPECT_GT(length[2] - length[4], 0.25);
}

TEST(LayeredPrint, TheNozzleDragsSurplusAheadAndLosesNone) {
  constexpr double kFullMm2 = 0.09;
  constexpr double kSpacingMm = 0.04;
  std::vector<double> area(501, 0.08);
  std::fill(area.begin() + 100, area.begin() + 125, 0.2);
  area.back() = 0.3;
  const std::vector<double> before = area;
  CarryOn(area, std::vector<double>(area.size(), kFullMm2), kSpacingMm);
  double moved = 0;
  double moment = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const double end = i == 0 || i + 1 == area.size() ? 0.5 : 1;
    moved += end * (area[i] - before[i]);
    moment += end * (area[i] - before[i]) * static_cast<double>(i) * kSpacingMm;
    EXPECT_GE(area[i], std::min(before[i], kFullMm2));
  }
  EXPECT_NEAR(moved, 0, 1e-12);
  EXPECT_EQ(area[99], before[99]);
  // Half of the 25 nodes' surplus of 0.11 mm^2, 2 mm on; 16 mm remain to leave it.
  EXPECT_NEAR(moment / (25 * 0.11), 0.5 * 2, 2e-3);
}

TEST(LayeredPrint, LabelsHaveTheirFilament) {
  PatternOptions options = Options(PatternKind::kOrcaPattern, 0, 0.02, 0.01);
  PrinterTraits traits;
  traits.slip = 0.02;
  traits.k_star_s = 0.02;
  Random random(1);
  const auto print = PrintGcode(MustWrite(options), traits, random);
  ASSERT_TRUE(print) << print.error().message;
  const std::vector<Move> deposits = DepositsOf(MustWrite(options));
  const double tab_mm = WallsOf(deposits).at(0).to.y_mm + 22;  // an arm's reach and a bead
  double commanded = 0;
  for (const Move& move : deposits) {
    if (std::abs(move.to.z_mm - 0.4) > 1e-6 || move.to.y_mm < tab_mm) continue;
    commanded += move.e_mm * std::numbers::pi / 4 * 1.75 * 1.75;
  }
  double laid = 0;
  for (const Strand& strand : print->bed.strands) {
    const BeadSample& middle = strand.samples[strand.samples.size() / 2];
    if (middle.y_mm > tab_mm && middle.base_mm > 0) laid += VolumeOf(strand);
  }
  EXPECT_GT(commanded, 5);
  // Each stroke's pressure builds up at its start and leaves at its end.
  EXPECT_NEAR(laid, commanded, 0.05 * commanded);
}

TEST(LayeredPrint, StacksToTheHeightOfItsLayers) {
  const Print print = PrintChevrons({}, 0.03, 0.05, 0.01);
  const auto region = PrintedRegion(print.bed);
  ASSERT_TRUE(region);
  const Relief relief = RasterizeBed(print.bed, *region, 0.05);
  std::vector<float> covered;
  for (const float height : relief.height_mm) {
    if (height > 0.7F) covered.push_back(height);
  }
  ASSERT_FALSE(covered.empty());
  std::nth_element(covered.begin(),
                   covered.begin() + static_cast<std::ptrdiff_t>(covered.size() / 2),
                   covered.end());
  EXPECT_NEAR(covered[covered.size() / 2], 0.85, 0.02);
}

TEST(DrawnPatternPhoto, ASeedNamesOneWorldWithItsTruth) {
  PatternPhotoOptions options;
  options.width_px = 400;
  options.height_px = 300;
  for (const PatternKind kind : kAllKinds) {
    const auto a = DrawPatternPhoto(kind, 7, options);
    const auto b = DrawPatternPhoto(kind, 7, options);
    const auto c = DrawPatternPhoto(kind, 8, options);
    ASSERT_TRUE(a && b && c);
    EXPECT_EQ(a->photo.bgr, b->photo.bgr);
    EXPECT_NE(a->photo.bgr, c->photo.bgr);
    EXPECT_GT(a->truth.pressure_advance_s, a->values.front());
    EXPECT_LT(a->truth.pressure_advance_s, a->values.back());
    EXPECT_NEAR(a->truth.tangent_s / a->truth.pressure_advance_s, a->exponent,
                kind == PatternKind::kEllis || kind == PatternKind::kOrcaPattern ? 1e-6 : 0.3);
  }
}

}  // namespace
}  // namespace trammel::sim
