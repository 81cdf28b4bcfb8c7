#include "tool_offset/sheet/sheet_layout.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "base/random.h"
#include "tool_offset/reading/shift_scores.h"
#include "tool_offset/sheet/sheet_comments.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_plan.h"
#include "tool_offset/sheet/sheet_plan_test_support.h"

namespace trammel::tool_offset {
namespace {

constexpr double kRounding_mm = 0.0011;  // places are rounded to a micron

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
  std::string of;  ///< name of its part
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

SheetSettings ForPhoto(int tools) {
  SheetSettings settings;
  settings.filament.material = "pla";
  settings.for_photo = true;
  settings.tools.clear();
  for (int tool = 0; tool < tools; ++tool) settings.tools.push_back(tool);
  return settings;
}

TEST(SheetLayout, NothingTouchesAndEverythingLiesInTheBox) {
  std::vector<SheetSettings> sheets;
  for (const int tools : {2, 3, 5, 8}) {
    sheets.push_back(WithTools(tools));
    sheets.push_back(ForPhoto(tools));
    sheets.back().pick_ups = tools % 2;  // structures without a partner
  }
  for (const SheetSettings& settings : sheets) {
    SCOPED_TRACE(fmt::format("{} tools, for photo: {}", settings.tools.size(), settings.for_photo));
    const SheetPlan plan = PlanSheet(settings);
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
    EXPECT_GE(nearest_mm, plan.settings.structure_gap_mm - kRounding_mm);
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

// Given the layout, the search for tools far off is unambiguous: no single shift maps a tool's four
// combs onto another's.
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

TEST(PhotoLayout, BothStructuresOfAToolAndAxisLieOppositeOnePoint) {
  for (int tools = 2; tools <= 8; ++tools) {
    const SheetPlan plan = PlanSheet(ForPhoto(tools));
    std::vector<SheetPoint> middles;
    for (const Structure& a : plan.structures) {
      for (const Structure& b : plan.structures) {
        if (a.purpose != Purpose::kTool || &a == &b || a.axis != b.axis) continue;
        if (a.name.substr(0, 4) != b.name.substr(0, 4)) continue;  // "T1 X"
        middles.push_back(
            {(a.middle.u_mm + b.middle.u_mm) / 2, (a.middle.v_mm + b.middle.v_mm) / 2});
      }
    }
    ASSERT_EQ(middles.size(), static_cast<std::size_t>(4 * (tools - 1)));
    for (const SheetPoint& middle : middles) {
      EXPECT_NEAR(middle.u_mm, middles[0].u_mm, kRounding_mm) << tools;
      EXPECT_NEAR(middle.v_mm, middles[0].v_mm, kRounding_mm) << tools;
    }
    // About the sheet's own middle, but for the code's row below.
    EXPECT_LT(std::abs(middles[0].u_mm), 1) << tools;
    EXPECT_LT(std::abs(middles[0].v_mm), 6) << tools;
  }
}

}  // namespace

}  // namespace trammel::tool_offset
