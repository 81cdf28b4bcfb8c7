#include "tool_offset/sheet/sheet_layout.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tool_offset/reading/shift_scores.h"
#include "tool_offset/sheet/paper_size.h"
#include "tool_offset/sheet/sheet_plan_test_support.h"

namespace trammel::tool_offset {
namespace {

struct Point {
  double x_mm = 0;
  double y_mm = 0;
};

Point Outline(const SheetPlan& plan) {
  const double t = std::abs(plan.settings.tilt_deg) * std::numbers::pi / 180;
  return {plan.width_mm * std::cos(t) + plan.height_mm * std::sin(t),
          plan.width_mm * std::sin(t) + plan.height_mm * std::cos(t)};
}

struct Ink {
  std::string of;  ///< what it belongs to
  Leg leg;
};

std::vector<Ink> AllInk(const SheetPlan& plan) {
  std::vector<Ink> ink;
  for (const Structure& structure : plan.structures) {
    for (std::size_t comb = 0; comb < 2; ++comb) {
      for (int finger = 0; finger < plan.settings.teeth; ++finger) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) {
          ink.push_back({structure.name, leg});
        }
      }
    }
  }
  for (const CodeCell& cell : plan.code) {
    if (cell.dark) ink.push_back({"code", CodeLeg(plan, cell)});
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

TEST(SheetLayout, NothingTouchesAndEverythingLiesInTheBox) {
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

bool FitsOn(const char* paper, const SheetPlan& plan) {
  const Point outline = Outline(plan);
  return FitsPaper(*FindPaper(paper), outline.x_mm, outline.y_mm);
}

TEST(SheetLayout, TwoToolsTakeAnA5SheetFiveAnA4SheetWithAllTheirTeeth) {
  for (const int tools : {2, 5}) {
    const SheetPlan plan = PlanSheet(WithTools(tools));
    EXPECT_TRUE(FitsOn(tools == 2 ? "A5" : "A4", plan));
    EXPECT_EQ(plan.settings.teeth, 17);
  }
}

TEST(SheetLayout, EightToolsFitA4AndFiveFitA5WithFewerTeeth) {
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

TEST(SheetLayout, WhatThePaperDoesNotTakeIsRefusedWithWhatWould) {
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
TEST(SheetLayout, NoShiftTakesAllCombsOfAToolOntoThoseOfAnother) {
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

TEST(SheetLayout, WhatBelongsTogetherIsSpreadOverTheSheet) {
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

}  // namespace
}  // namespace trammel::tool_offset
