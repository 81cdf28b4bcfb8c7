#include "part_alignment/part_fit/part_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/random.h"
#include "geometry/linear_systems.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kSigma_mm = 0.05;
constexpr double kWanted_mm = 3;
const Vector3d kHalf_mm(400, 250, 150);

// The measurement's frame, as photogrammetry leaves it: anywhere.
const geometry::Pose kIdealFromMeasured{{812.3, -455.1, 96.4}, {0.31, -0.22, 1.7}};

Vector3d InMeasurement(const Vector3d& ideal_mm) {
  return geometry::RotationFromAngles(kIdealFromMeasured.angles_rad).transpose() *
         (ideal_mm - kIdealFromMeasured.translation_mm);
}

std::string FaceName(int axis, int side) { return std::string(side > 0 ? "+" : "-") + "xyz"[axis]; }

// A block with points on its six faces, each `stock_allowance` (by face) proud of the ideal one,
// and four targets on its top.
PartFitInput Block(const std::array<double, 6>& stock_allowance_mm) {
  PartFitInput input;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const std::string name = FaceName(axis, side);
      const Vector3d normal = side * Vector3d::Unit(axis);
      const Vector3d middle_mm = normal * kHalf_mm[axis];
      input.surfaces.push_back({name, SurfaceKind::kPlane, middle_mm, 2 * normal, 0, kWanted_mm});
      const double proud_mm =
          stock_allowance_mm[static_cast<std::size_t>(2 * axis + (side > 0 ? 1 : 0))];
      const int u = (axis + 1) % 3;
      const int v = (axis + 2) % 3;
      int number = 0;
      for (const double along : {-0.8, -0.1, 0.7}) {
        for (const double across : {-0.7, 0.1, 0.8}) {
          Vector3d at = middle_mm + proud_mm * normal;
          at[u] += along * kHalf_mm[u];
          at[v] += across * kHalf_mm[v];
          input.points.push_back(
              {name + std::to_string(number++), InMeasurement(at), kSigma_mm, name});
        }
      }
    }
  }
  for (const Vector3d& at : {Vector3d(-350, -200, 160), Vector3d(350, -200, 160),
                             Vector3d(350, 200, 160), Vector3d(-350, 200, 160)}) {
    input.points.push_back(
        {"T" + std::to_string(input.points.size()), InMeasurement(at), kSigma_mm, ""});
  }
  return input;
}

PartFitInput EvenBlock() { return Block({3, 3, 3, 3, 3, 3}); }

MeasuredPoint& PointOf(PartFitInput& input, const std::string& id) {
  return *std::find_if(input.points.begin(), input.points.end(),
                       [&](const MeasuredPoint& p) { return p.id == id; });
}

TEST(PartFit, AnEvenBlockIsPlacedExactlyFromAnywhere) {
  const auto fit = Good(FitPart(EvenBlock(), {}));
  EXPECT_NEAR(fit.min_mm, kWanted_mm, 1e-9);
  EXPECT_LT(fit.uneven_mm, 1e-9);
  ASSERT_EQ(fit.targets.size(), 4U);
  EXPECT_LT((fit.targets[0].ideal_mm - Vector3d(-350, -200, 160)).norm(), 1e-9);
  EXPECT_LT((fit.targets[2].ideal_mm - Vector3d(350, 200, 160)).norm(), 1e-9);
  EXPECT_EQ(fit.stock_allowances.size(), 54U);
}

TEST(PartFit, SubtractsTheTargetsThicknessAlongTheNormals) {
  PartFitOptions options;
  options.target_thickness_mm = 0.1;
  const auto fit = Good(FitPart(Block({3.1, 3.1, 3.1, 3.1, 3.1, 3.1}), options));
  EXPECT_NEAR(fit.min_mm, kWanted_mm, 1e-9);
  EXPECT_LT((fit.targets[0].ideal_mm - Vector3d(-350, -200, 160)).norm(), 1e-9);
  EXPECT_THAT(fit.notices, Contains(HasSubstr("0.100 mm")));
  // An error that all targets have moves no block that is measured from both sides; the guard
  // keeps twice of it.
  options.target_thickness_sigma_mm = 0.05;
  const auto doubted = Must(FitPart(Block({3.1, 3.1, 3.1, 3.1, 3.1, 3.1}), options));
  EXPECT_LT((doubted.covariance - fit.covariance).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(doubted.stock_allowances[0].min_mm, 2 * std::hypot(kSigma_mm, 0.05), 1e-12);
  options.target_thickness_mm = -0.1;
  EXPECT_THAT(FitPart(EvenBlock(), options), FailsWith("targets -0.1 mm thick"));
}

TEST(PartFit, ADentIsCoveredAndThePlacementRestsOnIt) {
  PartFitInput input = EvenBlock();
  PointOf(input, "+x4").at_mm = InMeasurement({400 - 1.5, -25, 15});
  const auto fit = Good(FitPart(input, {}));
  EXPECT_NEAR(fit.min_mm, 2 * kSigma_mm, 1e-7) << "the guard of two sigmas, and no more";
  int binding = 0;
  for (const PointStockAllowance& at : fit.stock_allowances) {
    EXPECT_GE(at.stock_allowance_mm, at.min_mm - 1e-7);
    if (!at.binding) continue;
    ++binding;
    EXPECT_EQ(input.points[at.point].id, "+x4");
  }
  EXPECT_EQ(binding, 1);
}

// Any other placement that covers the dent is less even: 200 of them near the answer.
TEST(PartFit, NoNearbyPlacementIsBothSafeAndMoreEven) {
  PartFitInput input = EvenBlock();
  PointOf(input, "+x0").at_mm = InMeasurement({400 - 1.2, -175, -120});
  PointOf(input, "+z8").at_mm = InMeasurement({280, 200, 150 - 0.8});
  const auto fit = Good(FitPart(input, {}));
  Random random(91);
  const Eigen::Matrix3d r = geometry::RotationFromAngles(fit.ideal_from_measured.angles_rad);
  int safe = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Vector3d turn;
    Vector3d shift;
    for (int i = 0; i < 3; ++i) {
      turn[i] = random.Normal(0, 1e-4);
      shift[i] = random.Normal(0, 0.05);
    }
    const Eigen::Matrix3d moved = geometry::RotationFromAngles(turn) * r;
    double sum = 0;
    bool covered = true;
    for (const PointStockAllowance& at : fit.stock_allowances) {
      const IdealSurface& face = input.surfaces[at.point / 9];
      const Vector3d ideal =
          moved * input.points[at.point].at_mm + fit.ideal_from_measured.translation_mm + shift;
      const double proud_mm = face.direction.normalized().dot(ideal - face.middle_mm);
      covered = covered && proud_mm >= at.min_mm;
      sum += (proud_mm - kWanted_mm) * (proud_mm - kWanted_mm);
    }
    safe += covered ? 1 : 0;
    if (!covered) continue;
    EXPECT_GT(std::sqrt(sum / 54), fit.uneven_mm - 1e-9);
  }
  EXPECT_GT(safe, 100);
}

TEST(PartFit, ARawPartThatIsTooSmallIsRefusedWithWhatIsMissing) {
  const auto fit = Must(FitPart(Block({3, 3, -2, 1, 3, 3}), {}));
  EXPECT_EQ(fit.verdict, Verdict::kRefused);
  // 1 mm short over both sides, half each, and the guard of 0.1 mm.
  EXPECT_THAT(fit.reason, Containing("0.600 mm are missing", "+y", "-y"));
  EXPECT_TRUE(fit.targets.empty());
  EXPECT_EQ(fit.stock_allowances.size(), 54U) << "the map shows where";
}

TEST(PartFit, AMotionThatNoSurfaceStopsIsNamed) {
  PartFitInput input = EvenBlock();
  std::erase_if(input.points,
                [](const MeasuredPoint& p) { return !p.surface.empty() && p.surface[1] == 'x'; });
  input.surfaces.erase(input.surfaces.begin(), input.surfaces.begin() + 2);
  EXPECT_THAT(FitPart(input, {}), Answers(Verdict::kCannotTell, "shift along x"));
}

TEST(PartFit, ABoreAndAShaftAreSurfacesToo) {
  PartFitInput input;
  input.surfaces = {{"bore", SurfaceKind::kBore, {0, 0, 0}, {0, 0, 1}, 40, 2},
                    {"shaft", SurfaceKind::kShaft, {300, 0, 0}, {0, 0, 1}, 60, 2},
                    {"top", SurfaceKind::kPlane, {150, 100, 80}, {0, 0, 1}, 0, 2}};
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * std::numbers::pi * i / 12;
    const Vector3d round(std::cos(angle), std::sin(angle), 0);
    const Vector3d up(0, 0, i % 2 == 0 ? -30 : 30);
    input.points.push_back({"b" + std::to_string(i), InMeasurement(38 * round + up), 0.02, "bore"});
    input.points.push_back({"s" + std::to_string(i),
                            InMeasurement(Vector3d(300, 0, 0) + 62 * round + up), 0.02, "shaft"});
    input.points.push_back(
        {"t" + std::to_string(i), InMeasurement(Vector3d(150, 100, 82) + 90 * round), 0.02, "top"});
  }
  const auto fit = Good(FitPart(input, {}));
  EXPECT_NEAR(fit.min_mm, 2, 1e-8);
  EXPECT_LT(fit.uneven_mm, 1e-8);
}

TEST(PartFit, RefusesSurfacesThatAreNotTheirPoints) {
  PartFitInput input = EvenBlock();
  input.surfaces[1].middle_mm.x() -= 200;  // +x, 600 mm from the other side where there are 800
  auto fit = FitPart(input, {});
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_THAT(*fit, Answers(Verdict::kRefused, "x do not lie on it", "middle_mm"));
  EXPECT_TRUE(fit->targets.empty());
  PartFitOptions options;
  options.max_uneven_mm = 110;
  fit = FitPart(input, options);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->verdict, Verdict::kGood) << fit->reason;
}

TEST(PartFit, RefusesADiameterThatStandsForARadius) {
  PartFitInput input = EvenBlock();
  constexpr double kRadius_mm = 40;
  input.surfaces.push_back({"bore", SurfaceKind::kBore, {0, 0, 0}, {0, 0, 1}, 2 * kRadius_mm, 3});
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * std::numbers::pi * i / 12;
    const double raw_mm = kRadius_mm - 3;
    input.points.push_back(
        {"b" + std::to_string(i),
         InMeasurement({raw_mm * std::cos(angle), raw_mm * std::sin(angle), 10.0 * (i % 3)}),
         kSigma_mm, "bore"});
  }
  auto fit = FitPart(input, {});
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_THAT(*fit, Answers(Verdict::kRefused, "43.000 mm on the average where 3.000 mm are wanted",
                            "radius_mm"));
  input.surfaces.back().radius_mm = kRadius_mm;
  fit = FitPart(input, {});
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->verdict, Verdict::kGood) << fit->reason;
}

TEST(PartFit, ADirectionTurnedRoundIsNamed) {
  // All six faces, and three alone, which nothing else checks.
  for (const bool alone : {false, true}) {
    for (const char axis : {'x', 'y', 'z'}) {
      for (const char side : {'+', '-'}) {
        const std::string turned = {side, axis};
        PartFitInput input = EvenBlock();
        if (alone) {
          const auto is_out = [&](const std::string& name) {
            return !name.empty() && name[0] != side;
          };
          std::erase_if(input.surfaces, [&](const auto& surface) { return is_out(surface.id); });
          std::erase_if(input.points, [&](const auto& point) { return is_out(point.surface); });
        }
        ASSERT_EQ(FitPart(input, {})->verdict, Verdict::kGood) << FitPart(input, {})->reason;
        for (IdealSurface& surface : input.surfaces) {
          if (surface.id == turned) surface.direction *= -1;
        }
        const auto fit = Must(FitPart(input, {}));
        EXPECT_NE(fit.verdict, Verdict::kGood) << turned;
        EXPECT_THAT(fit.reason, HasSubstr("direction of " + turned));
      }
    }
  }
}

TEST(PartFit, AWildPointIsNamed) {
  for (const std::string id : {"+x0", "-y4", "+z8"}) {
    for (const double off_mm : {-400.0, -60.0, -20.0, -8.0, 8.0, 20.0, 60.0, 400.0}) {
      SCOPED_TRACE(id + " by " + std::to_string(off_mm));
      PartFitInput input = EvenBlock();
      const int axis = id[1] - 'x';
      const Vector3d normal = (id[0] == '+' ? 1 : -1) * Vector3d::Unit(axis);
      MeasuredPoint& point = PointOf(input, id);
      point.at_mm += geometry::RotationFromAngles(kIdealFromMeasured.angles_rad).transpose() *
                     (off_mm * normal);
      const auto fit = Must(FitPart(input, {}));
      EXPECT_THAT(fit, Answers(Verdict::kCannotTell, "point " + id + " is"));
      EXPECT_TRUE(fit.targets.empty());
    }
  }
}

TEST(PartFit, ScaleBarsCorrectTheScaleOrRefuse) {
  PartFitInput input = EvenBlock();
  input.points.push_back({"B1", InMeasurement({-500, 0, 0}), 0.01, ""});
  input.points.push_back({"B2", InMeasurement({500, 0, 0}), 0.01, ""});
  input.bars = {{"B1", "B2", 1000, 0.002}};
  for (MeasuredPoint& point : input.points) point.at_mm *= 1.0003;
  const auto fit = Good(FitPart(input, {}));
  EXPECT_NEAR(fit.scale, 1 / 1.0003, 1e-12);
  EXPECT_NEAR(fit.uneven_mm, 0, 1e-8);
  // sqrt(0.01² + 0.01² + 0.002²) of 1000 mm.
  EXPECT_NEAR(fit.scale_sigma, 0.01428e-3, 1e-7);
  input.bars[0].length_mm = 1005;
  EXPECT_THAT(FitPart(input, {})->reason, HasSubstr("scale of 1.00"));
  input.bars[0].length_mm = 1000;
  input.bars.push_back({"T54", "T55", 700.5, 0.002});
  EXPECT_THAT(FitPart(input, {}), Answers(Verdict::kRefused, "T54-T55"));
}

TEST(PartFit, CovarianceOfTheTargetsIsTheirScatter) {
  PartFitInput clean = EvenBlock();
  PointOf(clean, "+x4").at_mm = InMeasurement({400 - 1.5, -25, 15});
  const auto truth = Must(FitPart(clean, {}));
  const std::uint64_t seed = 92;
  Random random(seed);
  constexpr int kRepeats = 200;
  double distance = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    PartFitInput input = clean;
    for (MeasuredPoint& point : input.points) {
      for (double& mm : point.at_mm) mm += random.Normal(0, kSigma_mm);
    }
    const auto fit = Good(FitPart(input, {}));
    Eigen::VectorXd error(12);
    for (int i = 0; i < 4; ++i) {
      const auto at = static_cast<std::size_t>(i);
      error.segment<3>(3 * i) = fit.targets[at].ideal_mm - truth.targets[at].ideal_mm;
    }
    distance += geometry::SquaredMahalanobisDistance(truth.covariance, error) / kRepeats;
  }
  // Chi-square of 12 degrees, mean of 200: four standard deviations are 4 sqrt(24 / 200) = 1.4.
  EXPECT_NEAR(distance, 12, 1.4) << "seed " << seed;
}

TEST(PartFit, WhatCannotBeIsNamed) {
  const auto complaint = [](const PartFitInput& input) { return ErrorOf(FitPart(input, {})); };
  PartFitInput input = EvenBlock();
  input.points[3].at_mm.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(complaint(input), HasSubstr("point -x3"));
  input = EvenBlock();
  input.points[3].surface = "roof";
  EXPECT_THAT(complaint(input), HasSubstr("roof"));
  input = EvenBlock();
  input.points[3].id = input.points[4].id;
  EXPECT_THAT(complaint(input), HasSubstr("twice"));
  input = EvenBlock();
  input.surfaces.push_back({"lid", SurfaceKind::kPlane, {0, 0, 0}, {0, 0, 1}, 0, 1});
  EXPECT_THAT(complaint(input), HasSubstr("lid"));
  input = EvenBlock();
  input.bars = {{"B1", "B2", 1000, 0}};
  EXPECT_THAT(complaint(input), HasSubstr("B1"));
  const std::string one = input.points[0].id;
  const std::string other = input.points[1].id;
  input.bars = {{one, other, 1000, 0.1}, {other, one, 1000, 0.1}};
  EXPECT_THAT(complaint(input), HasSubstr("stands there twice"));
  input.bars.clear();
  input.surfaces[0].direction.setZero();
  EXPECT_THAT(complaint(input), HasSubstr("direction"));
  input = EvenBlock();
  input.surfaces[2].stock_allowance_mm = -3;
  EXPECT_THAT(complaint(input), HasSubstr("surface -y: overstock_mm is -3"));
  input = EvenBlock();
  for (int i = 0; i < 1001; ++i)
    input.points.push_back({"n" + std::to_string(i), Vector3d::Zero(), 1, ""});
  EXPECT_THAT(complaint(input), HasSubstr("at most 1000"));
  const auto nothing = Must(FitPart({}, {}));
  EXPECT_EQ(nothing.verdict, Verdict::kCannotTell);
}

}  // namespace
}  // namespace trammel::part_alignment
