#include "tool_offset/sheet_plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>

#include "base/check.h"
#include "base/random.h"
#include "tool_offset/paper_size.h"
#include "tool_offset/sheet_code.h"
#include "tool_offset/sheet_layout.h"
#include "tool_offset/tool_search.h"

namespace trammel::tool_offset {
namespace {

constexpr double kRounding_mm = 1e-9;

SheetSettings WithTools(int count) {
  SheetSettings settings;
  settings.tools.clear();
  for (int tool = 0; tool < count; ++tool) settings.tools.push_back(tool);
  return settings;
}

struct Point {
  double x_mm = 0;
  double y_mm = 0;
};

/// The sheet's point turned onto the bed, told anew here: counter-clockwise by the tilt.
Point OnBed(const SheetPoint& point, double tilt_deg) {
  const double t = tilt_deg * std::numbers::pi / 180;
  return {point.u_mm * std::cos(t) - point.v_mm * std::sin(t),
          point.u_mm * std::sin(t) + point.v_mm * std::cos(t)};
}

Point Outline(const SheetPlan& plan) {
  const double t = std::abs(plan.settings.tilt_deg) * std::numbers::pi / 180;
  return {plan.width_mm * std::cos(t) + plan.height_mm * std::sin(t),
          plan.width_mm * std::sin(t) + plan.height_mm * std::cos(t)};
}

struct Ink {
  std::string of;  ///< what it belongs to
  bool reference = true;
  Leg leg;
};

std::vector<Ink> AllInk(const SheetPlan& plan) {
  std::vector<Ink> ink;
  for (const Structure& structure : plan.structures) {
    for (std::size_t comb = 0; comb < 2; ++comb) {
      for (int finger = 0; finger < plan.settings.teeth; ++finger) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) {
          ink.push_back(
              {structure.name, structure.combs[comb].tool == plan.settings.reference_tool, leg});
        }
      }
    }
  }
  for (const CoarseMark& mark : plan.coarse_marks) {
    for (const Leg& leg : CoarseLegs(plan, mark)) {
      ink.push_back({"mark " + std::to_string(mark.tool), false, leg});
    }
  }
  for (const CodeCell& cell : plan.code) {
    if (cell.dark) ink.push_back({"code", true, CodeLeg(plan, cell)});
  }
  return ink;
}

/// Between two legs that run along u or v.
double Distance_mm(const Leg& a, const Leg& b) {
  const auto gap = [](double a0, double a1, double b0, double b1) {
    return std::max(
        {0.0, std::min(b0, b1) - std::max(a0, a1), std::min(a0, a1) - std::max(b0, b1)});
  };
  return std::hypot(gap(a.start.u_mm, a.end.u_mm, b.start.u_mm, b.end.u_mm),
                    gap(a.start.v_mm, a.end.v_mm, b.start.v_mm, b.end.v_mm));
}

const Structure& Named(const SheetPlan& plan, const std::string& name) {
  const auto found = std::find_if(plan.structures.begin(), plan.structures.end(),
                                  [&](const Structure& s) { return s.name == name; });
  TRAMMEL_CHECK(found != plan.structures.end(), "no structure {}", name);
  return *found;
}

TEST(SheetPlan, EachToolHasItsFourStructuresAndTheReferenceItsControlsAndBacklash) {
  const SheetPlan plan = PlanSheet(WithTools(3));
  std::set<std::string> names;
  for (const Structure& structure : plan.structures) names.insert(structure.name);
  EXPECT_EQ(names, (std::set<std::string>{"T1 X+", "T1 X-", "T1 Y+", "T1 Y-", "T2 X+", "T2 X-",
                                          "T2 Y+", "T2 Y-", "control X+", "control X-",
                                          "control Y+", "control Y-", "backlash X 1",
                                          "backlash X 2", "backlash Y 1", "backlash Y 2"}));
  EXPECT_EQ(names.size(), plan.structures.size());
  EXPECT_EQ(plan.coarse_marks.size(), 0u);
  SheetSettings first = WithTools(3);
  first.layout = 1;
  EXPECT_EQ(PlanSheet(first).coarse_marks.size(), 2u);
}

TEST(SheetPlan, MinusStructuresSwapTheRolesOfTheTools) {
  const SheetPlan plan = PlanSheet(WithTools(2));
  const Structure& plus = Named(plan, "T1 X+");
  EXPECT_EQ(plus.combs[0].tool, 0);
  EXPECT_EQ(plus.combs[1].tool, 1);
  EXPECT_EQ(plus.combs[0].direction, 1);
  EXPECT_EQ(plus.combs[1].direction, 1);
  const Structure& minus = Named(plan, "T1 X-");
  EXPECT_EQ(minus.combs[0].tool, 1);
  EXPECT_EQ(minus.combs[1].tool, 0);
  EXPECT_EQ(minus.combs[0].direction, -1);
  EXPECT_EQ(minus.combs[1].direction, -1);
  const Structure& backlash = Named(plan, "backlash Y 2");
  EXPECT_EQ(backlash.combs[0].direction, -1);
  EXPECT_EQ(backlash.combs[1].direction, 1);
}

TEST(SheetPlan, EveryLegMovesTheBedAxisThatItMeasuresInTheCombsDirection) {
  for (const double tilt_deg : {15.0, -15.0, 5.0, 40.0}) {
    SheetSettings settings = WithTools(2);
    settings.tilt_deg = tilt_deg;
    const SheetPlan plan = PlanSheet(settings);
    for (const Structure& structure : plan.structures) {
      for (std::size_t comb = 0; comb < 2; ++comb) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, 3)) {
          const Point start = OnBed(leg.start, tilt_deg);
          const Point end = OnBed(leg.end, tilt_deg);
          const double moved_mm =
              structure.axis == Axis::kX ? end.x_mm - start.x_mm : end.y_mm - start.y_mm;
          // sin 5° of 6 mm.
          EXPECT_GT(moved_mm * structure.combs[comb].direction, 0.5)
              << structure.name << " at " << tilt_deg;
        }
      }
    }
  }
}

/// Where play of 60 µm in x and 40 µm in y moves a leg, along the axis that it measures.
double ShiftByPlay_mm(const Leg& leg, Axis axis, double tilt_deg) {
  const Point start = OnBed(leg.start, tilt_deg);
  const Point end = OnBed(leg.end, tilt_deg);
  const double x_mm = end.x_mm > start.x_mm ? -0.030 : 0.030;
  const double y_mm = end.y_mm > start.y_mm ? -0.020 : 0.020;
  const double t = tilt_deg * std::numbers::pi / 180;
  return axis == Axis::kX ? x_mm * std::cos(t) + y_mm * std::sin(t)
                          : -x_mm * std::sin(t) + y_mm * std::cos(t);
}

TEST(SheetPlan, PlayOf60And40MicronsMovesTheCombsBy23Point8AsTheFactsSay) {
  const SheetPlan plan = PlanSheet(WithTools(2));
  const Structure& x = Named(plan, "backlash X 1");
  const double low_mm = ShiftByPlay_mm(FingerLegs(plan, x, 0, 0)[0], x.axis, 15);
  const double high_mm = ShiftByPlay_mm(FingerLegs(plan, x, 1, 0)[0], x.axis, 15);
  EXPECT_NEAR(low_mm, -0.0238, 5e-6);
  EXPECT_NEAR(high_mm, 0.0238, 5e-6);
  // Equal directions: both combs move together and nothing is seen.
  const Structure& control = Named(plan, "control X+");
  EXPECT_EQ(ShiftByPlay_mm(FingerLegs(plan, control, 0, 0)[0], x.axis, 15),
            ShiftByPlay_mm(FingerLegs(plan, control, 1, 0)[0], x.axis, 15));
}

TEST(SheetPlan, CombsHaveOnePitchAndStandHalfAPitchApart) {
  const SheetPlan plan = PlanSheet(WithTools(2));
  for (const Structure& structure : plan.structures) {
    for (int finger = 0; finger < plan.settings.teeth; ++finger) {
      const double low_mm = FingerPosition_mm(plan, structure, 0, finger);
      EXPECT_NEAR(FingerPosition_mm(plan, structure, 1, finger) - low_mm,
                  plan.settings.pitch_mm / 2, kRounding_mm);
      const auto legs = FingerLegs(plan, structure, 0, finger);
      const bool x = structure.axis == Axis::kX;
      const double first_mm = x ? legs[0].start.u_mm : legs[0].start.v_mm;
      const double second_mm = x ? legs[1].start.u_mm : legs[1].start.v_mm;
      EXPECT_NEAR((first_mm + second_mm) / 2, low_mm, kRounding_mm);
      EXPECT_NEAR(second_mm - first_mm, plan.settings.leg_spacing_mm, kRounding_mm);
    }
    const double across_mm =
        structure.axis == Axis::kX ? structure.middle.u_mm : structure.middle.v_mm;
    const int last = plan.settings.teeth - 1;
    EXPECT_NEAR(
        (FingerPosition_mm(plan, structure, 0, 0) + FingerPosition_mm(plan, structure, 1, last)) /
            2,
        across_mm, kRounding_mm);
  }
}

TEST(SheetPlan, OuterPiecesHoldOneCombAlone) {
  const SheetPlan plan = PlanSheet(WithTools(2));
  const Structure& structure = Named(plan, "T1 X+");
  const Leg low = FingerLegs(plan, structure, 0, 0)[0];
  const Leg high = FingerLegs(plan, structure, 1, 0)[0];
  const double v_mm = structure.middle.v_mm;
  EXPECT_NEAR(std::min(low.start.v_mm, low.end.v_mm), v_mm - 4, kRounding_mm);
  EXPECT_NEAR(std::max(low.start.v_mm, low.end.v_mm), v_mm + 2, kRounding_mm);
  EXPECT_NEAR(std::min(high.start.v_mm, high.end.v_mm), v_mm - 2, kRounding_mm);
  EXPECT_NEAR(std::max(high.start.v_mm, high.end.v_mm), v_mm + 4, kRounding_mm);
}

TEST(SheetPlan, NothingTouchesAndEverythingLiesInTheBox) {
  for (const int tools : {2, 3, 5, 8}) {
    const SheetPlan plan = PlanSheet(WithTools(tools));
    const double clear_mm = plan.box_insets_mm.back() + 1.5;
    const std::vector<Ink> ink = AllInk(plan);
    for (const Ink& one : ink) {
      for (const SheetPoint& point : {one.leg.start, one.leg.end}) {
        EXPECT_LT(std::abs(point.u_mm), plan.width_mm / 2 - clear_mm) << one.of;
        EXPECT_LT(std::abs(point.v_mm), plan.height_mm / 2 - clear_mm) << one.of;
      }
    }
    double nearest_mm = 1e9;
    for (std::size_t i = 0; i < ink.size(); ++i) {
      for (std::size_t k = i + 1; k < ink.size(); ++k) {
        if (ink[i].of == ink[k].of) continue;
        nearest_mm = std::min(nearest_mm, Distance_mm(ink[i].leg, ink[k].leg));
      }
    }
    EXPECT_GE(nearest_mm, plan.settings.structure_gap_mm);
  }
}

TEST(SheetPlan, MarksOfTheFirstLayoutStayClearOfAllElseWithin3Millimetres) {
  for (const int tools : {2, 3, 5, 8}) {
    SheetSettings settings = WithTools(tools);
    settings.layout = 1;
    settings.paper = "any";
    const SheetPlan plan = PlanSheet(settings);
    ASSERT_FALSE(plan.coarse_marks.empty());
    const std::vector<Ink> ink = AllInk(plan);
    for (const Ink& mark : ink) {
      if (!mark.of.starts_with("mark")) continue;
      for (const Ink& other : ink) {
        if (other.of == mark.of) continue;
        // Where both are drawn by tested tools, both may move.
        const double reach_mm = other.reference ? kMarkReach_mm : 2 * kMarkReach_mm;
        EXPECT_GT(Distance_mm(mark.leg, other.leg), reach_mm + plan.settings.line_width_mm)
            << mark.of << " and " << other.of << " of " << tools;
      }
    }
  }
}

bool FitsOn(const char* paper, const SheetPlan& plan) {
  const Point outline = Outline(plan);
  return FitsPaper(*FindPaper(paper), outline.x_mm, outline.y_mm);
}

TEST(SheetPlan, TwoToolsTakeAnA5SheetFiveAnA4SheetWithAllTheirTeeth) {
  for (const int tools : {2, 5}) {
    const SheetPlan plan = PlanSheet(WithTools(tools));
    EXPECT_TRUE(FitsOn(tools == 2 ? "A5" : "A4", plan));
    EXPECT_EQ(plan.settings.teeth, 17);
  }
}

TEST(SheetPlan, EightToolsFitA4AndFiveFitA5WithFewerTeeth) {
  for (const int tools : {2, 3, 4, 5, 6, 7, 8}) {
    for (const char* paper : {"A5", "A4", "letter", "A3"}) {
      if (paper == std::string("A5") && tools > 5) continue;
      SheetSettings settings = WithTools(tools);
      settings.paper = paper;
      settings.printer.bed_size_x_mm = settings.printer.bed_size_y_mm = 350;
      EXPECT_EQ(FindProblem(settings), std::nullopt) << tools << " tools on " << paper;
      const SheetPlan plan = PlanSheet(settings);
      EXPECT_TRUE(FitsOn(paper, plan)) << tools << " tools on " << paper;
      EXPECT_GE(plan.settings.teeth, kFewestTeethToFit);
      // One tooth more would not fit, or none was taken off.
      if (plan.settings.teeth == settings.teeth) continue;
      SheetSettings more = plan.settings;
      ++more.teeth;
      more.paper = "any";
      SheetPlan larger = PlanSheet(more);
      larger.settings.paper = paper;
      EXPECT_FALSE(FitsItsPaper(larger)) << tools << " tools on " << paper;
    }
  }
}

TEST(SheetPlan, WhatThePaperDoesNotTakeIsRefusedWithWhatWould) {
  SheetSettings settings = WithTools(8);
  settings.paper = "A5";
  settings.printer.bed_size_x_mm = settings.printer.bed_size_y_mm = 350;
  const auto problem = FindProblem(settings);
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->key, "paper");
  EXPECT_THAT(problem->message, testing::AllOf(testing::HasSubstr("A5"), testing::HasSubstr("A4"),
                                               testing::HasSubstr("tools would fit")));
  settings.paper = "A6";
  EXPECT_THAT(FindProblem(settings)->message, testing::HasSubstr("A6"));
}

// What follows from it is told apart by the search for tools far off: no tool's four combs all lie
// where another's would with one and the same shift.
TEST(SheetPlan, NoShiftTakesAllCombsOfAToolOntoThoseOfAnother) {
  for (const int tools : {3, 5, 8}) {
    const SheetPlan plan = PlanSheet(WithTools(tools));
    for (int a = 1; a < tools; ++a) {
      for (int b = 1; b < tools; ++b) {
        if (a == b) continue;
        const auto apart = [&](const char* structure) {
          const SheetPoint& from = Named(plan, fmt::format("T{} {}", a, structure)).middle;
          const SheetPoint& to = Named(plan, fmt::format("T{} {}", b, structure)).middle;
          return Point{to.u_mm - from.u_mm, to.v_mm - from.v_mm};
        };
        if (std::hypot(apart("X+").x_mm, apart("X+").y_mm) > 2 * kSearch_mm) continue;
        const Point x = apart("X+");
        const Point y = apart("Y+");
        EXPECT_GT(std::hypot(x.x_mm - y.x_mm, x.y_mm - y.y_mm), plan.settings.leg_length_mm)
            << "T" << a << " and T" << b;
      }
    }
  }
}

TEST(SheetPlan, WhatBelongsTogetherIsSpreadOverTheSheet) {
  const SheetPlan plan = PlanSheet(WithTools(5));
  std::vector<std::string> pairs{"control X", "control Y"};
  for (int tool = 1; tool < 5; ++tool) {
    pairs.push_back("T" + std::to_string(tool) + " X");
    pairs.push_back("T" + std::to_string(tool) + " Y");
  }
  for (const std::string& pair : pairs) {
    const SheetPoint& plus = Named(plan, pair + "+").middle;
    const SheetPoint& minus = Named(plan, pair + "-").middle;
    EXPECT_GT(std::hypot(plus.u_mm - minus.u_mm, plus.v_mm - minus.v_mm), 40) << pair;
  }
}

TEST(SheetPlan, SelfTestsMoveEachStructureByAnOffsetOfItsOwn) {
  SheetSettings settings;
  settings.tools = {0};
  settings.self_test = true;
  const SheetPlan plan = PlanSheet(settings);
  std::map<Axis, std::set<double>> offsets_mm;
  for (const Structure& structure : plan.structures) {
    if (structure.purpose != Purpose::kSelfTest) continue;
    const SheetPoint& low = structure.combs[0].programmed;
    const SheetPoint& high = structure.combs[1].programmed;
    const bool x = structure.axis == Axis::kX;
    const double moved_mm = x ? high.u_mm - low.u_mm : high.v_mm - low.v_mm;
    EXPECT_EQ(x ? high.v_mm - low.v_mm : high.u_mm - low.u_mm, 0);
    EXPECT_LE(std::abs(moved_mm), 0.5);
    EXPECT_NE(moved_mm, 0);
    EXPECT_TRUE(offsets_mm[structure.axis].insert(moved_mm).second) << structure.name;
    const std::size_t comb = structure.combs[0].direction > 0 ? 1 : 0;
    const Leg leg = FingerLegs(plan, structure, comb, 0)[0];
    const Comb& drawn = structure.combs[comb];
    EXPECT_NEAR((x ? leg.start.u_mm : leg.start.v_mm) + plan.settings.leg_spacing_mm / 2 -
                    FingerPosition_mm(plan, structure, comb, 0),
                x ? drawn.programmed.u_mm : drawn.programmed.v_mm, kRounding_mm);
  }
  EXPECT_EQ(offsets_mm[Axis::kX].size(), 8u);
  EXPECT_EQ(offsets_mm[Axis::kY].size(), 8u);
  EXPECT_TRUE(plan.coarse_marks.empty());
}

TEST(SheetPlan, EachToolIsSetAgainstItselfAfterEachPickUp) {
  SheetSettings settings = WithTools(2);
  settings.pick_ups = 2;
  const SheetPlan plan = PlanSheet(settings);
  for (const char* name :
       {"T0 X pick-up 1", "T1 X pick-up 2", "T0 Y pick-up 2", "T1 Y pick-up 1"}) {
    const Structure& structure = Named(plan, name);
    EXPECT_EQ(structure.combs[0].tool, structure.combs[1].tool);
    EXPECT_EQ(structure.combs[0].pick_up, 0);
    EXPECT_EQ(structure.combs[1].pick_up, name[std::string(name).size() - 1] - '0');
  }
}

TEST(SheetPlan, TheCodeLiesWhereNoTurnedOrMirroredSheetHasOne) {
  const SheetPlan plan = PlanSheet(WithTools(5));
  // Below the middle by more than a structure: turned round or mirrored in v it is elsewhere, and
  // mirrored in u it reads backwards.
  for (const CodeCell& cell : plan.code) {
    EXPECT_LT(cell.middle.v_mm, -plan.height_mm / 4);
    EXPECT_EQ(cell.middle.v_mm, plan.code.front().middle.v_mm);
  }
}

TEST(SheetPlan, TheNumberChangesWithAllThatIsMeasured) {
  std::set<std::uint32_t> ids{PlanSheet(SheetSettings{}).sheet_id};
  const auto expect_another = [&](const SheetSettings& settings, const char* what) {
    EXPECT_TRUE(ids.insert(PlanSheet(settings).sheet_id).second) << what;
  };
  SheetSettings settings;
  settings.pitch_mm = 3.71;
  expect_another(settings, "pitch");
  settings = {};
  settings.teeth = 16;
  expect_another(settings, "teeth");
  settings = {};
  settings.tilt_deg = -15;
  expect_another(settings, "tilt");
  settings = {};
  settings.tools = {0, 2};
  expect_another(settings, "tools");
  settings = {};
  settings.tools = {1, 0};
  settings.reference_tool = 1;
  expect_another(settings, "reference");
  settings = {};
  settings.overlap_mm = 3;
  expect_another(settings, "overlap");
  EXPECT_EQ(PlanSheet(SheetSettings{}).sheet_id, PlanSheet(SheetSettings{}).sheet_id);
}

TEST(SheetCode, EveryNumberReadsBackAndNeverFromTheWrongEnd) {
  for (std::uint32_t id = 0; id <= 0xffff; ++id) {
    CodeCells cells = EncodeSheetId(static_cast<std::uint16_t>(id));
    ASSERT_EQ(DecodeSheetId(cells), id);
    std::reverse(cells.begin(), cells.end());
    ASSERT_EQ(DecodeSheetId(cells), std::nullopt) << id;
  }
}

TEST(SheetCode, UpToThreeWrongCellsAreNoticed) {
  constexpr std::uint64_t kSeed = 12;
  Random random(kSeed);
  for (int repeat = 0; repeat < 20000; ++repeat) {
    CodeCells cells = EncodeSheetId(static_cast<std::uint16_t>(random.Below(0x10000)));
    std::set<std::uint64_t> wrong;
    const std::uint64_t count = 1 + random.Below(3);
    while (wrong.size() < count) wrong.insert(random.Below(kCodeCells));
    for (const std::uint64_t cell : wrong) cells[cell] = !cells[cell];
    ASSERT_EQ(DecodeSheetId(cells), std::nullopt) << "seed " << kSeed << ", repeat " << repeat;
  }
}

}  // namespace
}  // namespace trammel::tool_offset
