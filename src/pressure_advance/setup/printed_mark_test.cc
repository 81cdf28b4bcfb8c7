#include "pressure_advance/setup/printed_mark.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

PatternConfig Pla() {
  PatternConfig config;
  config.material = "pla";
  return config;
}

MarkPlan Plan(const PatternConfig& config) {
  const auto plan = PlanMark(config, {}, 28, 50.2);
  EXPECT_TRUE(plan.has_value());
  return *plan;
}

struct Place {
  double x = 0, y = 0, z = 0, e = 0;
};
struct Motion {
  Place from, to;
  [[nodiscard]] bool lays() const { return to.e > from.e && (to.x != from.x || to.y != from.y); }
};

// The file's absolute moves, as any firmware reads them.
std::vector<Motion> MotionsOf(const std::string& gcode) {
  std::vector<Motion> motions;
  Place at;
  std::istringstream lines(gcode);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("G0 ") && !line.starts_with("G1 ")) continue;
    Motion motion{at, at};
    std::istringstream words(line.substr(3));
    for (std::string word; words >> word;) {
      const double value = std::strtod(word.c_str() + 1, nullptr);
      if (word[0] == 'X') motion.to.x = value;
      if (word[0] == 'Y') motion.to.y = value;
      if (word[0] == 'Z') motion.to.z = value;
      if (word[0] == 'E') motion.to.e = value;
    }
    at = motion.to;
    motions.push_back(motion);
  }
  return motions;
}

TEST(PrintedMark, LaysFourSidesRoundItsMiddleAndARunIn) {
  const PatternConfig config = Pla();
  const MarkPlan plan = Plan(config);
  double laid_mm = 0, middle_x = 0, middle_y = 0, square_mm = 0;
  for (const Motion& motion : MotionsOf(WriteMarkGcode(plan, config))) {
    if (!motion.lays()) continue;
    const double length = std::hypot(motion.to.x - motion.from.x, motion.to.y - motion.from.y);
    laid_mm += length;
    constexpr double kArea_mm2 = 0.1104, kFilament_mm2 = 2.4053;  // paper's bead, 1.75 mm filament
    EXPECT_NEAR((motion.to.e - motion.from.e) / length, kArea_mm2 / kFilament_mm2, 1e-4);
    if (std::abs(motion.from.y - plan.run_in_y_mm) < 1e-9) continue;
    square_mm += length;
    middle_x += length * 0.5 * (motion.from.x + motion.to.x);
    middle_y += length * 0.5 * (motion.from.y + motion.to.y);
  }
  EXPECT_NEAR(square_mm, 24, 1e-9);
  EXPECT_NEAR(laid_mm, 44, 1e-9);
  EXPECT_NEAR(middle_x / square_mm, plan.x_mm, 1e-9);
  EXPECT_NEAR(middle_y / square_mm, plan.y_mm, 1e-9);
}

TEST(PrintedMark, ReachesOppositeSidesFromOppositeDirections) {
  const PatternConfig config = Pla();
  const MarkPlan plan = Plan(config);
  // The last motion of an axis before each side that lies across it.
  std::map<std::string, double> came;
  double last_x = 0, last_y = 0;
  for (const Motion& motion : MotionsOf(WriteMarkGcode(plan, config))) {
    const double dx = motion.to.x - motion.from.x, dy = motion.to.y - motion.from.y;
    if (motion.lays() && std::abs(motion.from.y - plan.run_in_y_mm) > 1e-9) {
      if (dx != 0) came[motion.from.y < plan.y_mm ? "front" : "back"] = last_y;
      if (dy != 0) came[motion.from.x < plan.x_mm ? "left" : "right"] = last_x;
    }
    if (dx != 0) last_x = dx;
    if (dy != 0) last_y = dy;
  }
  ASSERT_EQ(came.size(), 4U);
  EXPECT_LT(came["front"] * came["back"], 0);
  EXPECT_LT(came["left"] * came["right"], 0);
}

TEST(PrintedMark, NeverGoesBelowTheLayerNorTravelsOnIt) {
  const PatternConfig config = Pla();
  for (const Motion& motion : MotionsOf(WriteMarkGcode(Plan(config), config))) {
    EXPECT_GE(motion.to.z, config.layer_height_mm);
    const bool moves = motion.to.x != motion.from.x || motion.to.y != motion.from.y;
    if (moves && !motion.lays()) {
      EXPECT_GE(motion.from.z, config.layer_height_mm + 0.5);
    }
  }
}

TEST(PlanMark, KeepsAllWithinTheBedsMargin) {
  for (const double size_mm : {90.0, 120.0, 180.0, 250.0, 350.0}) {
    for (const bool round : {false, true}) {
      PatternConfig config = Pla();
      config.bed_size_x_mm = config.bed_size_y_mm = size_mm;
      config.bed_origin_x_mm = config.bed_origin_y_mm = round ? -size_mm / 2 : 0;
      if (round) config.bed_shape = settings::BedShape::kEllipse;
      const auto plan = PlanMark(config, {}, 28, 50.2);
      if (!plan) {
        EXPECT_LT(size_mm, 180) << "a bed with room for the mark was refused";
        EXPECT_EQ(plan.error().kind, ErrorKind::kSafety);
        continue;
      }
      for (const Motion& motion : MotionsOf(WriteMarkGcode(*plan, config))) {
        if (!motion.lays()) continue;
        EXPECT_LE(settings::BedReach(config, motion.to.x, motion.to.y, config.bed_margin_mm), 1)
            << size_mm << (round ? " round" : "");
      }
    }
  }
}

TEST(PlanMark, RefusesAPlaceBesideTheBed) {
  const auto plan = PlanMark(Pla(), {246, 100}, 28, 50.2);
  ASSERT_FALSE(plan.has_value());
  EXPECT_EQ(plan.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(plan.error().message, HasSubstr("--mark-at"));
}

}  // namespace
}  // namespace trammel::pressure_advance
