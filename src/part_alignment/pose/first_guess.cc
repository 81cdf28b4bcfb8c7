#include "part_alignment/pose/first_guess.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix93 = Eigen::Matrix<double, 9, 3>;
using Matrix39 = Eigen::Matrix<double, 3, 9>;

struct Line {
  Vector3d origin_mm;
  Vector3d direction;
  Vector3d part_mm;  // the target, from the middle of all
};

/// The lines of sight in the machine's frame; empty where a pixel has none.
std::vector<Line> MachineLines(const PoseProblem& problem, double clamp_angle_rad,
                               const Vector3d& middle_mm) {
  const geometry::Pose& taper = problem.camera.taper_from_camera;
  const Matrix3d turn = geometry::RotationFromAngles({0, 0, -clamp_angle_rad});
  const Matrix3d spindle_from_camera = turn * geometry::RotationFromAngles(taper.angles_rad);
  std::vector<Line> lines;
  for (const WeightedObservation& observation : problem.observations) {
    const auto direction = LineOfSight(problem.camera, observation.pixel);
    if (!direction) {
      return {};
    }
    const Matrix3d machine_from_spindle = observation.spindle_from_machine.transpose();
    lines.push_back({machine_from_spindle * (turn * taper.translation_mm) + observation.spindle_mm,
                     machine_from_spindle * (spindle_from_camera * *direction),
                     observation.part_mm - middle_mm});
  }
  return lines;
}

/// Squared distances from the lines as quadratic / 2 - linear of the rotation's nine entries
/// (column by column), and the best translation for each rotation.
struct LineEnergy {
  Matrix9 quadratic;
  Vector9 linear;
  Vector3d shift;
  Matrix39 shift_by_rotation;

  [[nodiscard]] Vector3d Translation(const Vector9& rotation) const {
    return shift - shift_by_rotation * rotation;
  }
};

LineEnergy EnergyOf(const std::vector<Line>& lines) {
  constexpr double kPull = 1e-9;
  constexpr double kUsualDistance_mm = 300;
  Matrix9 rr = Matrix9::Zero();
  Matrix39 dr = Matrix39::Zero();
  Matrix3d dd = Matrix3d::Zero();
  Vector9 r = Vector9::Zero();
  Vector3d d = Vector3d::Zero();
  for (const Line& line : lines) {
    // Parallel lines leave the way along them open: a slight pull towards a usual distance.
    const Matrix3d pull =
        (1 + kPull) * Matrix3d::Identity() - line.direction * line.direction.transpose();
    const Vector3d aim = pull * line.origin_mm + kPull * kUsualDistance_mm * line.direction;
    Matrix39 by_rotation;
    for (int i = 0; i < 3; ++i) {
      by_rotation.middleCols<3>(3 * i) = pull * line.part_mm[i];
      r.segment<3>(3 * i) += line.part_mm[i] * aim;
      for (int k = 0; k < 3; ++k) {
        rr.block<3, 3>(3 * i, 3 * k) += line.part_mm[i] * line.part_mm[k] * pull;
      }
    }
    dr += by_rotation;
    dd += pull;
    d += aim;
  }
  LineEnergy energy;
  energy.shift = geometry::SolveSymmetric(dd, d);
  energy.shift_by_rotation = geometry::SolveSymmetric(dd, dr);
  energy.quadratic = rr - dr.transpose().lazyProduct(energy.shift_by_rotation);
  energy.linear = r - dr.transpose() * energy.shift;
  return energy;
}

Vector9 Entries(const Matrix3d& rotation) { return Eigen::Map<const Vector9>(rotation.data()); }

double Value(const LineEnergy& energy, const Vector9& r) {
  return r.dot(energy.quadratic * r) - 2 * r.dot(energy.linear);
}

/// Gauss-Newton on the rotations, damped.
Matrix3d DescendRotation(const LineEnergy& energy, Matrix3d rotation) {
  constexpr int kSteps = 40;
  double damping = 1e-3;
  double value = Value(energy, Entries(rotation));
  for (int i = 0; i < kSteps; ++i) {
    Matrix93 by_turn;
    for (int axis = 0; axis < 3; ++axis) {
      Matrix3d turned;
      for (int column = 0; column < 3; ++column) {
        turned.col(column) = Vector3d::Unit(axis).cross(rotation.col(column));
      }
      by_turn.col(axis) = Entries(turned);
    }
    const Vector3d down =
        by_turn.transpose() * (energy.linear - energy.quadratic * Entries(rotation));
    const Matrix93 slope_by_turn = energy.quadratic.lazyProduct(by_turn);
    Matrix3d curvature = by_turn.transpose().lazyProduct(slope_by_turn);
    curvature.diagonal().array() += damping * (curvature.trace() + 1e-12);
    const Vector3d turn = geometry::SolveSmallSymmetric(curvature, down);
    if (!(turn.norm() > 1e-7)) {
      break;
    }
    const Matrix3d next = geometry::RotationFromVector(turn) * rotation;
    const double next_value = Value(energy, Entries(next));
    if (next_value <= value) {
      rotation = next;
      value = next_value;
      damping = std::max(damping / 5, 1e-9);
    } else {
      damping *= 8;
    }
  }
  return rotation;
}

/// The 24 turns of a cube onto itself, and the same about a frame turned by half a radian per axis.
std::vector<Matrix3d> Starts() {
  std::vector<Matrix3d> starts;
  const double quarter = std::numbers::pi / 2;
  const std::array<Vector3d, 6> faces{Vector3d(0, 0, 0),           Vector3d(quarter, 0, 0),
                                      Vector3d(2 * quarter, 0, 0), Vector3d(3 * quarter, 0, 0),
                                      Vector3d(0, quarter, 0),     Vector3d(0, -quarter, 0)};
  const Matrix3d between = geometry::RotationFromAngles({0.5, 0.5, 0.5});
  for (const Vector3d& face : faces) {
    for (int turn = 0; turn < 4; ++turn) {
      const Matrix3d start =
          geometry::RotationFromAngles({0, 0, turn * quarter}) * geometry::RotationFromAngles(face);
      starts.push_back(start);
      starts.push_back(between * start);
    }
  }
  return starts;
}

struct Candidate {
  double value;
  Matrix3d rotation;
  Vector3d translation_mm;
};

bool InFront(const std::vector<Line>& lines, const Candidate& candidate) {
  return std::all_of(lines.begin(), lines.end(), [&](const Line& line) {
    const Vector3d there_mm = candidate.rotation * line.part_mm + candidate.translation_mm;
    return line.direction.dot(there_mm - line.origin_mm) > 0;
  });
}

}  // namespace

std::vector<Theta> FirstGuesses(const PoseProblem& problem, double clamp_angle_rad,
                                std::size_t most) {
  constexpr double kSame = 1e-3;  // of rotation entries
  const MiddleFrame frame = MiddleFrameOf(problem, Matrix3d::Identity());
  const std::vector<Line> lines = MachineLines(problem, clamp_angle_rad, frame.middle_mm);
  if (lines.empty()) {
    return {};
  }
  const LineEnergy energy = EnergyOf(lines);
  std::vector<Candidate> candidates;
  for (const Matrix3d& start : Starts()) {
    const Matrix3d rotation = DescendRotation(energy, start);
    const Candidate found{Value(energy, Entries(rotation)), rotation,
                          energy.Translation(Entries(rotation))};
    const bool known = std::any_of(
        candidates.begin(), candidates.end(),
        [&](const Candidate& candidate) { return (candidate.rotation - rotation).norm() < kSame; });
    if (!known && InFront(lines, found)) {
      candidates.push_back(found);
    }
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.value < b.value; });
  std::vector<Theta> guesses;
  Clamping clamping;
  clamping.angle_rad = clamp_angle_rad;
  for (std::size_t i = 0; i < std::min(most, candidates.size()); ++i) {
    const geometry::Pose pose{
        candidates[i].translation_mm - candidates[i].rotation * frame.middle_mm,
        geometry::AnglesFromRotation(candidates[i].rotation)};
    guesses.push_back(ThetaOf(problem, pose, clamping));
  }
  return guesses;
}

}  // namespace trammel::part_alignment
