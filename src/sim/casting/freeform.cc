#include "sim/casting/freeform.h"

#include <Eigen/Geometry>
#include <cmath>

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
  constexpr int kMostRounds = 200;
  constexpr double kStill_mm = 1e-10;
  for (int round = 0; round < kMostRounds; ++round) {
    const Vector3d off = at_mm - SurfacePoint(part, u);
    const Vector3d normal = SurfaceNormal(part, u);
    const Vector3d aside = off - off.dot(normal) * normal;
    if (aside.norm() < kStill_mm) break;
    // Short of the whole way: a step along u changes the radius, too.
    constexpr double kShare = 0.7;
    u = (u + kShare * aside.cwiseQuotient(part.half_mm)).normalized();
  }
  const Vector3d off = at_mm - SurfacePoint(part, u);
  return off.dot(SurfaceNormal(part, u)) < 0 ? -off.norm() : off.norm();
}

}  // namespace trammel::sim
