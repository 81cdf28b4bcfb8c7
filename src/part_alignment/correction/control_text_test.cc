// The texts are read back and applied as each control's manual says, in code of the test's own.
#include "part_alignment/correction/control_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <regex>

#include "part_alignment/correction/part_correction.h"

namespace trammel::part_alignment {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using geometry::Pose;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The texts' own rounding: 1e-6 mm each and 1e-9 degrees at 5 m.
constexpr double kTextRounding_mm = 1.5e-6;
constexpr double kRadians = std::numbers::pi / 180;

std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

// The number behind the first match of `before`; NaN where there is none.
double NumberAfter(const std::string& text, const std::string& before) {
  std::smatch match;
  const std::regex pattern(before + R"(\s*([+-]?[0-9]+\.[0-9]*))");
  if (!std::regex_search(text, match, pattern)) return std::numeric_limits<double>::quiet_NaN();
  return std::stod(match[1]);
}

Vector3d About(const Vector3d& axis, double deg, const Vector3d& v) {
  return AngleAxisd(deg * kRadians, axis) * v;
}

Vector3d OnLinuxCnc(const std::string& text, const Vector3d& program) {
  return About(Vector3d::UnitZ(), NumberAfter(text, " R"), program) +
         Vector3d(NumberAfter(text, " X"), NumberAfter(text, " Y"), NumberAfter(text, " Z"));
}

// Shift, then turn the coordinate system about its own Z, its new Y, its newest X.
Vector3d OnSiemens(const std::string& text, const Vector3d& program) {
  const std::string shift =
      text.substr(text.find("CTRANS"), text.find("CROT") - text.find("CTRANS"));
  const std::string turn = text.substr(text.find("CROT"));
  const auto angle = [&](const char* axis) {
    const double deg = NumberAfter(turn, std::string(axis) + ",");
    return std::isnan(deg) ? 0 : deg;
  };
  const Vector3d x = About(Vector3d::UnitX(), angle("X"), program);
  const Vector3d y = About(Vector3d::UnitY(), angle("Y"), x);
  return About(Vector3d::UnitZ(), angle("Z"), y) +
         Vector3d(NumberAfter(shift, "X,"), NumberAfter(shift, "Y,"), NumberAfter(shift, "Z,"));
}

// About the machine's fixed axes: A first, then B, then C.
Vector3d OnHeidenhain(const std::string& text, const Vector3d& program) {
  const Vector3d a = About(Vector3d::UnitX(), NumberAfter(text, "SPA"), program);
  const Vector3d b = About(Vector3d::UnitY(), NumberAfter(text, "SPB"), a);
  return About(Vector3d::UnitZ(), NumberAfter(text, "SPC"), b) +
         Vector3d(NumberAfter(text, "\nX"), NumberAfter(text, " Y"), NumberAfter(text, " Z"));
}

// G68 turns the programmed point about X0 Y0 of the work offset.
Vector3d OnFanuc(const std::string& set, const std::string& use, const Vector3d& program) {
  EXPECT_THAT(use, HasSubstr("G68 X0. Y0."));
  return About(Vector3d::UnitZ(), NumberAfter(use, " R"), program) +
         Vector3d(NumberAfter(set, " X"), NumberAfter(set, " Y"), NumberAfter(set, " Z"));
}

const Pose kLevel{{-1203.456789, 87.6543219, -410.1}, {0, 0, -0.0123456789}};
const Pose kTilted{{-1203.456789, 87.6543219, -410.1}, {0.021, -0.034, 2.5}};
const std::vector<Vector3d> kPoints = {{0, 0, 0}, {1500, 0, 0}, {-20, 1000, 33}, {4000, 3000, 500}};

ControlText Text(Control control, const std::string& slot_name, const Pose& pose,
                 bool tilts = false) {
  const auto slot = ParseOffsetSlot(control, slot_name);
  EXPECT_TRUE(slot);
  const auto text = TextFor(control, *slot, pose, tilts);
  EXPECT_TRUE(text);
  return text.value_or(ControlText{});
}

TEST(ControlText, APointOfThePartLandsWhereThePartSaysOnEveryControl) {
  const ControlText linuxcnc = Text(Control::kLinuxCnc, "G54", kLevel);
  const ControlText siemens = Text(Control::kSiemens, "G54", kLevel);
  const ControlText heidenhain = Text(Control::kHeidenhain, "7", kLevel);
  const ControlText fanuc = Text(Control::kFanuc, "G55", kLevel);
  for (const Vector3d& point : kPoints) {
    const Vector3d there = MachineFromPart(kLevel, point);
    EXPECT_LT((OnLinuxCnc(Joined(linuxcnc.set), point) - there).norm(), kTextRounding_mm);
    EXPECT_LT((OnSiemens(Joined(siemens.set), point) - there).norm(), kTextRounding_mm);
    EXPECT_LT((OnHeidenhain(Joined(heidenhain.set), point) - there).norm(), kTextRounding_mm);
    EXPECT_LT((OnFanuc(Joined(fanuc.set), Joined(fanuc.use), point) - there).norm(),
              kTextRounding_mm);
  }
}

TEST(ControlText, SiemensAndHeidenhainTakeTiltsInTheirOwnOrderOfRotations) {
  const ControlText siemens = Text(Control::kSiemens, "G505", kTilted, true);
  const ControlText heidenhain = Text(Control::kHeidenhain, "7", kTilted, true);
  for (const Vector3d& point : kPoints) {
    const Vector3d there = MachineFromPart(kTilted, point);
    EXPECT_LT((OnSiemens(Joined(siemens.set), point) - there).norm(), kTextRounding_mm);
    EXPECT_LT((OnHeidenhain(Joined(heidenhain.set), point) - there).norm(), kTextRounding_mm);
  }
  EXPECT_THAT(Joined(siemens.notes), HasSubstr("the tool still comes along"));
}

TEST(ControlText, ATiltThatIsNotTakenIsNamed) {
  const ControlText text = Text(Control::kLinuxCnc, "G54", kTilted);
  EXPECT_THAT(Joined(text.notes),
              HasSubstr("21.0000 mm/m about X and -34.0000 mm/m about Y) is not in this offset"));
  const auto slot = ParseOffsetSlot(Control::kFanuc, "G54");
  EXPECT_THAT(TextFor(Control::kFanuc, *slot, kTilted, true).error().message,
              HasSubstr("takes no tilt"));
}

TEST(ControlText, WritesTheLinesAsTheControlsReadThem) {
  const Pose pose{{1, -2.5, 0}, {0, 0, std::numbers::pi / 2}};
  EXPECT_THAT(Text(Control::kLinuxCnc, "G59.2", pose).set,
              ElementsAre("G21", "G10 L2 P8 X1.000000 Y-2.500000 Z0.000000 R90.000000000"));
  EXPECT_THAT(Text(Control::kSiemens, "G57", pose).set,
              ElementsAre("$P_UIFR[4]=CTRANS(X,1.000000,Y,-2.500000,Z,0.000000):"
                          "CROT(Z,90.000000000)"));
  EXPECT_THAT(Text(Control::kFanuc, "G54.1 P12", pose).set,
              ElementsAre("G21", "G90 G10 L20 P12 X1.000000 Y-2.500000 Z0.000000"));
  EXPECT_THAT(Text(Control::kHeidenhain, "3", pose).set,
              ElementsAre("preset table, row 3 (edit, not correct):",
                          "X +1.000000   Y -2.500000   Z +0.000000",
                          "SPA +0.000000000   SPB +0.000000000   SPC +90.000000000"));
  const Pose tiny{{-1e-9, 0, 0}, {0, 0, -1e-14}};
  EXPECT_THAT(Joined(Text(Control::kLinuxCnc, "G54", tiny).set), testing::Not(HasSubstr("-0")));
}

TEST(ControlText, KnowsEachControlsWorkOffsetsAndNoOthers) {
  EXPECT_EQ(ParseOffsetSlot(Control::kLinuxCnc, "G59")->number, 6);
  EXPECT_EQ(ParseOffsetSlot(Control::kLinuxCnc, "G59.3")->number, 9);
  EXPECT_EQ(ParseOffsetSlot(Control::kSiemens, "G54")->number, 1);
  EXPECT_EQ(ParseOffsetSlot(Control::kSiemens, "G599")->number, 99);
  EXPECT_TRUE(ParseOffsetSlot(Control::kFanuc, "G54.1 P300")->additional);
  for (const auto& [control, name] :
       {std::pair{Control::kLinuxCnc, "G60"}, std::pair{Control::kLinuxCnc, "G59.4"},
        std::pair{Control::kLinuxCnc, "G54.1"}, std::pair{Control::kSiemens, "G58"},
        std::pair{Control::kFanuc, "G54.1 P0"}, std::pair{Control::kHeidenhain, "G54"},
        std::pair{Control::kHeidenhain, ""}, std::pair{Control::kLinuxCnc, "G54 M3"}}) {
    EXPECT_FALSE(ParseOffsetSlot(control, name)) << ToString(control) << " " << name;
  }
}

}  // namespace
}  // namespace trammel::part_alignment
