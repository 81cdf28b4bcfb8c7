#include "part_alignment/survey/survey_world_test_support.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "geometry/decompositions.h"
#include "support/target_picture.h"

namespace trammel::part_alignment::test {
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kHalfLength_mm = 1000;
constexpr double kHalfWidth_mm = 600;
constexpr double kHeight_mm = 400;

WorldTarget DrawPlace(int face, Random& random) {
  const double u = random.Uniform(-0.95, 0.95);
  const double v = random.Uniform(-0.95, 0.95);
  if (face < 2) return {{kHalfLength_mm * u, kHalfWidth_mm * v, 0}, Vector3d::UnitZ()};
  const double z = 0.5 * kHeight_mm * (v - 1);
  const double sign = face % 2 == 0 ? 1 : -1;
  if (face < 4) return {{kHalfLength_mm * u, sign * kHalfWidth_mm, z}, {0, sign, 0}};
  return {{sign * kHalfLength_mm, kHalfWidth_mm * u, z}, {sign, 0, 0}};
}

bool IsApart(const SurveyWorld& world, const WorldTarget& target) {
  return std::all_of(world.targets.begin(), world.targets.end(), [&](const auto& other) {
    return (other.second.at_mm - target.at_mm).norm() >= world.scene.apart_mm;
  });
}

// Codes in turn on top (a third) and on the four sides.
void PlaceCodes(const SurveyScene& scene, Random& random, SurveyWorld& world) {
  for (int i = 0; i < scene.codes; ++i) {
    const int face = scene.flat ? 0 : i % 6;
    WorldTarget target = DrawPlace(face, random);
    for (int tries = 0; tries < 1000 && !IsApart(world, target); ++tries) {
      target = DrawPlace(face, random);
    }
    world.targets[std::to_string(i + 1)] = target;
  }
}

// Rows lie along x at even steps, as rivets do: from two pictures along them any of a row fits any
// other.
void PlacePlain(const SurveyScene& scene, Random& random, SurveyWorld& world) {
  SurveyWorld scattered;
  SurveyScene as_codes = scene;
  as_codes.codes = scene.plain;
  PlaceCodes(as_codes, random, scattered);
  for (const auto& [id, target] : scattered.targets) world.plain.push_back(target);
  for (int row = 0; row < scene.rows; ++row) {
    const double y = kHalfWidth_mm * random.Uniform(-0.9, 0.9);
    const double step = random.Uniform(30, 90);
    for (int i = 0; i < scene.row_length; ++i) {
      world.plain.push_back(
          {{step * (i - 0.5 * scene.row_length), y, scene.flat ? 0 : 0.0}, Vector3d::UnitZ()});
    }
  }
}

struct Seen {
  double column = 0;
  double row = 0;
};

// Projects a point into a shot, without noise; absent if not visible.
std::optional<Seen> SeenIn(const SurveyScene& scene, const WorldShot& shot, const Vector3d& at,
                           const Vector3d& normal) {
  const Vector3d ray = at - shot.place_mm;
  const double depth = ray.dot(shot.ahead);
  const double facing = -ray.normalized().dot(normal);
  if (depth < 100 || facing < std::cos(scene.steepest_incidence_rad)) return std::nullopt;
  const double a = ray.dot(shot.right) / depth;
  const double b = ray.dot(shot.down) / depth;
  const double q = a * a + b * b;
  const double stretch = 1 + scene.k1 * q + scene.k2 * q * q + scene.k3 * q * q * q;
  const double shift_a = 2 * scene.p1 * a * b + scene.p2 * (3 * a * a + b * b);
  const double shift_b = scene.p1 * (a * a + 3 * b * b) + 2 * scene.p2 * a * b;
  const Seen seen = {
      (scene.width_px - 1) / 2.0 + scene.column_off_px + shot.focal_px * (a * stretch + shift_a),
      (scene.height_px - 1) / 2.0 + scene.row_off_px + shot.focal_px * (b * stretch + shift_b)};
  constexpr double kMargin_px = 25;
  if (q > 1.5 || seen.column < kMargin_px || seen.row < kMargin_px ||
      seen.column > scene.width_px - kMargin_px || seen.row > scene.height_px - kMargin_px) {
    return std::nullopt;
  }
  return seen;
}

void PhotographPlain(const SurveyWorld& world, std::size_t shot, Random& random,
                     SurveyPicture& picture) {
  const SurveyScene& scene = world.scene;
  for (std::size_t i = 0; i < world.plain.size(); ++i) {
    Vector3d at = world.plain[i].at_mm;
    for (const auto& motion : world.moved) {
      if (motion.target == i && shot >= motion.first_after) at += motion.by_mm;
    }
    const double noise_column = scene.sigma_px * random.Normal();
    const double noise_row = scene.sigma_px * random.Normal();
    const bool covered = random.Uniform() < scene.hidden;
    const auto seen = SeenIn(scene, world.shots[shot], at, world.plain[i].normal);
    if (covered || !seen) continue;
    picture.plain.push_back({seen->column + noise_column, seen->row + noise_row, scene.sigma_px});
  }
  const auto stray = static_cast<int>(scene.stray * random.Uniform(0.5, 1.5));
  for (int i = 0; i < stray; ++i) {
    picture.plain.push_back({random.Uniform(0, scene.width_px - 1),
                             random.Uniform(0, scene.height_px - 1), scene.sigma_px});
  }
  // No order tells anything.
  for (std::size_t i = picture.plain.size(); i > 1; --i) {
    std::swap(picture.plain[i - 1], picture.plain[static_cast<std::size_t>(random.Below(i))]);
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
  Random plain_random = Random(seed).Fork(9);
  PlacePlain(scene, plain_random, world);
  return world;
}

SurveyInput Photograph(const SurveyWorld& world, std::uint64_t seed) {
  const SurveyScene& scene = world.scene;
  Random random = Random(seed).Fork(7);
  Random plain_random = Random(seed).Fork(8);
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
      const double noise_column = scene.sigma_px * random.Normal();
      const double noise_row = scene.sigma_px * random.Normal();
      const bool covered = random.Uniform() < scene.hidden;
      const auto seen = SeenIn(scene, shot, at, target.normal);
      if (covered || !seen) continue;
      picture.observations.push_back(
          {id, seen->column + noise_column, seen->row + noise_row, scene.sigma_px});
    }
    PhotographPlain(world, s, plain_random, picture);
  }
  return input;
}

namespace {

// Rotation and translation that bring the world's coded targets to the survey's.
struct ToSurvey {
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d from = Vector3d::Zero();
  Vector3d to = Vector3d::Zero();
  [[nodiscard]] Vector3d operator()(const Vector3d& at) const {
    return rotation * (at - from) + to;
  }
};

ToSurvey FitDatum(const Eigen::MatrixXd& truth, const Eigen::MatrixXd& found) {
  ToSurvey fit;
  fit.from = truth.rowwise().mean();
  fit.to = found.rowwise().mean();
  const Matrix3d cross = (found.colwise() - fit.to) * (truth.colwise() - fit.from).transpose();
  const auto [u, values, v] = geometry::DecomposeSingular(cross);
  Matrix3d mirror = Matrix3d::Identity();
  mirror(2, 2) = Matrix3d(u * v.transpose()).determinant() < 0 ? -1 : 1;
  fit.rotation = u * mirror * v.transpose();
  return fit;
}

}  // namespace

std::vector<PlainNearest> NearestPlain(const SurveyWorld& world, const Survey& survey) {
  std::vector<Vector3d> truth;
  std::vector<Vector3d> found;
  for (const SurveyedTarget& target : survey.targets) {
    if (target.plain) continue;
    truth.push_back(world.targets.at(target.id).at_mm);
    found.push_back(target.at_mm);
  }
  const auto matrix = [](const std::vector<Vector3d>& columns) {
    Eigen::MatrixXd m(3, static_cast<Eigen::Index>(columns.size()));
    for (std::size_t i = 0; i < columns.size(); ++i)
      m.col(static_cast<Eigen::Index>(i)) = columns[i];
    return m;
  };
  const ToSurvey fit = FitDatum(matrix(truth), matrix(found));
  std::vector<PlainNearest> nearest;
  for (const SurveyedTarget& target : survey.targets) {
    if (!target.plain) continue;
    PlainNearest best{target.id, 0, 1e9};
    for (std::size_t i = 0; i < world.plain.size(); ++i) {
      const double off = (fit(world.plain[i].at_mm) - target.at_mm).norm();
      if (off < best.off_mm) best = {target.id, i, off};
    }
    nearest.push_back(best);
  }
  return nearest;
}

SurveyErrors ErrorsOf(const SurveyWorld& world, const Survey& survey) {
  std::vector<std::size_t> nearest;
  for (const PlainNearest& plain : NearestPlain(world, survey)) nearest.push_back(plain.target);
  const auto count = static_cast<Eigen::Index>(survey.targets.size());
  Eigen::MatrixXd found(3, count);
  Eigen::MatrixXd truth(3, count);
  std::size_t plain = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const SurveyedTarget& target = survey.targets[static_cast<std::size_t>(i)];
    found.col(i) = target.at_mm;
    truth.col(i) =
        target.plain ? world.plain[nearest[plain++]].at_mm : world.targets.at(target.id).at_mm;
  }
  const ToSurvey fit = FitDatum(truth, found);
  SurveyErrors errors;
  errors.true_mm = (fit.rotation * (truth.colwise() - fit.from)).colwise() + fit.to;
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

Page PictureOf(const SurveyWorld& world, const WorldShot& shot, const CodeBook& book,
               Random& random) {
  constexpr double kRadius_mm = 13;
  const SurveyScene& scene = world.scene;
  std::vector<trammel::test::DrawnTarget> drawn;
  for (const auto& [id, target] : world.targets) {
    const Eigen::Vector3d ray = target.at_mm - shot.place_mm;
    if (-ray.normalized().dot(target.normal) < std::cos(scene.steepest_incidence_rad)) continue;
    const auto from_world = [&](const Eigen::Vector3d& v) {
      return Eigen::Vector3d(v.dot(shot.right), v.dot(shot.down), v.dot(shot.ahead));
    };
    const Eigen::Vector3d along = target.normal.unitOrthogonal();
    Eigen::Matrix3d h;
    h << kRadius_mm * from_world(along), kRadius_mm * from_world(along.cross(target.normal)),
        from_world(ray);
    Eigen::Matrix3d camera;
    camera << shot.focal_px, 0, 0.5 * (scene.width_px - 1), 0, shot.focal_px,
        0.5 * (scene.height_px - 1), 0, 0, 1;
    h = camera * h;
    const Eigen::Vector2d centre = h.col(2).hnormalized();
    constexpr double kMargin_px = 40;
    if (h(2, 2) < 100 || centre.x() < kMargin_px || centre.y() < kMargin_px ||
        centre.x() > scene.width_px - kMargin_px || centre.y() > scene.height_px - kMargin_px) {
      continue;
    }
    trammel::test::DrawnTarget one;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) one.h[r][c] = h(r, c) / h(2, 2);
    }
    one.bits = book.bits;
    one.word = book.words.at(std::stoul(id) - 1);
    drawn.push_back(one);
  }
  return trammel::test::Expose(trammel::test::Draw(scene.width_px, scene.height_px, drawn, {}), 1.0,
                               random);
}

void NumberBarEnds(SurveyWorld& world, int first) {
  for (auto& bar : world.bars) {
    for (std::string* end : {&bar.from, &bar.to}) {
      const std::string number = std::to_string(first++);
      world.targets[number] = world.targets.at(*end);
      world.targets.erase(*end);
      *end = number;
    }
  }
}

}  // namespace trammel::part_alignment::test
