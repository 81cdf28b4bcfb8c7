#include "part_alignment/part_fit/fit_start.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "base/parallel.h"
#include "geometry/decompositions.h"
#include "geometry/euler.h"
#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Middle and principal axes of a set of points.
struct Spread {
  double weight = 0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();

  void Add(const Vector3d& at, double w) {
    weight += w;
    first += w * at;
    second += w * at * at.transpose();
  }
  [[nodiscard]] Vector3d Middle() const { return first / weight; }
  // Returns the axes as columns by rising extent, right-handed.
  [[nodiscard]] Matrix3d Axes() const {
    const Vector3d middle = Middle();
    const geometry::SymmetricEigen of =
        geometry::DecomposeSymmetric(second / weight - middle * middle.transpose());
    Matrix3d axes = of.vectors;
    if (axes.determinant() < 0) axes.col(0) *= -1;
    return axes;
  }
};

std::vector<const MeshDistance*> MeshesOf(const Problem& problem) {
  std::vector<const MeshDistance*> meshes;
  for (const SurfaceContact& contact : problem.contacts) {
    const MeshDistance* mesh = contact.surface->mesh.get();
    if (mesh != nullptr && std::find(meshes.begin(), meshes.end(), mesh) == meshes.end()) {
      meshes.push_back(mesh);
    }
  }
  return meshes;
}

Spread SpreadOfMeshes(const Problem& problem) {
  Spread spread;
  for (const MeshDistance* mesh : MeshesOf(problem)) {
    const TriangleMesh& triangles = mesh->mesh();
    for (const Triangle& triangle : triangles.triangles) {
      const double area = AreaVector(triangles, triangle).norm() / 2;
      for (std::size_t k = 0; k < 3; ++k) {  // exact for second moments: the edges' middles
        spread.Add(
            (triangles.vertices_mm[triangle[k]] + triangles.vertices_mm[triangle[(k + 1) % 3]]) / 2,
            area / 3);
      }
    }
  }
  return spread;
}

Spread SpreadOfPoints(const Problem& problem) {
  Spread spread;
  for (const SurfaceContact& contact : problem.contacts) {
    if (contact.surface->kind == SurfaceKind::kMesh) spread.Add(contact.at_mm, 1);
  }
  return spread;
}

// Returns the 24 rotations of a cube onto itself.
std::vector<Matrix3d> CubeRotations() {
  std::vector<Matrix3d> rotations;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d m = Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) {
        m(i, order[static_cast<std::size_t>(i)]) = ((signs >> i) & 1) != 0 ? -1 : 1;
      }
      if (m.determinant() > 0) rotations.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return rotations;
}

// Returns rotations spread over all: Shoemake's uniform quaternions of an additive sequence.
std::vector<Matrix3d> SpreadRotations(int count) {
  std::vector<Matrix3d> rotations;
  const auto part = [](double x) { return x - std::floor(x); };
  for (int i = 0; i < count; ++i) {
    const double u = part(0.5 + 0.8191725133961645 * i);
    const double v = 2 * std::numbers::pi * part(0.5 + 0.6710436067037893 * i);
    const double w = 2 * std::numbers::pi * part(0.5 + 0.5497004779019703 * i);
    const double a = std::sqrt(1 - u);
    const double b = std::sqrt(u);
    rotations.push_back(
        Eigen::Quaterniond(b * std::cos(w), a * std::sin(v), a * std::cos(v), b * std::sin(w))
            .normalized()
            .toRotationMatrix());
  }
  return rotations;
}

FoundPlacement Refined(const Problem& problem, const Motion& start, int max_rounds) {
  const Motion motion = FitSurfaces(problem, start, max_rounds);
  return {motion, Scatter_mm(problem, Linearise(problem, motion))};
}

// Refines all, the most even first; retains the first of equal placements.
std::vector<FoundPlacement> RefineAll(const Problem& problem,
                                      const std::vector<FoundPlacement>& starts, int max_rounds) {
  std::vector<FoundPlacement> refined(starts.size());
  ParallelFor(static_cast<int>(starts.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    refined[at] = Refined(problem, starts[at].motion, max_rounds);
  });
  std::stable_sort(
      refined.begin(), refined.end(),
      [](const FoundPlacement& a, const FoundPlacement& b) { return a.scatter_mm < b.scatter_mm; });
  std::vector<FoundPlacement> different;
  for (const FoundPlacement& one : refined) {
    if (std::none_of(different.begin(), different.end(), [&](const FoundPlacement& other) {
          return SamePlacement(problem, one.motion, other.motion);
        })) {
      different.push_back(one);
    }
  }
  return different;
}

double FarthestFrom(const Vector3d& from, const std::vector<Vector3d>& points, Vector3d& at) {
  double most = 0;
  for (const Vector3d& point : points) {
    const double distance = (point - from).norm();
    if (distance >= most) {
      most = distance;
      at = point;
    }
  }
  return most;
}

// Returns the distance of two points far apart: the diameter to within a seventh.
double ExtentOf(const std::vector<Vector3d>& points) {
  Vector3d at = points.front();
  FarthestFrom(points.front(), points, at);
  const Vector3d first = at;
  return FarthestFrom(first, points, at);
}

}  // namespace

// Fits Kabsch's rotation between the middles of the surfaces and of their points.
std::optional<Motion> StartFromMiddles(const Problem& problem) {
  std::map<const IdealSurface*, std::pair<Vector3d, int>> sums;
  for (const SurfaceContact& contact : problem.contacts) {
    if (contact.surface->kind == SurfaceKind::kMesh) continue;
    auto& [sum, count] = sums.try_emplace(contact.surface, Vector3d::Zero(), 0).first->second;
    sum += contact.at_mm;
    ++count;
  }
  if (sums.size() < 3) return std::nullopt;
  const auto count = static_cast<double>(sums.size());
  Vector3d ideal_mean = Vector3d::Zero();
  Vector3d measured_mean = Vector3d::Zero();
  for (const auto& [surface, sum] : sums) {
    ideal_mean += surface->middle_mm / count;
    measured_mean += sum.first / sum.second / count;
  }
  Matrix3d cross = Matrix3d::Zero();
  for (const auto& [surface, sum] : sums) {
    cross +=
        (surface->middle_mm - ideal_mean) * (sum.first / sum.second - measured_mean).transpose();
  }
  const geometry::SingularValues of = geometry::DecomposeSingular(cross);
  const Matrix3d u = of.u;
  const Matrix3d v = of.v;
  constexpr double kLine = 1e-3;
  if (!(of.values[1] > kLine * of.values[0])) return std::nullopt;
  Matrix3d flip = Matrix3d::Identity();
  if (u.determinant() * v.determinant() < 0) flip(2, 2) = -1;
  Motion motion;
  motion.rotation = u * flip * v.transpose();
  motion.translation_mm = ideal_mean - motion.rotation * measured_mean;
  return motion;
}

std::vector<FoundPlacement> SearchPlacements(const Problem& problem) {
  const Spread of_mesh = SpreadOfMeshes(problem);
  const Spread of_points = SpreadOfPoints(problem);
  std::vector<FoundPlacement> starts;
  const auto add = [&](const Matrix3d& rotation) {
    starts.push_back({{rotation, of_mesh.Middle() - rotation * of_points.Middle()}, 0});
  };
  for (const Matrix3d& cube : CubeRotations()) {
    add(of_mesh.Axes() * cube * of_points.Axes().transpose());
  }
  constexpr int kSpread = 48;
  for (const Matrix3d& rotation : SpreadRotations(kSpread)) add(rotation);
  if (const auto middles = StartFromMiddles(problem)) starts.push_back({*middles, 0});
  struct Stage {
    std::size_t contacts;
    int rounds;
    std::size_t keep;
  };
  for (const Stage& stage : {Stage{60, 8, 16}, Stage{120, 15, 8}, Stage{500, 25, 8}}) {
    starts = RefineAll(Thinned(problem, stage.contacts), starts, stage.rounds);
    if (starts.size() > stage.keep) starts.resize(stage.keep);
  }
  return starts;
}

bool SamePlacement(const Problem& problem, const Motion& a, const Motion& b) {
  constexpr double kNear = 0.03;  // relative to part size, and rad
  const double turn = Eigen::AngleAxisd(a.rotation.transpose() * b.rotation).angle();
  Vector3d middle = Vector3d::Zero();
  for (const SurfaceContact& contact : problem.contacts) {
    middle += contact.at_mm / static_cast<double>(problem.contacts.size());
  }
  return turn < kNear && (a(middle) - b(middle)).norm() < kNear * problem.size_mm;
}

std::string TurnText(const Motion& from, const Motion& to) {
  const Eigen::AngleAxisd turn(to.rotation * from.rotation.transpose());
  constexpr double kDegrees = 180 / std::numbers::pi;
  return fmt::format("turned by {:.1f}° about ({:.2f}, {:.2f}, {:.2f})", kDegrees * turn.angle(),
                     turn.axis().x(), turn.axis().y(), turn.axis().z());
}

double DiameterOf(const MeshDistance& mesh) {
  Vector3d low = mesh.mesh().vertices_mm.front();
  Vector3d high = low;
  for (const Vector3d& at : mesh.mesh().vertices_mm) {
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  return (high - low).norm();
}

std::string OtherSize(const Problem& problem) {
  std::map<const MeshDistance*, std::vector<Vector3d>> points;
  std::map<const MeshDistance*, std::string> names;
  for (const SurfaceContact& contact : problem.contacts) {
    if (contact.surface->kind != SurfaceKind::kMesh) continue;
    points[contact.surface->mesh.get()].push_back(contact.at_mm);
    names.try_emplace(contact.surface->mesh.get(), contact.surface->id);
  }
  constexpr double kMaxTimes = 3;
  constexpr double kMinPart = 1.0 / 8;  // fewer sides of a part do not hold it
  for (const auto& [mesh, at_mm] : points) {
    const double measured_mm = ExtentOf(at_mm);
    const double mesh_mm = ExtentOf(mesh->mesh().vertices_mm);
    const double times = measured_mm / mesh_mm;
    if (times <= kMaxTimes && times >= kMinPart) continue;
    std::string why;
    struct Unit {
      double factor;
      const char* words;
    };
    constexpr double kNearUnit = 0.15;  // stock, and sides that were not measured
    for (const Unit& unit :
         {Unit{25.4, "25.4, an inch in mm"}, Unit{1000, "1000, a metre in mm"},
          Unit{10, "10, a centimetre in mm"}, Unit{1000 / 25.4, "39.4, a metre in inches"}}) {
      const double ratio = std::max(times, 1 / times);
      if (std::abs(ratio / unit.factor - 1) < kNearUnit) {
        why = fmt::format(", near {}: state the unit of the mesh or of the points", unit.words);
      }
    }
    return fmt::format(
        "the mesh of {} spans {:.6g} mm, its points {:.6g} mm: {:.3g} times too {}{}", names[mesh],
        mesh_mm, measured_mm, std::max(times, 1 / times), times > 1 ? "small" : "large",
        why.empty() ? ": another part, or another unit" : why);
  }
  return {};
}

}  // namespace trammel::part_alignment
