#include "part_alignment/survey/bundle.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "part_alignment/camera/camera_convert.h"
#include "part_alignment/survey/network.h"
#include "part_alignment/survey/orientation.h"

namespace trammel::part_alignment {
using Eigen::Vector3d;

namespace {

Lens Bent() {
  Lens lens = PlainLens(2773, 4000, 3000);
  lens.tail<7>() +=
      (Eigen::Matrix<double, 7, 1>() << 12, -9, -0.09, 0.03, -0.004, 3e-4, -2e-4).finished();
  return lens;
}

TEST(Lens, ProjectsAsOpenCvDoes) {
  const Lens lens = Bent();
  const OpenCvCamera other{
      4000,      3000,      lens[kFocal], lens[kFocal], lens[kColumn], lens[kRow],
      lens[kK1], lens[kK2], lens[kP1],    lens[kP2],    lens[kK3],     0,
      0,         0};
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.6, -0.4, 1.1),
                                    Eigen::Vector3d(-700, 500, 900)}) {
    const auto projection = ProjectLens(lens, at);
    const auto expected = ProjectOpenCv(other, at);
    ASSERT_TRUE(projection && expected);
    EXPECT_LT((projection->pixel - *expected).norm(), 1e-9);
  }
}

TEST(Lens, HasNoPixelBehindTheCameraAndNoLineBeyondAFold) {
  EXPECT_FALSE(ProjectLens(Bent(), {0, 0, -1}));
  EXPECT_FALSE(ProjectLens(Bent(), {0, 0, 0}));
  EXPECT_FALSE(ProjectLens(Bent(), {10, 0, 1}));
  Lens folded = PlainLens(1000, 4000, 3000);
  folded[kK1] = -1;  // the picture ends at r = 0.38 focal lengths
  EXPECT_FALSE(ObservationLine(folded, {3999, 1500}));
}

Vector3d Somewhere(Random& random, double depth) {
  return {random.Uniform(-1, 1), random.Uniform(-1, 1), depth * random.Uniform(-1, 1)};
}

// Some 4 from the points, looking their way, rolled by anything.
Station Anywhere(Random& random) {
  Station station;
  station.place = Vector3d{random.Uniform(-2, 2), random.Uniform(-2, 2), 4};
  const Vector3d ahead = (0.3 * Somewhere(random, 1) - station.place).normalized();
  const Vector3d right = ahead.unitOrthogonal();
  Eigen::Matrix3d rotation;
  rotation << right.transpose(), ahead.cross(right).transpose(), ahead.transpose();
  station.rotation = Eigen::AngleAxisd(random.Uniform(0, 6), Vector3d::UnitZ()) * rotation;
  return station;
}

double TurnBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a.transpose() * b).angle();
}

TEST(FivePointEssentials, HaveTheTrueOneAmongThem) {
  for (const double depth : {0.5, 0.0}) {
    Random random(3);
    for (int trial = 0; trial < 200; ++trial) {
      const Station one = Anywhere(random);
      const Station two = Anywhere(random);
      std::array<Vector3d, 5> first;
      std::array<Vector3d, 5> second;
      for (std::size_t i = 0; i < 5; ++i) {
        const Vector3d at = Somewhere(random, depth);
        first[i] = one.FromObject(at).normalized();
        second[i] = two.FromObject(at).normalized();
      }
      const Eigen::Matrix3d rotation = two.rotation * one.rotation.transpose();
      const Vector3d base = two.FromObject(one.place);
      Eigen::Matrix3d cross;
      cross << 0, -base.z(), base.y(), base.z(), 0, -base.x(), -base.y(), base.x(), 0;
      const Eigen::Matrix3d truth = (cross * rotation).normalized();
      double nearest = 1;
      for (const auto& essential : FivePointEssentials(first, second)) {
        nearest = std::min({nearest, (essential - truth).norm(), (essential + truth).norm()});
      }
      // Close to a double root half of the digits are lost.
      EXPECT_LT(nearest, 1e-5) << "trial " << trial << ", depth " << depth;
    }
  }
}

TEST(OrientPair, FindsTheOrientationAmongWrongPairs) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Station one = Anywhere(random);
    const Station two = Anywhere(random);
    if ((one.place - two.place).norm() < 0.5) continue;
    std::vector<Vector3d> first;
    std::vector<Vector3d> second;
    for (int i = 0; i < 20; ++i) {
      const Vector3d at = Somewhere(random, 0.5);
      first.push_back(one.FromObject(at).normalized());
      second.push_back(two.FromObject(i < 4 ? Somewhere(random, 0.5) : at).normalized());
    }
    const auto found = OrientPair(first, second, 2, random);
    ASSERT_FALSE(found.empty());
    EXPECT_LT(TurnBetween(found[0].rotation, two.rotation * one.rotation.transpose()), 1e-5);
    EXPECT_LT((found[0].place - one.FromObject(two.place).normalized()).norm(), 1e-5);
  }
}

Network PointsSeenFrom(const Station& truth, Random& random) {
  Network network;
  network.lens = PlainLens(2773, 4000, 3000);
  network.stations.resize(1);
  for (std::size_t i = 0; i < 20; ++i) {
    const Vector3d at = Somewhere(random, 0.5);
    network.points.push_back({at, true});
    network.observations.push_back(
        {0, i, ProjectLens(network.lens, truth.FromObject(at))->pixel, 0.03, true});
  }
  return network;
}

std::vector<std::size_t> AllOf(const Network& network) {
  std::vector<std::size_t> all(network.observations.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  return all;
}

TEST(Resect, FindsTheStationAmongWrongObservations) {
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const Station truth = Anywhere(random);
    Network network = PointsSeenFrom(truth, random);
    for (std::size_t i = 0; i < 6; ++i) network.observations[i].pixel.x() += 300;
    const auto found = Resect(network, AllOf(network), 3, random);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->observations, 20U);
    EXPECT_EQ(found->agreeing, 14U);
    EXPECT_LT((found->station.place - truth.place).norm(), 1e-6);
    EXPECT_LT(TurnBetween(found->station.rotation, truth.rotation), 1e-6);
  }
}

TEST(FitStation, FindsTheFocalLengthOfOnePicture) {
  Random random(9);
  Station truth = Anywhere(random);
  Network network = PointsSeenFrom(truth, random);
  network.lens[kFocal] *= 1.02;
  const auto fit = FitStation(network, AllOf(network), truth, 0, true);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->focal_px, 2773, 1e-3);
  EXPECT_GT(fit->focal_sigma_px, 0.001);
  EXPECT_LT(fit->focal_sigma_px, 10);
}

}  // namespace

}  // namespace trammel::part_alignment
