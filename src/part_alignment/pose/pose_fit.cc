#include "part_alignment/pose/pose_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/joint_fit.h"
#include "part_alignment/pose/observability.h"
#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Normal equations at one theta.
struct Normal {
  ThetaMatrix matrix;
  Theta right;
  double chi_square = std::numeric_limits<double>::infinity();
};

bool Build(const PoseProblem& problem, const Theta& theta, const CauchyLoss& loss, Normal& normal) {
  const Chain chain(problem, theta, true);
  normal.matrix.setZero(theta.size(), theta.size());
  normal.right.setZero(theta.size());
  normal.chi_square = 0;
  Eigen::Vector2d residual_px;
  ObservationDerivative derivative;
  for (const WeightedObservation& observation : problem.observations) {
    if (!chain.ResidualAndDerivative(observation, residual_px, derivative)) {
      normal.chi_square = std::numeric_limits<double>::infinity();
      return false;
    }
    const double pixel_weight = 1 / (observation.sigma_px * observation.sigma_px);
    const double square = pixel_weight * residual_px.squaredNorm();
    const double weight = pixel_weight * loss.Weight(square);
    normal.matrix.noalias() += weight * derivative.transpose().lazyProduct(derivative);
    normal.right.noalias() += weight * derivative.transpose().lazyProduct(residual_px);
    normal.chi_square += loss.Cost(square);
  }
  return std::isfinite(normal.chi_square);
}

/// Computes the step with each unknown scaled to its own column. The ridge bounds a direction that
/// nothing determines. It costs the others a factor 1e-9 / (their share), some 1e-5, of each step,
/// which the next one corrects.
Theta Step(const Normal& normal, double damping) {
  constexpr double kRidge = 1e-9;
  const Theta scale =
      normal.matrix.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 1.0; });
  ThetaMatrix scaled = scale.asDiagonal() * normal.matrix * scale.asDiagonal();
  scaled.diagonal().array() += kRidge + damping;
  const Theta right = scale.cwiseProduct(normal.right);
  const Theta step = geometry::SolveSmallSymmetric(scaled, right);
  return scale.cwiseProduct(step);
}

}  // namespace

Descent Descend(const PoseProblem& problem, const Theta& start, const CauchyLoss& loss) {
  constexpr int kMaxSteps = 60;
  constexpr double kStill = 1e-16;    // change of squared sigmas
  constexpr double kRounding = 1e-9;  // chi-square increase within rounding error
  constexpr double kFirstDamping = 1e-4;
  constexpr double kMinDamping = 1e-7;
  constexpr double kMaxDamping = 1e12;
  Descent descent{start, std::numeric_limits<double>::infinity(), 0, false};
  Normal here;
  if (!Build(problem, start, loss, here)) {
    return descent;
  }
  Normal there;
  double damping = 0;
  while (descent.steps < kMaxSteps && damping < kMaxDamping) {
    const Theta step = Step(here, damping);
    const double promised = step.dot(here.right);
    const Theta next = descent.theta + step;
    ++descent.steps;
    const bool seen = next.allFinite() && Build(problem, next, loss, there);
    const bool still = damping == 0 && promised < kStill;
    if (seen && (there.chi_square <= here.chi_square || still)) {
      descent.theta = next;
      here = there;
      damping = damping / 10 < kMinDamping ? 0 : damping / 10;
    } else if (promised < kRounding * (1e-6 + here.chi_square) && damping == 0) {
      descent.converged = true;
      break;
    } else {
      damping = damping == 0 ? kFirstDamping : damping * 10;
    }
    if (still) {
      descent.converged = true;
      break;
    }
  }
  descent.chi_square = here.chi_square;
  return descent;
}

namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix93 = Eigen::Matrix<double, 9, 3>;
using Matrix39 = Eigen::Matrix<double, 3, 9>;

struct Line {
  Vector3d origin_mm;
  Vector3d direction;
  Vector3d part_mm;  // the target, from the middle of all
};

/// Computes the lines of sight in the machine's frame; empty if a pixel has none.
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
    // Parallel lines do not determine the position along them: a slight pull to a usual distance.
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

/// Minimises by damped Gauss-Newton on the rotations.
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

/// Returns the 24 rotations of a cube onto itself, and the same about a frame rotated by half a
/// radian per axis.
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
  constexpr double kSame = 1e-3;  // change of rotation entries
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

namespace {

constexpr double kOneIn = 1e-4;
/// Limit for an answer without redundancy: it must fit exactly.
constexpr double kExact = 1e-6;

/// True if two solutions differ by more than rounding.
bool Differ(const PoseProblem& problem, const Theta& a, const Theta& b) {
  constexpr double kApart = 1e-3;
  const Layout layout = LayoutOf(problem.unknowns);
  const auto turn = [](const Theta& theta) {
    return geometry::RotationFromAngles(theta.segment<3>(3));
  };
  const double clamp = layout.clamp_angle >= 0 ? a[layout.clamp_angle] - b[layout.clamp_angle] : 0;
  return (turn(a) - turn(b)).norm() > kApart ||
         std::abs(std::remainder(clamp, 2 * std::numbers::pi)) > kApart;
}

}  // namespace

int DegreesOfFreedom(const PoseProblem& problem) {
  return 2 * static_cast<int>(problem.observations.size()) - LayoutOf(problem.unknowns).size;
}

bool FullRank(const PoseProblem& problem, const Theta& theta) {
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(theta.segment<3>(3)));
  const Observability seen =
      Observe(InMiddleFrame(problem, frame), ToMiddleFrame(frame, theta), kUnseen_mm);
  return seen.rank == seen.unknowns;
}

double ChiSquareHigh(int degrees_of_freedom) {
  return degrees_of_freedom > 0 ? ChiSquareQuantile(1 - kOneIn, degrees_of_freedom) : kExact;
}

double ChiSquareLow(int degrees_of_freedom) {
  return degrees_of_freedom > 0 ? ChiSquareQuantile(kOneIn, degrees_of_freedom) : 0;
}

Descent Refine(const PoseProblem& problem, const Theta& guess) {
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(guess.segment<3>(3)));
  PoseProblem middle = InMiddleFrame(problem, frame);
  Theta theta = ToMiddleFrame(frame, guess);
  Unknowns few;
  few.clamp_angle = problem.unknowns.clamp_angle;
  const int few_count = LayoutOf(few).size;
  if (few_count < theta.size()) {
    middle.unknowns = few;
    theta.head(few_count) = Descend(middle, theta.head(few_count)).theta;
    middle.unknowns = problem.unknowns;
  }
  Descent descent = Descend(middle, theta);
  descent.theta = FromMiddleFrame(frame, descent.theta);
  descent.chi_square = JointChiSquare(problem, descent.theta);
  const Layout layout = LayoutOf(problem.unknowns);
  if (layout.clamp_angle >= 0) {
    descent.theta[layout.clamp_angle] =
        std::remainder(descent.theta[layout.clamp_angle], 2 * std::numbers::pi);
  }
  return descent;
}

Fit FitFrom(const PoseProblem& problem, const std::vector<double>& clamp_angles_rad) {
  constexpr std::size_t kGuesses = 6;
  const double high = ChiSquareHigh(DegreesOfFreedom(problem));
  Fit fit;
  fit.chi_square = std::numeric_limits<double>::infinity();
  std::vector<Theta> fitting;
  for (const double angle_rad : clamp_angles_rad) {
    for (const Theta& guess : FirstGuesses(problem, angle_rad, kGuesses)) {
      const Descent descent = Refine(problem, guess);
      if (descent.chi_square <= high) {
        fitting.push_back(descent.theta);
      }
      if (descent.chi_square < fit.chi_square) {
        fit = {true, descent.converged, descent.theta, descent.chi_square, descent.steps, {}};
      }
    }
  }
  for (const Theta& theta : fitting) {
    if (Differ(problem, theta, fit.theta)) {
      fit.other = theta;
    }
  }
  return fit;
}

Fit SolveWithoutInitialGuess(const PoseProblem& problem) {
  const Fit near = FitFrom(problem, {0});
  if (!problem.unknowns.clamp_angle ||
      (near.found && near.chi_square <= ChiSquareHigh(DegreesOfFreedom(problem)))) {
    return near;
  }
  constexpr int kAround = 24;
  std::vector<double> angles_rad;
  for (int i = 1; i < kAround; ++i) {
    angles_rad.push_back(i * 2 * std::numbers::pi / kAround);
  }
  const Fit far = FitFrom(problem, angles_rad);
  return far.found && (!near.found || far.chi_square < near.chi_square) ? far : near;
}

Result<PoseSolver> PoseSolver::Make(const Measurement& measurement, const SolveOptions& options,
                                    const geometry::Pose& machine_from_part,
                                    const Clamping& clamping) {
  PoseSolver solver;
  solver.own_ = TRY(MakeProblem(measurement, options));
  solver.state_ = ThetaOf(solver.own_, machine_from_part, clamping);
  if (!solver.state_.allFinite()) {
    return Fail("the pose or the clamping to begin at is not finite");
  }
  InflateSigmas(solver.state_, solver.own_);
  solver.gain_ = FitJointly(solver.own_, solver.state_).gain;
  solver.frame_ =
      MiddleFrameOf(solver.own_, geometry::RotationFromAngles(machine_from_part.angles_rad));
  solver.middle_ = InMiddleFrame(solver.own_, solver.frame_);
  solver.middle_state_ = ToMiddleFrame(solver.frame_, solver.state_);
  return solver;
}

// The gain changes with theta by as little as theta does against the distances.
void PoseSolver::AddErrorsOfInputs(std::span<const Eigen::Vector2d> pixels, Theta& theta) const {
  const Chain chain(own_, theta, false);
  const Theta found = theta;
  for (std::size_t i = 0; i < pixels.size() && gain_.size() > 0; ++i) {
    WeightedObservation observation = own_.observations[i];
    observation.pixel = pixels[i];
    Eigen::Vector2d residual_px;
    if (!chain.Residual(observation, residual_px)) {
      theta = found;
      return;
    }
    theta.noalias() += gain_.middleCols<2>(2 * static_cast<Eigen::Index>(i)) * residual_px;
  }
}

Descent PoseSolver::SolvePixels(std::span<const Eigen::Vector2d> pixels) {
  TRAMMEL_CHECK(pixels.size() == middle_.observations.size(), "{} pixels for {} observations",
                pixels.size(), middle_.observations.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    middle_.observations[i].pixel = pixels[i];
  }
  Descent descent = Descend(middle_, middle_state_);
  descent.theta = FromMiddleFrame(frame_, descent.theta);
  AddErrorsOfInputs(pixels, descent.theta);
  return descent;
}

}  // namespace trammel::part_alignment
