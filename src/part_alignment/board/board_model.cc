#include "part_alignment/board/board_model.h"

#include <array>
#include <cmath>

#include "geometry/euler.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Matrix3d Lean(const Vector2d& lean_rad) {
  return geometry::RotationFromAngles({lean_rad.x(), 0, 0}) *
         geometry::RotationFromAngles({0, lean_rad.y(), 0});
}

std::array<Matrix3d, 2> LeanDerivatives(const Vector2d& lean_rad) {
  const Vector3d x(lean_rad.x(), 0, 0);
  const Vector3d y(0, lean_rad.y(), 0);
  return {geometry::RotationDerivative(x, 0) * geometry::RotationFromAngles(y),
          geometry::RotationFromAngles(x) * geometry::RotationDerivative(y, 1)};
}

double TurnOfStation(const BoardNetwork& network, const BoardState& state, std::size_t station) {
  return network.stations[station].turn_rad + state.index_rad[network.stations[station].stay];
}

// d(actual place) / d(scale, square) at a stated place.
Eigen::Matrix<double, 3, 6> PlaceByMachine(const Vector3d& from_middle_mm) {
  Eigen::Matrix<double, 3, 6> by = Eigen::Matrix<double, 3, 6>::Zero();
  by.leftCols<3>() = from_middle_mm.asDiagonal();
  by(0, 3) = from_middle_mm.y();
  by(0, 4) = from_middle_mm.z();
  by(1, 5) = from_middle_mm.z();
  return by;
}

}  // namespace

Index SharedUnknowns(const BoardNetwork& network) {
  return kBoardStays + static_cast<Index>(network.stays) - 1;
}

double PriorSigma(const BoardNetwork& network, Index unknown) {
  if (unknown < kBoardScale) return 0;
  if (unknown < kBoardSquare) return network.machine.scale;
  if (unknown < kBoardLean) return network.machine.squareness_rad;
  if (unknown < kBoardTool) return network.machine.lean_rad;
  if (unknown < kBoardStays) return network.tool_length_sigma_mm;
  return network.machine.index_rad;
}

Eigen::VectorXd SharedOf(const BoardNetwork& network, const BoardState& state) {
  Eigen::VectorXd shared(SharedUnknowns(network));
  shared.head<kCameraParameters>() = ParametersOf(state.camera);
  shared.segment<3>(kBoardScale) = state.scale;
  shared.segment<3>(kBoardSquare) = state.square_rad;
  shared.segment<2>(kBoardLean) = state.lean_rad;
  shared[kBoardTool] = state.tool_mm;
  for (std::size_t i = 1; i < network.stays; ++i) {
    shared[kBoardStays + static_cast<Index>(i) - 1] = state.index_rad[i];
  }
  return shared;
}

void SetShared(const Eigen::VectorXd& shared, BoardState& state) {
  state.camera = WithParameters(state.camera, shared.head<kCameraParameters>());
  state.scale = shared.segment<3>(kBoardScale);
  state.square_rad = shared.segment<3>(kBoardSquare);
  state.lean_rad = shared.segment<2>(kBoardLean);
  state.tool_mm = shared[kBoardTool];
  for (std::size_t i = 1; i < state.index_rad.size(); ++i) {
    state.index_rad[i] = shared[kBoardStays + static_cast<Index>(i) - 1];
  }
}

Vector3d ActualPlace(const BoardNetwork& network, const BoardState& state,
                     const Vector3d& stated_mm) {
  Eigen::Matrix<double, 6, 1> machine;
  machine << state.scale, state.square_rad;
  return stated_mm + PlaceByMachine(stated_mm - network.middle_mm) * machine;
}

Matrix3d MachineFromTaper(const BoardNetwork& network, const BoardState& state,
                          std::size_t station) {
  const Matrix3d lean = Lean(state.lean_rad);
  return network.machine_from_spindle * lean *
         geometry::RotationFromAngles({0, 0, TurnOfStation(network, state, station)}) *
         lean.transpose();
}

StationFrame FrameOf(const BoardNetwork& network, const BoardState& state, std::size_t station) {
  StationFrame frame;
  frame.actual_mm =
      ActualPlace(network, state, network.stations[station].stated_mm) + state.off_mm[station];
  const Matrix3d spindle_from_machine = network.machine_from_spindle.transpose();
  const Matrix3d lean = Lean(state.lean_rad);
  const auto by_lean = LeanDerivatives(state.lean_rad);
  const Vector3d turn(0, 0, TurnOfStation(network, state, station));
  const Matrix3d back = geometry::RotationFromAngles(turn).transpose();
  frame.taper_from_machine = lean * back * lean.transpose() * spindle_from_machine;
  for (std::size_t i = 0; i < 2; ++i) {
    frame.by_lean[i] =
        (by_lean[i] * back * lean.transpose() + lean * back * by_lean[i].transpose()) *
        spindle_from_machine;
  }
  frame.by_index = lean * geometry::RotationDerivative(turn, 2).transpose() * lean.transpose() *
                   spindle_from_machine;
  return frame;
}

bool TakesPart(const BoardNetwork& network, const NetworkObservation& observation) {
  return observation.used && network.stations[observation.station].used;
}

std::vector<bool> SeenMarks(const BoardNetwork& network) {
  std::vector<bool> seen(network.marks, false);
  for (const NetworkObservation& observation : network.observations) {
    if (TakesPart(network, observation)) seen[observation.point] = true;
  }
  return seen;
}

std::optional<Vector2d> ResidualOf(const BoardNetwork& network, const BoardState& state,
                                   const NetworkObservation& observation) {
  const StationFrame frame = FrameOf(network, state, observation.station);
  const Vector3d taper_mm =
      frame.taper_from_machine * (state.marks_mm[observation.point] - frame.actual_mm);
  const geometry::Pose& pose = state.camera.taper_from_camera;
  const Vector3d camera_mm =
      geometry::RotationFromAngles(pose.angles_rad).transpose() * (taper_mm - pose.translation_mm);
  const auto pixel = Project(state.camera, camera_mm);
  if (!pixel) return std::nullopt;
  return Vector2d(observation.pixel - *pixel);
}

bool PartialsOf(const BoardNetwork& network, const BoardState& state, const StationFrame& frame,
                const NetworkObservation& observation, MarkPartials& partials) {
  const Vector3d machine_mm = state.marks_mm[observation.point] - frame.actual_mm;
  partials.taper_mm = frame.taper_from_machine * machine_mm;
  const auto projected = ProjectFromTaper(state.camera, partials.taper_mm);
  if (!projected) return false;
  const BoardNetwork::Station& station = network.stations[observation.station];
  partials.residual = projected->pixel - observation.pixel;
  partials.by_taper = projected->by_taper;
  partials.by_mark = projected->by_taper * frame.taper_from_machine;
  auto& shared = partials.by_shared;
  shared.setZero(2, SharedUnknowns(network));
  shared.leftCols<kCameraParameters>() = projected->by_parameter;
  shared.middleCols<6>(kBoardScale) =
      -partials.by_mark * PlaceByMachine(station.stated_mm - network.middle_mm);
  for (int i = 0; i < 2; ++i) {
    shared.col(kBoardLean + i) = projected->by_taper * (frame.by_lean[i] * machine_mm);
  }
  if (station.stay > 0) {
    shared.col(kBoardStays + static_cast<Index>(station.stay) - 1) =
        projected->by_taper * (frame.by_index * machine_mm);
  }
  return true;
}

double TouchVariance(const BoardNetwork& network, const BoardNetwork::Touch& touch, Index axis) {
  const double along = network.machine_from_spindle(axis, 2);
  // The unknown length is the first tool's: a different tool has the errors of both.
  const double tool_mm =
      touch.other_tool ? std::sqrt(2.0) * along * network.tool_length_sigma_mm : 0;
  return std::pow(touch.sigma_mm[axis], 2) + std::pow(network.machine.repeatability_mm, 2) +
         tool_mm * tool_mm;
}

TouchPartials PartialsOf(const BoardNetwork& network, const BoardState& state,
                         const BoardNetwork::Touch& touch) {
  const double length_mm = touch.tool_length_mm + state.tool_mm;
  const Matrix3d& turn = network.machine_from_spindle;
  const auto by_lean = LeanDerivatives(state.lean_rad);
  const Vector3d along = turn * Lean(state.lean_rad).col(2);
  const Vector3d tip_mm = ActualPlace(network, state, touch.stated_mm) - length_mm * along;
  TouchPartials partials;
  partials.residual_mm = state.marks_mm[touch.mark] - tip_mm;
  partials.by_shared.setZero(3, SharedUnknowns(network));
  partials.by_shared.middleCols<6>(kBoardScale) =
      -PlaceByMachine(touch.stated_mm - network.middle_mm);
  for (int i = 0; i < 2; ++i) {
    partials.by_shared.col(kBoardLean + i) =
        length_mm * (turn * by_lean[static_cast<std::size_t>(i)].col(2));
  }
  partials.by_shared.col(kBoardTool) = along;
  return partials;
}

}  // namespace trammel::part_alignment
