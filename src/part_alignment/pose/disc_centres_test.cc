#include "part_alignment/pose/disc_centres.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/alignment_test_support.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test_support::AlignmentWorld;

constexpr double kDiscSigma_px = 0.02;

// The ellipse through pixels, by the conic a x² + b xy + c y² + d x + e y = 1 about their mean.
ImageEllipse Through(const std::vector<Vector2d>& pixels) {
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& pixel : pixels) mean += pixel / static_cast<double>(pixels.size());
  Eigen::MatrixXd terms(pixels.size(), 5);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Vector2d p = pixels[i] - mean;
    terms.row(static_cast<Eigen::Index>(i)) << p.x() * p.x(), p.x() * p.y(), p.y() * p.y(), p.x(),
        p.y();
  }
  const Eigen::VectorXd conic =
      geometry::SolveLeastSquares(terms, Eigen::VectorXd::Ones(terms.rows()));
  Eigen::Matrix2d form;
  form << conic[0], conic[1] / 2, conic[1] / 2, conic[2];
  const Vector2d centre = -0.5 * form.inverse() * conic.tail<2>();
  const geometry::SymmetricEigen axes =
      geometry::DecomposeSymmetric(form / (1 + centre.dot(form * centre)));
  const Vector2d along = axes.vectors.col(0);
  return {mean.x() + centre.x(), mean.y() + centre.y(), 1 / std::sqrt(axes.values[0]),
          1 / std::sqrt(axes.values[1]), std::atan2(along.y(), along.x())};
}

// Discs on a part, by the world's own equations.
struct Discs {
  explicit Discs(const Vector3d& normal, double radius_mm = 5) {
    world = test_support::BenchWorld();
    Random random(3);
    test_support::TakePictures(world, 0, random);
    measurement = MeasurementOf(world, kDiscSigma_px);
    const Eigen::Matrix3d turn = geometry::RotationFromAngles(world.machine_from_part.angles_rad);
    const Vector3d u = normal.unitOrthogonal() * radius_mm;
    const Vector3d v = normal.normalized().cross(u);
    for (std::size_t i = 0; i < world.views.size(); ++i) {
      seen.emplace_back();
      for (std::size_t k = 0; k < world.views[i].observations.size(); ++k) {
        const Vector3d& target_mm =
            world.targets_mm[static_cast<std::size_t>(world.views[i].observations[k].target)];
        std::vector<Vector2d> rim;
        for (double angle = 0; angle < 6.2; angle += 2 * std::numbers::pi / 36) {
          const Vector3d part_mm = target_mm + std::cos(angle) * u + std::sin(angle) * v;
          rim.push_back(*test_support::WorldPixel(
              world, world.views[i], turn * part_mm + world.machine_from_part.translation_mm));
        }
        seen.back().push_back(Through(rim));
        measurement.views[i].observations[k].column_px = seen.back().back().column_px;
        measurement.views[i].observations[k].row_px = seen.back().back().row_px;
      }
    }
  }
  [[nodiscard]] double Error_mm(const Alignment& alignment) const {
    return (alignment.machine_from_part.translation_mm - world.machine_from_part.translation_mm)
        .norm();
  }

  AlignmentWorld world;
  Measurement measurement;
  SeenDiscs seen;
};

TEST(DiscCentres, CorrectedByTheirNormalTheyGiveThePartBack) {
  for (const Vector3d& normal : {Vector3d(0, 0, 1), Vector3d(0.3, -0.2, 1)}) {
    Discs discs(normal);
    const auto uncorrected = Solve(discs.measurement, {});
    const auto alignment = SolveByDiscs({}, {normal, 0}, discs.seen, discs.measurement);
    ASSERT_TRUE(uncorrected && alignment);
    ASSERT_EQ(alignment->verdict, Verdict::kGood) << alignment->reason;
    // The first answer's tilt is off by the correction itself, some micrometres over a metre.
    EXPECT_LT(discs.Error_mm(*alignment), 2e-3);
    EXPECT_GT(discs.Error_mm(*uncorrected), 5 * discs.Error_mm(*alignment));
  }
}

TEST(DiscCentres, AWrongNormalOrRadiusIsRefusedByName) {
  Discs discs(Vector3d(0, 0, 1));
  const Measurement before = discs.measurement;
  for (const Vector3d& wrong : {Vector3d(0, 1, 0), Vector3d(0.3, 0, 1)}) {
    EXPECT_THAT(SolveByDiscs({}, {wrong, 0}, discs.seen, discs.measurement),
                Answers(Verdict::kRefused, "state the targets' normal"));
  }
  EXPECT_THAT(SolveByDiscs({}, {Vector3d::UnitZ(), 50}, discs.seen, discs.measurement),
              Answers(Verdict::kRefused, "look as if their radius were 5.0"));
  EXPECT_EQ(discs.measurement.views[0].observations[0].column_px,
            before.views[0].observations[0].column_px);
  EXPECT_FALSE(SolveByDiscs({}, {Vector3d::Zero(), 0}, discs.seen, discs.measurement));
  EXPECT_FALSE(SolveByDiscs({}, {Vector3d::UnitZ(), NAN}, discs.seen, discs.measurement));
}

}  // namespace
}  // namespace trammel::part_alignment
