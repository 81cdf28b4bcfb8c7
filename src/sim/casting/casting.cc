#include "sim/casting/casting.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

#include "base/random.h"

namespace trammel::sim {

using Eigen::Vector3d;

Freeform DrawFreeform(const Vector3d& half_mm, std::uint64_t seed) {
  Random random(seed);
  Freeform part{half_mm, {}};
  constexpr int kBumps = 6;
  for (int i = 0; i < kBumps; ++i) {
    const Vector3d towards(random.Normal(), random.Normal(), random.Normal());
    const double height = (i % 2 == 0 ? 1 : -1) * random.Uniform(0.05, 0.15);
    part.bumps.push_back({towards.normalized(), height, random.Uniform(2, 5)});
  }
  return part;
}

Vector3d SurfacePoint(const Freeform& part, const Vector3d& u) {
  double radius = 1;
  for (const FreeformBump& bump : part.bumps) {
    radius += bump.height * std::exp(bump.sharpness * (u.dot(bump.towards) - 1));
  }
  return radius * part.half_mm.cwiseProduct(u);
}

Vector3d SurfaceNormal(const Freeform& part, const Vector3d& u) {
  double radius = 1;
  Vector3d gradient = Vector3d::Zero();
  for (const FreeformBump& bump : part.bumps) {
    const double lift = bump.height * std::exp(bump.sharpness * (u.dot(bump.towards) - 1));
    radius += lift;
    gradient += lift * bump.sharpness * bump.towards;
  }
  const Vector3d aside = u.unitOrthogonal();
  const Vector3d across = u.cross(aside);
  const auto along = [&](const Vector3d& e) -> Vector3d {
    return part.half_mm.cwiseProduct(radius * e + gradient.dot(e) * u);
  };
  return along(aside).cross(along(across)).normalized();
}

double StockAt(const Freeform& part, const Vector3d& at_mm) {
  Vector3d u = at_mm.cwiseQuotient(part.half_mm).normalized();
  constexpr int kMaxRounds = 200;
  constexpr double kStill_mm = 1e-10;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Vector3d off = at_mm - SurfacePoint(part, u);
    const Vector3d normal = SurfaceNormal(part, u);
    const Vector3d aside = off - off.dot(normal) * normal;
    if (aside.norm() < kStill_mm) break;
    // Less than a full step: a step along u also changes the radius.
    constexpr double kShare = 0.7;
    u = (u + kShare * aside.cwiseQuotient(part.half_mm)).normalized();
  }
  const Vector3d off = at_mm - SurfacePoint(part, u);
  return off.dot(SurfaceNormal(part, u)) < 0 ? -off.norm() : off.norm();
}

namespace {

using Eigen::Vector3d;
using Six = Eigen::Matrix<double, 6, 1>;

Eigen::Matrix3d DrawRotation(Random& random) {
  return Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
      .normalized()
      .toRotationMatrix();
}

// Returns a spiral of directions over the sphere, each randomly shifted a little.
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

// Computes the stock's derivative over a small motion about the origin.
Six Row(const Vector3d& at_mm, const Vector3d& normal, double size_mm) {
  Six row;
  row << normal, at_mm.cross(normal) / size_mm;
  return row;
}

// Changes the stock of all points except the dents by the minimum amount that balances their
// gradient with the dents' multipliers.
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
        traits.missing_mm ? traits.min_mm - *traits.missing_mm
                          : traits.wanted_mm + traits.waves_mm * std::sin(4 * u.dot(wave) + phase));
  }
  casting.dent.assign(directions.size(), false);
  for (int i = 0; i < traits.dents && !traits.missing_mm; ++i) {
    const std::size_t at = random.Below(directions.size());
    casting.dent[at] = true;
    casting.stock_mm[at] = traits.min_mm;
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

namespace {

using Eigen::Vector3d;

void PutWord(std::string& bytes, std::uint32_t word) {
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>((word >> (8 * i)) & 0xffU));
}

void PutVector(std::string& bytes, const Vector3d& v) {
  for (const double x : v) PutWord(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(x)));
}

Vector3d FacetNormal(const Facet& facet) {
  const Vector3d cross = (facet[1] - facet[0]).cross(facet[2] - facet[0]);
  return cross.norm() > 0 ? Vector3d(cross.normalized()) : Vector3d::Zero();
}

}  // namespace

std::vector<Facet> FreeformFacets(const Freeform& part, int steps) {
  std::vector<Facet> facets;
  facets.reserve(12U * static_cast<std::size_t>(steps) * static_cast<std::size_t>(steps));
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      // Uses the same integers at an edge of the cube from either of its sides: the same corner.
      const auto corner = [&](int i, int j) {
        Vector3d u;
        u[axis] = side * steps;
        u[(axis + 1) % 3] = 2 * i - steps;
        u[(axis + 2) % 3] = 2 * j - steps;
        return SurfacePoint(part, u.normalized());
      };
      for (int i = 0; i < steps; ++i) {
        for (int j = 0; j < steps; ++j) {
          const Vector3d a = corner(i, j);
          const Vector3d b = corner(i + 1, j);
          const Vector3d c = corner(i + 1, j + 1);
          const Vector3d d = corner(i, j + 1);
          const bool rising = (i + j) % 2 == 0;
          Facet first = rising ? Facet{a, b, c} : Facet{a, b, d};
          Facet second = rising ? Facet{a, c, d} : Facet{b, c, d};
          if (side < 0) {
            std::swap(first[1], first[2]);
            std::swap(second[1], second[2]);
          }
          facets.push_back(first);
          facets.push_back(second);
        }
      }
    }
  }
  return facets;
}

std::string BinaryStl(const std::vector<Facet>& facets, double per_mm) {
  std::string bytes(80, ' ');
  bytes.reserve(84 + 50 * facets.size());
  PutWord(bytes, static_cast<std::uint32_t>(facets.size()));
  for (const Facet& facet : facets) {
    PutVector(bytes, FacetNormal(facet));
    for (const Vector3d& corner : facet) PutVector(bytes, per_mm * corner);
    bytes.append(2, '\0');
  }
  return bytes;
}

}  // namespace trammel::sim
