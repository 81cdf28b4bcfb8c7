#include "sim/casting/casting.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/random.h"

namespace trammel::sim {
namespace {

using Eigen::Vector3d;
using Six = Eigen::Matrix<double, 6, 1>;

Eigen::Matrix3d DrawRotation(Random& random) {
  return Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
      .normalized()
      .toRotationMatrix();
}

// A spiral over the sphere, each direction moved a little.
std::vector<Vector3d> Directions(const CastingTraits& traits, Random& random) {
  std::vector<Vector3d> directions;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double spacing = std::sqrt(4 * std::numbers::pi / traits.points);
  for (int i = 0; i < traits.points; ++i) {
    const double z = traits.seen_from_z + (1 - traits.seen_from_z) * (i + 0.5) / traits.points;
    const double r = std::sqrt(1 - z * z);
    Vector3d u(r * std::cos(golden * i), r * std::sin(golden * i), z);
    for (double& x : u) x += 0.2 * spacing * random.Normal();
    directions.push_back(u.normalized());
  }
  return directions;
}

// How the stock at a point follows a small motion about the origin.
Six Row(const Vector3d& at_mm, const Vector3d& normal, double size_mm) {
  Six row;
  row << normal, at_mm.cross(normal) / size_mm;
  return row;
}

// Changes the stock of all points but the dents, as little as can be, until the pull of all of them
// is what the dents take up.
void Balance(const std::vector<Six>& rows, const CastingTraits& traits, Casting& casting) {
  Six wanted = Six::Zero();
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  const auto n = static_cast<double>(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    wanted -= (casting.stock_mm[i] - traits.wanted_mm) * rows[i];
    if (casting.dent[i]) {
      wanted += n * traits.pressing_mm * rows[i];
    } else {
      normal += rows[i] * rows[i].transpose();
    }
  }
  const Six by_row = normal.ldlt().solve(wanted);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!casting.dent[i]) casting.stock_mm[i] += rows[i].dot(by_row);
  }
}

}  // namespace

Casting DrawCasting(const Freeform& part, const CastingTraits& traits, std::uint64_t seed) {
  Random random = Random(seed).Fork(1);
  Casting casting;
  casting.rotation = DrawRotation(random);
  for (double& mm : casting.translation_mm) mm = random.Uniform(-1000, 1000);
  const std::vector<Vector3d> directions = Directions(traits, random);
  const Vector3d wave(random.Normal(), random.Normal(), random.Normal());
  const double phase = random.Uniform(0, 2 * std::numbers::pi);
  std::vector<Six> rows;
  for (const Vector3d& u : directions) {
    rows.push_back(Row(SurfacePoint(part, u), SurfaceNormal(part, u), part.half_mm.maxCoeff()));
    casting.stock_mm.push_back(
        traits.missing_mm ? traits.least_mm - *traits.missing_mm
                          : traits.wanted_mm + traits.waves_mm * std::sin(4 * u.dot(wave) + phase));
  }
  casting.dent.assign(directions.size(), false);
  for (int i = 0; i < traits.dents && !traits.missing_mm; ++i) {
    const std::size_t at = random.Below(directions.size());
    casting.dent[at] = true;
    casting.stock_mm[at] = traits.least_mm;
  }
  if (!traits.missing_mm) Balance(rows, traits, casting);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Vector3d ideal = SurfacePoint(part, directions[i]) +
                           casting.stock_mm[i] * SurfaceNormal(part, directions[i]);
    casting.ideal_mm.push_back(ideal);
    casting.measured_mm.push_back(casting.rotation.transpose() * (ideal - casting.translation_mm));
  }
  return casting;
}

}  // namespace trammel::sim
