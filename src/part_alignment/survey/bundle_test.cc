#include "part_alignment/survey/bundle.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/random.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"
#include "part_alignment/camera/camera_convert.h"
#include "part_alignment/survey/network.h"
#include "part_alignment/survey/orientation.h"
#include "part_alignment/survey/survey_world_test_support.h"
#include "support/matchers.h"

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

TEST(Lens, DerivativesAreThoseOfFiniteDifferences) {
  const Lens lens = Bent();
  const Eigen::Vector3d at(0.6, -0.4, 1.1);
  const auto projection = Must(ProjectLens(lens, at));
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
    const Eigen::Vector2d slope =
        (ProjectLens(lens, at + step)->pixel - ProjectLens(lens, at - step)->pixel) / (2 * kStep);
    EXPECT_LT((slope - projection.by_point.col(i)).norm(), 1e-4) << i;
  }
  for (int i = 0; i < kLensParameters; ++i) {
    const Lens step = kStep * Lens::Unit(i);
    const Eigen::Vector2d slope =
        (ProjectLens(lens + step, at)->pixel - ProjectLens(lens - step, at)->pixel) / (2 * kStep);
    EXPECT_LT((slope - projection.by_lens.col(i)).norm(), 1e-4) << kLensParameterNames.at(i);
  }
}

TEST(Lens, ObservationLineGoesThroughWhatIsProjected) {
  const Lens lens = Bent();
  const Eigen::Vector3d at(0.6, -0.4, 1.1);
  const auto line = Must(ObservationLine(lens, ProjectLens(lens, at)->pixel));
  EXPECT_LT((line - at.normalized()).norm(), 1e-12);
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

TEST(OrientPair, HasNoneForFewerThanSixPairs) {
  Random random(5);
  const std::vector<Vector3d> lines(5, Vector3d::UnitZ());
  EXPECT_TRUE(OrientPair(lines, lines, 2, random).empty());
}

TEST(ThreePointStations, HaveTheTrueOneAmongThem) {
  Random random(6);
  for (int trial = 0; trial < 500; ++trial) {
    const Station truth = Anywhere(random);
    std::array<Vector3d, 3> object;
    std::array<Vector3d, 3> lines;
    for (std::size_t i = 0; i < 3; ++i) {
      object[i] = Somewhere(random, 0.5);
      lines[i] = truth.FromObject(object[i]).normalized();
    }
    double nearest = 1;
    for (const Station& station : ThreePointStations(object, lines)) {
      nearest = std::min(nearest, (station.place - truth.place).norm());
    }
    // Close to a double root half of the digits are lost.
    EXPECT_LT(nearest, 1e-4) << "trial " << trial;
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
    const auto found = Must(Resect(network, AllOf(network), 3, random));
    EXPECT_EQ(found.observations, 20U);
    EXPECT_EQ(found.agreeing, 14U);
    EXPECT_LT((found.station.place - truth.place).norm(), 1e-6);
    EXPECT_LT(TurnBetween(found.station.rotation, truth.rotation), 1e-6);
  }
}

TEST(Resect, HasNoStationForThreePoints) {
  Random random(8);
  Network network = PointsSeenFrom(Anywhere(random), random);
  for (std::size_t i = 3; i < network.points.size(); ++i) network.points[i].placed = false;
  EXPECT_FALSE(Resect(network, AllOf(network), 3, random));
}

TEST(FitStation, FindsTheFocalLengthOfOnePicture) {
  Random random(9);
  Station truth = Anywhere(random);
  Network network = PointsSeenFrom(truth, random);
  network.lens[kFocal] *= 1.02;
  const auto fit = Must(FitStation(network, AllOf(network), truth, 0, true));
  EXPECT_NEAR(fit.focal_px, 2773, 1e-3);
  EXPECT_GT(fit.focal_sigma_px, 0.001);
  EXPECT_LT(fit.focal_sigma_px, 10);
}

/// A network at the world's truth, its observations noisy.
struct NetworkWorld {
  Network network;
  test::SurveyWorld world;
};

NetworkWorld NetworkAtTruth(std::uint64_t seed) {
  test::SurveyScene scene;
  scene.codes = 20;
  scene.pictures = 30;
  NetworkWorld made;
  made.world = test::MakeSurveyWorld(scene, seed);
  const SurveyInput input = test::Photograph(made.world, seed);
  Network& network = made.network;
  network.lens = PlainLens(scene.focal_px, scene.width_px, scene.height_px);
  network.lens += (Lens() << 0, scene.column_off_px, scene.row_off_px, scene.k1, scene.k2, scene.k3,
                   scene.p1, scene.p2)
                      .finished();
  std::map<std::string, std::size_t> index;
  for (const auto& [id, target] : made.world.targets) {
    index[id] = network.points.size();
    network.points.push_back({target.at_mm, true});
  }
  for (std::size_t s = 0; s < input.pictures.size(); ++s) {
    const test::WorldShot& shot = made.world.shots[s];
    Station station;
    station.rotation << shot.right.transpose(), shot.down.transpose(), shot.ahead.transpose();
    station.place = shot.place_mm;
    station.placed = true;
    network.stations.push_back(station);
    for (const Observation& observation : input.pictures[s].observations) {
      network.observations.push_back({s,
                                      index[observation.target],
                                      {observation.column_px, observation.row_px},
                                      observation.sigma_px,
                                      true});
    }
  }
  for (const ScaleBar& bar : made.world.bars) {
    network.bars.push_back({index[bar.from], index[bar.to], bar.length_mm, bar.sigma_mm, true});
  }
  // What is left is determined: ten targets seen by a station, three rays a target.
  std::vector<int> targets(network.stations.size());
  for (const NetworkObservation& observation : network.observations) ++targets[observation.station];
  for (std::size_t s = 0; s < targets.size(); ++s) network.stations[s].placed = targets[s] >= 10;
  std::vector<int> rays(network.points.size());
  for (const NetworkObservation& observation : network.observations) {
    if (network.stations[observation.station].placed) ++rays[observation.point];
  }
  for (std::size_t p = 0; p < rays.size(); ++p) network.points[p].placed = rays[p] >= 3;
  return made;
}

// Everything off by some 2 mm and mrad.
void Disturb(Network& network, Random& random) {
  const auto off = [&](double by) {
    return Vector3d{by * random.Normal(), by * random.Normal(), by * random.Normal()};
  };
  for (NetworkPoint& point : network.points) point.at += off(2);
  for (Station& station : network.stations) {
    station.place += off(2);
    station.rotation = geometry::RotationFromVector(off(0.002)) * station.rotation;
  }
  network.lens[kFocal] *= 1.01;
}

// The same model for Ceres: written anew, differentiated by itself.
struct ObservationModel {
  Eigen::Vector2d pixel;
  double sigma_px;
  template <class T>
  bool operator()(const T* lens, const T* station, const T* point, T* residual) const {
    const T about[3] = {point[0] - station[3], point[1] - station[4], point[2] - station[5]};
    T camera[3];
    ceres::AngleAxisRotatePoint(station, about, camera);
    const T x = camera[0] / camera[2];
    const T y = camera[1] / camera[2];
    const T q = x * x + y * y;
    const T radial = T(1) + q * lens[kK1] + q * q * lens[kK2] + q * q * q * lens[kK3];
    const T bent_x = x * radial + T(2) * lens[kP1] * x * y + lens[kP2] * (T(3) * x * x + y * y);
    const T bent_y = y * radial + lens[kP1] * (x * x + T(3) * y * y) + T(2) * lens[kP2] * x * y;
    residual[0] = (lens[kColumn] + lens[kFocal] * bent_x - pixel.x()) / sigma_px;
    residual[1] = (lens[kRow] + lens[kFocal] * bent_y - pixel.y()) / sigma_px;
    return true;
  }
};

struct BarModel {
  NetworkBar bar;
  template <class T>
  bool operator()(const T* from, const T* to, T* residual) const {
    T sum(0);
    for (int i = 0; i < 3; ++i) sum += (to[i] - from[i]) * (to[i] - from[i]);
    residual[0] = (sqrt(sum) - T(bar.length)) / T(bar.sigma);
    return true;
  }
};

/// Points as Ceres adjusts them, and twice its final cost.
std::vector<Vector3d> ByCeres(const Network& network, double& cost) {
  Lens lens = network.lens;
  std::vector<Vector3d> points;
  for (const NetworkPoint& point : network.points) points.push_back(point.at);
  std::vector<std::array<double, 6>> stations;
  for (const Station& station : network.stations) {
    const Eigen::AngleAxisd turn(station.rotation);
    const Vector3d vector = turn.angle() * turn.axis();
    stations.push_back({vector.x(), vector.y(), vector.z(), station.place.x(), station.place.y(),
                        station.place.z()});
  }
  ceres::Problem problem;
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<ObservationModel, 2, kLensParameters, 6, 3>(
            new ObservationModel{observation.pixel, observation.sigma_px}),
        nullptr, lens.data(), stations[observation.station].data(),
        points[observation.point].data());
  }
  for (const NetworkBar& bar : network.bars) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<BarModel, 1, 3, 3>(new BarModel{bar}),
                             nullptr, points[bar.from].data(), points[bar.to].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  cost = 2 * summary.final_cost;
  return points;
}

TEST(AdjustBundle, EndsWhereCeresEnds) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Network network = NetworkAtTruth(seed).network;
    Random random(seed);
    Disturb(network, random);
    double cost = 0;
    const std::vector<Vector3d> expected = ByCeres(network, cost);
    const DescentEnd fit = AdjustBundle({}, network);
    EXPECT_TRUE(fit.converged);
    EXPECT_NEAR(fit.cost, cost, 1e-6 * cost);
    // Ceres' datum is where its steps led: distances compare.
    constexpr double kSame_mm = 1e-4;
    for (std::size_t i = 1; i < expected.size(); ++i) {
      if (!network.points[0].placed || !network.points[i].placed) continue;
      EXPECT_NEAR((network.points[i].at - network.points[0].at).norm(),
                  (expected[i] - expected[0]).norm(), kSame_mm);
    }
  }
}

TEST(AdjustBundle, LeavesCentroidAndMeanOrientationWithoutBarsTheSizeToo) {
  Network network = NetworkAtTruth(4).network;
  Random random(4);
  Disturb(network, random);
  BundleOptions options;
  options.bars = false;
  const Network before = network;
  (void)AdjustBundle(options, network);
  Vector3d moved = Vector3d::Zero();
  double size_before = 0;
  double size_after = 0;
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (!network.points[p].placed) continue;
    moved += network.points[p].at - before.points[p].at;
    size_before += before.points[p].at.squaredNorm();
    size_after += network.points[p].at.squaredNorm();
  }
  EXPECT_LT(moved.norm(), 1e-6);
  constexpr double kSecondOrder = 1e-4;  // the first step is of 1e-2 of the size
  EXPECT_NEAR(size_after / size_before, 1, kSecondOrder);
}

TEST(AdjustBundle, TakesNoNoticeOfWhatIsNotPlacedOrUsed) {
  Network network = NetworkAtTruth(5).network;
  Network poisoned = network;
  const std::size_t point = network.points.size() - 5;
  for (Network* of : {&network, &poisoned}) {
    of->points[point].placed = false;
    of->stations[3].placed = false;
    of->observations[10].used = false;
  }
  poisoned.points[point].at.setConstant(1e9);
  poisoned.stations[3].place.setConstant(-1e9);
  poisoned.observations[10].pixel.setConstant(1e6);
  (void)AdjustBundle({}, network);
  (void)AdjustBundle({}, poisoned);
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (p == point) continue;
    EXPECT_EQ(network.points[p].at, poisoned.points[p].at);
  }
  EXPECT_EQ(network.lens, poisoned.lens);
}

TEST(PrecisionOf, SaysWherePointsOnALineLeaveTheStationsFree) {
  Network network = NetworkAtTruth(8).network;
  (void)AdjustBundle({}, network);
  EXPECT_TRUE(PrecisionOf(network, kLensFree, true).determined);
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    const auto along = static_cast<double>(p) - 10;
    network.points[p].at = along * Vector3d(50, 20, 10);
  }
  for (NetworkObservation& observation : network.observations) {
    const Station& station = network.stations[observation.station];
    const auto seen =
        ProjectLens(network.lens, station.FromObject(network.points[observation.point].at));
    observation.used = seen.has_value();
    if (seen) observation.pixel = seen->pixel;
  }
  EXPECT_FALSE(PrecisionOf(network, kLensFree, true).determined);
}

TEST(PrecisionOf, HasARedundancyOfObservationsLessUnknowns) {
  Network network = NetworkAtTruth(6).network;
  BundleOptions free;
  free.bars = false;
  (void)AdjustBundle(free, network);
  const NetworkPrecision precision = PrecisionOf(network, kLensFree, false);
  double observations = 0;
  for (const NetworkObservation& observation : network.observations) {
    if (TakesPart(network, observation)) observations += 2;
  }
  const auto placed =
      static_cast<double>(std::count_if(network.stations.begin(), network.stations.end(),
                                        [](const Station& station) { return station.placed; }));
  const double unknowns =
      static_cast<double>(precision.points.rows() + kLensParameters) + 6.0 * placed - 7;
  EXPECT_NEAR(precision.observation_redundancy, observations - unknowns, 1e-5);
}

TEST(PrecisionOf, IsTheInverseOfTheNormalMatrixForWhatNoDatumChanges) {
  Network network = NetworkAtTruth(7).network;
  (void)AdjustBundle({}, network);
  const NetworkPrecision precision = PrecisionOf(network, kLensFree, true);
  // Inner constraints: no motion of all points together is in the covariance.
  BundleOptions options;
  const BundleNormal normal = NormalOf(network, options);
  const Eigen::MatrixXd motions =
      DatumMotions(network, normal, true).topRows(precision.points.rows());
  EXPECT_LT((precision.points * motions).cwiseAbs().maxCoeff(),
            1e-6 * precision.points.diagonal().maxCoeff());
  // And within the datum it is a generalised inverse: Q N Q = Q.
  const Eigen::MatrixXd reduced = Reduce(normal.equations, 0).matrix;
  const Eigen::Index points = precision.points.rows();
  const Eigen::MatrixXd of_lens = reduced.bottomRightCorner(kLensParameters, kLensParameters);
  const Eigen::MatrixXd to_lens = reduced.topRightCorner(points, kLensParameters);
  const Eigen::MatrixXd n = reduced.topLeftCorner(points, points) -
                            to_lens * geometry::SolveSymmetric(of_lens, to_lens.transpose());
  const Eigen::MatrixXd twice = precision.points * n * precision.points;
  EXPECT_LT((twice - precision.points).cwiseAbs().maxCoeff(),
            1e-5 * precision.points.diagonal().maxCoeff());
}

}  // namespace

}  // namespace trammel::part_alignment
