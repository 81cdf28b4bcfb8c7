#include "part_alignment/survey/survey_world_test_support.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <numbers>
#include <string>

#include "base/random.h"
#include "geometry/decompositions.h"

namespace trammel::part_alignment::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kHalfLength_mm = 1000;
constexpr double kHalfWidth_mm = 600;
constexpr double kHeight_mm = 400;

// Codes in turn on top (a third) and on the four sides.
void PlaceCodes(const SurveyScene& scene, Random& random, SurveyWorld& world) {
  for (int i = 0; i < scene.codes; ++i) {
    WorldTarget target;
    const int face = scene.flat ? 0 : i % 6;
    const double u = random.Uniform(-0.95, 0.95);
    const double v = random.Uniform(-0.95, 0.95);
    if (face < 2 || scene.flat) {
      target = {{kHalfLength_mm * u, kHalfWidth_mm * v, 0}, Vector3d::UnitZ()};
    } else {
      const double z = 0.5 * kHeight_mm * (v - 1);
      const double sign = face % 2 == 0 ? 1 : -1;
      target = face < 4 ? WorldTarget{{kHalfLength_mm * u, sign * kHalfWidth_mm, z}, {0, sign, 0}}
                        : WorldTarget{{sign * kHalfLength_mm, kHalfWidth_mm * u, z}, {sign, 0, 0}};
    }
    world.targets[std::to_string(i + 1)] = target;
  }
}

void PlaceBar(const std::string& from, const std::string& to, const Vector3d& start,
              const Vector3d& along, Random& random, SurveyWorld& world) {
  world.targets[from] = {start, Vector3d::UnitZ()};
  world.targets[to] = {start + along, Vector3d::UnitZ()};
  const double sigma = world.scene.bar_sigma_mm;
  world.bars.push_back({from, to, along.norm() + sigma * random.Normal(), sigma});
}

WorldShot Shoot(const SurveyScene& scene, int index, Random& random) {
  constexpr double kTurn = 2 * std::numbers::pi;
  constexpr double kGolden = 2.399963;  // rad: steps around the part that fill it evenly
  const double azimuth = std::fmod(kGolden * index + random.Uniform(0, 0.3), kTurn);
  const double elevation =
      (scene.flat ? 0.6 : 0.087) + (1.222 - (scene.flat ? 0.6 : 0.087)) * random.Uniform();
  WorldShot shot;
  const Vector3d towards(std::cos(azimuth) * std::cos(elevation),
                         std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
  const Vector3d aim{random.Uniform(-300, 300), random.Uniform(-200, 200), -150};
  shot.place_mm = aim + scene.distance_mm * random.Uniform(0.9, 1.1) * towards;
  shot.ahead = (aim - shot.place_mm).normalized();
  const Vector3d level = shot.ahead.cross(Vector3d::UnitZ()).normalized();
  const Vector3d below = shot.ahead.cross(level);
  const double roll =
      (scene.rolled && index % 2 == 1 ? 0.25 * kTurn : 0) + random.Uniform(-0.1, 0.1);
  shot.right = std::cos(roll) * level + std::sin(roll) * below;
  shot.down = std::cos(roll) * below - std::sin(roll) * level;
  shot.focal_px = scene.focal_px;
  return shot;
}

}  // namespace

SurveyWorld MakeSurveyWorld(const SurveyScene& scene, std::uint64_t seed) {
  Random random(seed);
  SurveyWorld world;
  world.scene = scene;
  PlaceCodes(scene, random, world);
  const double floor_mm = scene.flat ? 0 : -300;
  PlaceBar("901", "902", {-700, -850, floor_mm}, {1000, 12, 3}, random, world);
  PlaceBar("903", "904", {1250, -450, floor_mm}, {20, 1000, -4}, random, world);
  for (int i = 0; i < scene.pictures; ++i) world.shots.push_back(Shoot(scene, i, random));
  return world;
}

SurveyInput Photograph(const SurveyWorld& world, std::uint64_t seed) {
  const SurveyScene& scene = world.scene;
  Random random = Random(seed).Fork(7);
  SurveyInput input;
  input.bars = world.bars;
  for (std::size_t s = 0; s < world.shots.size(); ++s) {
    const WorldShot& shot = world.shots[s];
    SurveyPicture& picture = input.pictures.emplace_back();
    picture.name = "p" + std::to_string(s + 1);
    picture.width_px = scene.width_px;
    picture.height_px = scene.height_px;
    for (const auto& [id, target] : world.targets) {
      Vector3d at = target.at_mm;
      if (const auto there = shot.displaced_mm.find(id); there != shot.displaced_mm.end())
        at += there->second;
      const Vector3d ray = at - shot.place_mm;
      const double depth = ray.dot(shot.ahead);
      const double facing = -ray.normalized().dot(target.normal);
      const double noise_column = scene.sigma_px * random.Normal();
      const double noise_row = scene.sigma_px * random.Normal();
      const bool covered = random.Uniform() < scene.hidden;
      if (covered || depth < 100 || facing < std::cos(scene.steepest_incidence_rad)) continue;
      const double a = ray.dot(shot.right) / depth;
      const double b = ray.dot(shot.down) / depth;
      const double q = a * a + b * b;
      const double stretch = 1 + scene.k1 * q + scene.k2 * q * q + scene.k3 * q * q * q;
      const double shift_a = 2 * scene.p1 * a * b + scene.p2 * (3 * a * a + b * b);
      const double shift_b = scene.p1 * (a * a + 3 * b * b) + 2 * scene.p2 * a * b;
      const double column = (scene.width_px - 1) / 2.0 + scene.column_off_px +
                            shot.focal_px * (a * stretch + shift_a) + noise_column;
      const double row = (scene.height_px - 1) / 2.0 + scene.row_off_px +
                         shot.focal_px * (b * stretch + shift_b) + noise_row;
      constexpr double kMargin_px = 25;
      if (q > 1.5 || column < kMargin_px || row < kMargin_px ||
          column > scene.width_px - kMargin_px || row > scene.height_px - kMargin_px) {
        continue;
      }
      picture.observations.push_back({id, column, row, scene.sigma_px});
    }
  }
  return input;
}

SurveyErrors ErrorsOf(const SurveyWorld& world, const Survey& survey) {
  const auto count = static_cast<Eigen::Index>(survey.targets.size());
  Eigen::MatrixXd found(3, count);
  Eigen::MatrixXd truth(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SurveyedTarget& target = survey.targets[static_cast<std::size_t>(i)];
    found.col(i) = target.at_mm;
    truth.col(i) = world.targets.at(target.id).at_mm;
  }
  const Vector3d from = truth.rowwise().mean();
  const Vector3d to = found.rowwise().mean();
  const Matrix3d cross = (found.colwise() - to) * (truth.colwise() - from).transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d mirror = Matrix3d::Identity();
  mirror(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Matrix3d rotation = svd.matrixU() * mirror * svd.matrixV().transpose();
  SurveyErrors errors;
  errors.true_mm = (rotation * (truth.colwise() - from)).colwise() + to;
  const Eigen::MatrixXd off = found - errors.true_mm;
  errors.coordinates = off.reshaped();
  const auto eigen = geometry::DecomposeSymmetric(survey.covariance);
  for (Eigen::Index i = 6; i < eigen.values.size(); ++i) {
    const double along = eigen.vectors.col(i).dot(errors.coordinates);
    errors.nees += along * along / eigen.values[i];
    ++errors.freedom;
  }
  return errors;
}

}  // namespace trammel::part_alignment::test
