// One part from its raw casting to the work offset, every step drawn anew, and each knowing of the
// last only what it stated: photogrammetry, fit, plan, pictures' centres, pose, shims, offset.
//
// TRAMMEL_STUDY_SEEDS: castings, 1000 without it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "align_scene.h"
#include "alignment_study.h"
#include "geometry/linear_systems.h"
#include "part_alignment/correction/part_correction.h"
#include "part_alignment/part_fit/part_fit.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/survey/survey_world_test_support.h"
#include "part_alignment/views/view_plan.h"
#include "sim/spindle/spindle_world.h"
#include "support/matchers.h"

namespace trammel {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using part_alignment::MachineFromPart;

constexpr double kMinCovered = 0.93;
// The 95 % points of chi-square with 3 and 7 degrees of freedom.
constexpr double kThree = 7.8147;
constexpr double kSeven = 14.0671;

/// The block of examples/alignment as it is: five planes with its targets and two scale bars.
part_alignment::PartFitInput TrueCasting() {
  part_alignment::PartFitInput casting;
  const auto surface = [&](const char* id, Eigen::Vector3d middle, Eigen::Vector3d outward,
                           Eigen::Vector3d along, Eigen::Vector3d across) {
    casting.surfaces.push_back({id, part_alignment::SurfaceKind::kPlane, middle, outward, 0, 4.0});
    for (int i = -1; i <= 1; ++i) {
      for (int k = -1; k <= 1; ++k) {
        const double stock_allowance_mm =
            4 + 0.5 * std::sin(3.0 * i + 2.0 * k + outward.dot(middle));
        casting.points.push_back({std::string(id) + std::to_string(3 * i + k),
                                  middle + stock_allowance_mm * outward + i * along + k * across,
                                  0.04, id});
      }
    }
  };
  surface("top", {0, 0, -4}, Vector3d::UnitZ(), {700, 0, 0}, {0, 450, 0});
  surface("front", {0, -550, -120}, -Vector3d::UnitY(), {700, 0, 0}, {0, 0, 80});
  surface("back", {0, 550, -120}, Vector3d::UnitY(), {700, 0, 0}, {0, 0, 80});
  surface("left", {-800, 0, -120}, -Vector3d::UnitX(), {0, 450, 0}, {0, 0, 80});
  surface("right", {800, 0, -120}, Vector3d::UnitX(), {0, 450, 0}, {0, 0, 80});
  const std::pair<const char*, Vector3d> plain[] = {{"1", {-750, -500, 0}}, {"2", {750, -500, 0}},
                                                    {"3", {750, 500, 0}},   {"4", {-750, 500, 0}},
                                                    {"A", {-900, -600, 0}}, {"B", {900, -600, 0}}};
  for (const auto& [id, at_mm] : plain) casting.points.push_back({id, at_mm, 0.025, ""});
  casting.bars.push_back({"A", "B", 1800, 0.01});
  return casting;
}

part_alignment::PartFitInput Measured(part_alignment::PartFitInput casting, Random& random) {
  for (auto& point : casting.points) {
    for (double& mm : point.at_mm) mm += point.sigma_mm * random.Normal();
  }
  casting.bars[0].length_mm += casting.bars[0].sigma_mm * random.Normal();
  return casting;
}

Vector3d OutwardAt(const part_alignment::PartFitInput& casting, const std::string& surface) {
  for (const auto& plane : casting.surfaces) {
    if (plane.id == surface) return plane.direction;
  }
  return Vector3d::UnitZ();
}

/// The casting photographed a hundred times by a camera in hand, and what the survey of it gives:
/// a code on each of its points, two bars on the floor beside it.
part_alignment::PartFitInput Surveyed(const part_alignment::PartFitInput& casting,
                                      std::uint64_t seed) {
  part_alignment::test::SurveyScene scene;
  scene.codes = 0;
  auto world = part_alignment::test::MakeSurveyWorld(scene, seed);
  for (const auto& point : casting.points) {
    world.targets[point.id] = {point.at_mm, OutwardAt(casting, point.surface)};
  }
  const auto survey =
      part_alignment::SolveSurvey(part_alignment::test::Photograph(world, seed), {});
  EXPECT_TRUE(survey && survey->verdict == Verdict::kGood)
      << (survey ? survey->reason : survey.error().message);
  part_alignment::PartFitInput surveyed;
  surveyed.surfaces = casting.surfaces;
  if (!survey || survey->verdict != Verdict::kGood) return surveyed;
  for (const auto& point : casting.points) {
    const auto& targets = survey->targets;
    const auto found = std::find_if(targets.begin(), targets.end(),
                                    [&](const auto& target) { return target.id == point.id; });
    EXPECT_NE(found, targets.end()) << point.id;
    if (found == targets.end()) continue;
    // The table for `align fit` has one sigma a point.
    surveyed.points.push_back(
        {point.id, found->at_mm, found->sigma_mm.norm() / std::sqrt(3.0), point.surface});
  }
  return surveyed;
}

/// The laboratory with the casting's targets where they are, and a machine that repeats to 3 um.
sim::SpindleSetup ShopOf(const part_alignment::PartFit& exact) {
  sim::SpindleSetup setup = test::Probed(sim::LaboratoryScene(300));
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d& at = exact.targets[i].ideal_mm;
    setup.part.targets[i].ideal_mm = {at.x(), at.y(), at.z()};
  }
  setup.machine.repeatability_mm = 0.003;
  return setup;
}

/// The stops of a plan made from what is known before any picture.
std::vector<sim::SpindleStation> Planned(const sim::SpindleSetup& setup,
                                         const part_alignment::PartFit& fit) {
  part_alignment::ViewPlanOptions options;
  options.travel = {test::VectorOf(setup.machine.travel_low_mm),
                    test::VectorOf(setup.machine.travel_high_mm)};
  options.sigma_px = setup.sigma_px;
  std::vector<part_alignment::PartTarget> targets;
  for (std::size_t i = 0; i < 4; ++i) {
    targets.push_back({fit.targets[i].id, fit.targets[i].ideal_mm});
  }
  const auto plan = part_alignment::PlanViews(
      test::CameraOf(setup.stated_lens), targets,
      {test::VectorOf(setup.part.origin_mm), test::VectorOf(setup.part.angles_rad)}, options);
  std::vector<sim::SpindleStation> stops;
  EXPECT_TRUE(plan && plan->verdict == Verdict::kGood)
      << (plan ? plan->reason : plan.error().message);
  if (!plan) return stops;
  for (const auto& view : plan->views) {
    stops.push_back({{view.spindle_mm.x(), view.spindle_mm.y(), view.spindle_mm.z()}, 0});
  }
  return stops;
}

/// Computes the derivative of a part point's machine place over the pose's six numbers.
Eigen::Matrix<double, 3, 6> ByPose(const geometry::Pose& pose, const Vector3d& part_mm) {
  constexpr double kStep_rad = 1e-6;
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose.leftCols<3>().setIdentity();
  for (int i = 0; i < 3; ++i) {
    geometry::Pose moved = pose;
    moved.angles_rad[i] += kStep_rad;
    by_pose.col(3 + i) =
        (MachineFromPart(moved, part_mm) - MachineFromPart(pose, part_mm)) / kStep_rad;
  }
  return by_pose;
}

/// Three shims along Z by the measured pose, the work offset by what they should have made of it:
/// where a tool goes for a point of the part, less where the point is.
Vector3d MissedBy(const part_alignment::Alignment& solved, const geometry::Pose& truth,
                  const Vector3d& part_mm) {
  const geometry::Pose& measured = solved.machine_from_part;
  const auto fixed = Must(part_alignment::CorrectFixture(
      measured, {{"a", {-700, -400, -240}}, {"b", {700, -400, -240}}, {"c", {0, 400, -240}}},
      Vector3d::Zero(), std::nullopt));
  const auto correction = part_alignment::CorrectWorkOffset(fixed.machine_from_part, {});
  const Eigen::AngleAxisd turn(correction.offset.rotation_z_rad, Vector3d::UnitZ());
  const Vector3d tool_mm = correction.offset.origin_mm + turn * part_mm;
  // The shims moved the real part as they moved the measured one.
  const auto rotation = [](const geometry::Pose& pose) {
    return geometry::RotationFromAngles(pose.angles_rad);
  };
  const Vector3d as_measured_mm =
      rotation(measured).transpose() * (MachineFromPart(truth, part_mm) - measured.translation_mm);
  return tool_mm - MachineFromPart(fixed.machine_from_part, as_measured_mm);
}

struct Chain {
  int good = 0;
  int refused = 0;
  int region = 0;  ///< poses and clampings in the 95 % region
  int corners = 0;
  int corners_inside = 0;  ///< part corners after shims and offset in their 95 % region
  double largest_mm = 0;   ///< largest miss of a corner by a tool
  double half_mm[3] = {};  ///< mean half-width of the 95 % intervals of X, Y, Z
};

void Count(const part_alignment::Alignment& solved, const sim::SpindleWorld& world, Chain& chain) {
  ++chain.good;
  Eigen::VectorXd found(7);
  found << solved.machine_from_part.translation_mm, solved.machine_from_part.angles_rad,
      solved.clamping.angle_rad;
  const Eigen::VectorXd truth = test::TruthOf(world);
  const Eigen::VectorXd error = found - truth.head(7);
  chain.region += geometry::SquaredMahalanobisDistance(solved.covariance, error) <= kSeven ? 1 : 0;
  for (Index k = 0; k < 3; ++k) {
    chain.half_mm[k] += 1.959964 * std::sqrt(solved.covariance(k, k));
  }
  const geometry::Pose as_it_is{truth.head<3>(), truth.segment<3>(3)};
  for (const Vector3d& corner_mm :
       {Vector3d(-800, -550, 0), Vector3d(800, -550, 0), Vector3d(800, 550, -240)}) {
    const Vector3d missed_mm = MissedBy(solved, as_it_is, corner_mm);
    const Eigen::Matrix<double, 3, 6> by_pose = ByPose(solved.machine_from_part, corner_mm);
    const Eigen::Matrix3d covariance =
        by_pose * solved.covariance.topLeftCorner<6, 6>() * by_pose.transpose();
    ++chain.corners;
    chain.corners_inside +=
        geometry::SquaredMahalanobisDistance(covariance, missed_mm) <= kThree ? 1 : 0;
    chain.largest_mm = std::max(chain.largest_mm, missed_mm.norm());
  }
}

/// Method that measures the casting, given the place in the row.
using Photogrammetry =
    std::function<part_alignment::PartFitInput(const part_alignment::PartFitInput&, std::uint64_t)>;

void CheckChain(const std::string& title, std::uint64_t castings, const Photogrammetry& measure) {
  const part_alignment::PartFitInput casting = TrueCasting();
  const auto exact = part_alignment::FitPart(casting, {});
  ASSERT_TRUE(exact && exact->verdict == Verdict::kGood);
  sim::SpindleSetup setup = ShopOf(*exact);
  const std::uint64_t count = test::WorldsOfStudy(static_cast<int>(castings));
  Chain chain;
  double views = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto fit = part_alignment::FitPart(measure(casting, i), {});
    ASSERT_TRUE(fit && fit->verdict == Verdict::kGood) << (fit ? fit->reason : fit.error().message);
    setup.stops = Planned(setup, *fit);
    views += static_cast<double>(setup.stops.size());
    const sim::SpindleName name = {test::FirstSeedOfStudy() + i, i};
    const sim::SpindleWorld world = sim::DrawSpindleWorld(setup, name);
    auto measurement = test::MeasurementOf(world, name, setup.sigma_px);
    for (std::size_t k = 0; k < 4; ++k) {
      measurement.targets[k].ideal_mm = fit->targets[k].ideal_mm;
    }
    part_alignment::SolveOptions options;
    options.target_covariance = fit->covariance.topLeftCorner(12, 12);
    const auto solved = part_alignment::Solve(measurement, options);
    ASSERT_TRUE(solved);
    if (solved->verdict == Verdict::kGood) {
      Count(*solved, world, chain);
      continue;
    }
    ++chain.refused;
    fmt::print("casting {}: {}\n", i, solved->reason);
  }
  const double n = std::max(1, chain.good);
  fmt::print(
      "\n{}; seed {}, {} castings, {:.1f} views on average\n"
      "| good | not | region % | corners after shims and offset % | missed at most um | 95 % of X "
      "Y "
      "Z um |\n|---|---|---|---|---|---|\n"
      "| {} | {} | {:.1f} | {:.1f} | {:.0f} | {:.1f} {:.1f} {:.1f} |\n",
      title, test::FirstSeedOfStudy(), count, views / static_cast<double>(count), chain.good,
      chain.refused, 100 * chain.region / n, 100.0 * chain.corners_inside / (3 * n),
      1000 * chain.largest_mm, 1000 * chain.half_mm[0] / n, 1000 * chain.half_mm[1] / n,
      1000 * chain.half_mm[2] / n);
  const double chance = 3 * std::sqrt(0.05 * 0.95 / n);
  EXPECT_GE(n, 0.99 * static_cast<double>(count));
  EXPECT_GE(chain.region / n, kMinCovered - chance);
  EXPECT_GE(chain.corners_inside / (3 * n), kMinCovered - chance);
}

Photogrammetry DrawnErrors() {
  return [random = std::make_shared<Random>(test::FirstSeedOfStudy())](
             const part_alignment::PartFitInput& casting, std::uint64_t) {
    return Measured(casting, *random);
  };
}

TEST(AlignChainStudy, FromCastingToOffsetWithPlannedViewsCovers) {
  CheckChain("from casting to offset, views planned", 1000, DrawnErrors());
}

TEST(AlignChainStudy, FromPicturesOfTheCastingToOffsetCovers) {
  CheckChain("from a survey of the casting to offset, views planned", 200,
             [](const part_alignment::PartFitInput& casting, std::uint64_t shop) {
               return Surveyed(casting, test::FirstSeedOfStudy() + shop);
             });
}

}  // namespace
}  // namespace trammel
