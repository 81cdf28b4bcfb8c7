#include "part_alignment/views/view_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "part_alignment/pose/alignment_test_support.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::HasSubstr;

constexpr double kPixelSigma_px = 0.05;

struct Scene {
  AlignmentWorld world = BenchWorld();
  Camera camera = CameraOf(world.camera);
  std::vector<PartTarget> targets = MeasurementOf(world, 1).targets;
  ViewPlanOptions options;

  Scene() {
    options.travel = {{-200, -300, -600}, {1900, 1200, 500}};
    // The part: up to the targets' plane and a fixture a little above it.
    options.obstacles = {{{40, -90, -900}, {1580, 950, -640}},
                         {{700, 300, -900}, {900, 500, -600}}};
  }

  [[nodiscard]] Result<ViewPlan> Plan() const {
    return PlanViews(camera, targets, world.machine_from_part, options);
  }
};

/// The plan's pictures of the scene's part, which lies a little beside its rough place.
Alignment Taken(const Scene& scene, const ViewPlan& plan) {
  AlignmentWorld world = scene.world;
  world.machine_from_part.translation_mm += Vector3d(2, -3, 1);
  world.machine_from_part.angles_rad += Vector3d(0.001, -0.001, 0.002);
  world.views.clear();
  for (const PlannedView& planned : plan.views) {
    test_support::WorldView view{planned.spindle_mm, planned.spindle_rotation, {}};
    for (const std::string& id : planned.targets) {
      view.observations.push_back({std::stoi(id.substr(1)) - 1, Eigen::Vector2d::Zero()});
    }
    world.views.push_back(view);
  }
  Random random(3);
  TakePictures(world, kPixelSigma_px, random);
  SolveOptions options;
  options.inputs = ExactInputs();
  options.unknowns = scene.options.unknowns;
  return Solve(MeasurementOf(world, kPixelSigma_px), options).value();
}

TEST(ViewPlan, EightViewsOfFourTargetsReachTheGoalAndSolve) {
  const Scene scene;
  const auto plan = Good(scene.Plan());
  EXPECT_EQ(plan.views.size(), 8);
  EXPECT_LE(plan.observability.weakest_sigma_mm, scene.options.weakest_goal_mm);
  EXPECT_EQ(plan.observability.rank, 7);
  const Alignment alignment = Taken(scene, plan);
  EXPECT_EQ(alignment.verdict, Verdict::kGood) << alignment.reason;
  EXPECT_EQ(alignment.residuals.size(), 8);
  EXPECT_LT(std::sqrt(alignment.covariance(0, 0)), 0.02);
}

// Straight lines between the way's places, sampled: the tool's end cylinder is never nearer to a
// box than the clearance.
TEST(ViewPlan, TheWholeWayKeepsClear) {
  const Scene scene;
  const auto plan = scene.Plan();
  ASSERT_TRUE(plan && plan->verdict == Verdict::kGood);
  ASSERT_EQ(plan->way_mm.size(), plan->view_at.size());
  const double tool_mm = ToolLength(scene.camera, scene.options.tool_length_mm);
  for (std::size_t i = 0; i + 1 < plan->way_mm.size(); ++i) {
    for (int step = 0; step <= 50; ++step) {
      const Vector3d place =
          plan->way_mm[i] + step / 50.0 * (plan->way_mm[i + 1] - plan->way_mm[i]);
      EXPECT_TRUE(WithinTravel(scene.options, place));
      for (const MachineBox& box : scene.options.obstacles) {
        const double beside_mm =
            std::hypot(std::max({box.low_mm.x() - place.x(), place.x() - box.high_mm.x(), 0.0}),
                       std::max({box.low_mm.y() - place.y(), place.y() - box.high_mm.y(), 0.0}));
        const double above_mm = place.z() - tool_mm - box.high_mm.z();
        EXPECT_TRUE(beside_mm >= scene.options.tool_radius_mm + scene.options.clearance_mm - 1e-9 ||
                    above_mm >= scene.options.clearance_mm - 1e-9);
      }
    }
  }
}

TEST(ViewPlan, EccentricityNeedsASecondOrientationAndSaysSo) {
  Scene scene;
  scene.options.unknowns.clamp_eccentricity = true;
  EXPECT_THAT(scene.Plan(), Answers(Verdict::kCannotTell, "the clamp eccentricity in"));
  scene.options.orientations.push_back(geometry::RotationFromAngles({0, 0, std::numbers::pi}));
  const auto turned = Good(scene.Plan());
  EXPECT_EQ(Taken(scene, turned).verdict, Verdict::kGood);
}

TEST(ViewPlan, PlansAlongYToo) {
  Scene scene;
  Matrix3d along_y;
  along_y << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  scene.options.orientations = {along_y};
  scene.options.travel = {{-10000, -10000, -10000}, {10000, 10000, 10000}};
  scene.options.obstacles = {};
  scene.options.working_distance_mm = 150;
  scene.world.machine_from_part.angles_rad = {std::numbers::pi / 2, 0, 0};
  const auto plan = Good(scene.Plan());
  EXPECT_EQ(Taken(scene, plan).verdict, Verdict::kGood);
}

TEST(ViewPlan, WhatTheMachineCannotReachIsNamed) {
  Scene scene;
  scene.options.travel.high_mm.x() = 1000;  // the targets at x = 1562 mm are out of reach
  EXPECT_THAT(scene.Plan(), Answers(Verdict::kCannotTell, "cannot be seen from within the travel"));
  Scene low;
  low.options.travel.high_mm.z() = -200;  // no room above the fixture
  const auto no_way = Must(low.Plan());
  EXPECT_NE(no_way.verdict, Verdict::kGood);
  EXPECT_FALSE(no_way.reason.empty());
}

TEST(ViewPlan, InputErrorsNameTheField) {
  const auto message = [](auto&& spoil) {
    Scene scene;
    spoil(scene);
    const auto plan = scene.Plan();
    return plan ? std::string("no error") : plan.error().message;
  };
  EXPECT_THAT(message([](Scene& s) { s.options.travel.high_mm.x() = -1000; }),
              HasSubstr("plan: travel"));
  EXPECT_THAT(message([](Scene& s) { s.options.field_share = 0; }), HasSubstr("field_share is 0"));
  EXPECT_THAT(
      message([](Scene& s) { s.options.clearance_mm = std::numeric_limits<double>::quiet_NaN(); }),
      HasSubstr("clearance_mm is nan"));
  EXPECT_THAT(message([](Scene& s) { s.options.orientations[0](0, 0) = 3; }),
              HasSubstr("no rotation"));
  EXPECT_THAT(message([](Scene& s) {
                s.options.orientations.push_back(geometry::RotationFromAngles({0.5, 0, 0}));
              }),
              HasSubstr("direction of the spindle's axis"));
  EXPECT_THAT(message([](Scene& s) { s.targets.clear(); }), HasSubstr("0 targets"));
  EXPECT_THAT(message([](Scene& s) { s.targets[1].id = "T1"; }), HasSubstr("given twice"));
}

}  // namespace
}  // namespace trammel::part_alignment
