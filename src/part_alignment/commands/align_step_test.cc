// trammel align fit with the ideal part as STEP and as analytic surfaces.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "base/random.h"
#include "geometry/euler.h"
#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/step_text.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

const geometry::Pose kIdealFromMeasured{{312.3, -155.1, 96.4}, {0.31, -0.22, 1.7}};
const std::vector<Vector3d> kTargets_mm = {{-200, -150, 60}, {200, -150, 60}, {0, 250, -40}};

Vector3d InMeasurement(const Vector3d& ideal_mm) {
  return geometry::RotationFromAngles(kIdealFromMeasured.angles_rad).transpose() *
         (ideal_mm - kIdealFromMeasured.translation_mm);
}

class Points {
 public:
  void Add(const Vector3d& ideal_mm, const std::string& surface) {
    const Vector3d at = InMeasurement(ideal_mm);
    text_ += fmt::format("p{},{:.12f},{:.12f},{:.12f},0.01,{}\n", count_++, at.x(), at.y(), at.z(),
                         surface);
  }
  // As far proud of each flat face and in the bore, as many on each.
  void AddBlock(const test::StepBlock& block, int each, Random& random, bool top, double proud_mm) {
    const Vector3d half = block.size_mm / 2;
    for (int i = 0; i < each; ++i) {
      // Past the bore's mouth and the rim of the freeform top.
      const double x = random.Uniform(2, 0.9 * half.x());
      const double y = random.Uniform(-0.9, 0.9) * half.y();
      const double z = random.Uniform(2, 0.8 * block.size_mm.z());
      Add({2 * x - 0.9 * half.x(), y, -proud_mm}, "bottom");
      if (top) Add({2 * x - 0.9 * half.x(), y, block.size_mm.z() + proud_mm}, "top");
      Add({-half.x() - proud_mm, y, z}, "left");
      Add({half.x() + proud_mm, y, z}, "right");
      Add({x, -half.y() - proud_mm, z}, "front");
      Add({x, half.y() + proud_mm, z}, "back");
      const double turn = random.Uniform(0, 2 * std::numbers::pi);
      const double radius = block.bore_radius_mm - proud_mm;
      Add({block.bore_x_mm + radius * std::cos(turn), y, block.bore_z_mm + radius * std::sin(turn)},
          "bore");
    }
  }
  [[nodiscard]] std::string Text() const {
    std::string text = "id,x_mm,y_mm,z_mm,sigma_mm,surface\n" + text_;
    for (std::size_t i = 0; i < kTargets_mm.size(); ++i) {
      const Vector3d at = InMeasurement(kTargets_mm[i]);
      text += fmt::format("T{},{:.12f},{:.12f},{:.12f},0.01,\n", i, at.x(), at.y(), at.z());
    }
    return text;
  }

 private:
  std::string text_;
  int count_ = 0;
};

class AlignStep : public testing::Test {
 protected:
  [[nodiscard]] test::CommandResult Run(const std::string& arguments) const {
    return test::RunTrammel("align " + arguments, folder_.path());
  }
  void Write(const std::string& name, const std::string& text) const {
    test::WriteWhole(folder_.path() / name, text);
  }
  // Returns the targets of a fit whose verdict is good.
  [[nodiscard]] std::vector<Vector3d> Targets(const std::string& arguments) {
    const auto run = Run("fit points.csv --json --part " + arguments);
    EXPECT_EQ(run.exit_code, 0) << arguments << ": " << run.output;
    if (run.exit_code != 0) return std::vector<Vector3d>(kTargets_mm.size(), Vector3d::Zero());
    std::vector<Vector3d> targets;
    const auto answer = nlohmann::json::parse(run.standard_output);
    for (const auto& target : answer["targets"]) {
      const auto& at = target["ideal_mm"];
      targets.emplace_back(double(at[0]), double(at[1]), double(at[2]));
    }
    EXPECT_EQ(targets.size(), kTargets_mm.size());
    notices_ = answer["notices"].dump();
    return targets;
  }

  test::TemporaryFolder folder_;
  std::string notices_;  // from the last answer
};

TEST_F(AlignStep, PointsEvenlyProudOfAFreeformPartComeBackWithin2MicronsAnd5Microradians) {
  test::StepBlock block;
  block.freeform = true;
  Random random(88'002);
  Points points;
  constexpr double kProud_mm = 2;
  points.AddBlock(block, 20, random, false, kProud_mm);
  for (int i = 0; i < 150; ++i) {
    const auto top = test::TopAt(block, random.Uniform(0.1, 0.9), random.Uniform(0.1, 0.9));
    points.Add(top.at_mm + kProud_mm * top.outward, "top");
  }
  Write("points.csv", points.Text());
  for (const char* unit : {"mm", "inch", "m"}) {
    const std::string file = fmt::format("free-{}.stp", unit);
    Write(file, test::StepText({block}, unit));
    const auto targets = Targets(file + " --overstock 2");
    constexpr double kPlace_mm = 0.002;
    constexpr double kTurn_rad = 5e-6;
    Vector3d middle = Vector3d::Zero();
    double place_mm = 0;
    double turn_rad = 0;
    for (std::size_t i = 0; i < targets.size(); ++i) {
      place_mm = std::max(place_mm, (targets[i] - kTargets_mm[i]).norm());
      middle += (targets[i] - kTargets_mm[i]) / static_cast<double>(targets.size());
    }
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const Vector3d off = targets[i] - kTargets_mm[i] - middle;
      turn_rad = std::max(turn_rad, off.norm() / kTargets_mm[i].norm());
    }
    EXPECT_THAT(notices_, HasSubstr(fmt::format("of 7 faces; its unit is {}", unit)));
    EXPECT_LT(place_mm, kPlace_mm) << unit;
    EXPECT_LT(turn_rad, kTurn_rad) << unit;
    std::printf("%s: %.4f um and %.4f urad from the exact placement\n", unit, 1e3 * place_mm,
                1e6 * turn_rad);
  }
}

TEST_F(AlignStep, WhatAStepFileCannotBeIsSaidWithItsRemedy) {
  test::StepBlock second;
  second.name = "second";
  second.at_mm = {150, 0, 0};
  Points points;
  Random random(88'003);
  points.AddBlock({}, 5, random, true, 2);
  Write("points.csv", points.Text());
  Write("two.step", test::StepText({{}, second}, "mm"));
  Write("open.step", test::StepText({{}}, "mm", test::StepFault::kNoTop));
  Write("sheet.step", test::StepText({{}}, "mm", test::StepFault::kSurfacesOnly));
  const std::string whole = test::StepText({{}}, "inch");
  Write("whole.step", whole);
  Write("cut.step", whole.substr(0, 2 * whole.size() / 3));
  Write("named.stl", whole);
  const auto said = [&](const std::string& arguments) {
    const auto run = Run("fit points.csv --overstock 2 --part " + arguments);
    EXPECT_EQ(run.exit_code, 1) << run.output;
    return run.output;
  };
  EXPECT_THAT(said("two.step"), Containing("2 solids", "\"second\""));
  EXPECT_THAT(said("open.step"), HasSubstr("its shell is open: 4 edges"));
  EXPECT_THAT(said("sheet.step"), HasSubstr("surfaces only"));
  EXPECT_THAT(said("cut.step"), HasSubstr("cut short"));
  EXPECT_THAT(said("whole.step --unit mm"), HasSubstr("states its unit itself"));
  EXPECT_THAT(said("nothing.step"), HasSubstr("nothing.step"));
  Write("part.json", R"({"format": 1, "surfaces": [{"id": "cad", "kind": "mesh",
    "file": "whole.step", "open": true, "overstock_mm": 2}]})");
  EXPECT_THAT(Run("fit points.csv --part part.json"), Says(1, "from an STL alone"));
  // A block from nowhere lies in several ways: it was read, whatever its name says.
  EXPECT_THAT(Run("fit points.csv --overstock 2 --part named.stl").output,
              HasSubstr("its unit is inch"));
}

TEST_F(AlignStep, WithoutItsModuleTheMessageNamesThePackage) {
  Points points;
  Random random(88'004);
  points.AddBlock({}, 5, random, true, 2);
  Write("points.csv", points.Text());
  Write("block.step", test::StepText({{}}, "mm"));
  // A copy of the program has no modules beside it.
  const std::string run = fmt::format(
      "cd '{}' && mkdir bin && cp '{}' bin/trammel && bin/trammel align fit points.csv --overstock "
      "2 "
      "--part block.step > said 2>&1",
      folder_.path().string(), TRAMMEL_PROGRAM);
  EXPECT_NE(std::system(run.c_str()), 0);
  EXPECT_THAT(
      test::ReadWhole(folder_.path() / "said"),
      Containing("trammel-step.so", "install the package trammel-step", "or export an STL"));
}

}  // namespace
}  // namespace trammel
