// The chain from a mark on the table to a picture, with the machine's errors, and its derivatives.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "part_alignment/board/board_calibration.h"
#include "part_alignment/network/observation.h"

namespace trammel::part_alignment {

/// A measurement in numbers: what takes part in an adjustment.
struct BoardNetwork {
  struct Station {
    Eigen::Vector3d stated_mm = Eigen::Vector3d::Zero();
    double turn_rad = 0;   ///< of the spindle since the first station
    std::size_t stay = 0;  ///< counts turns of the spindle
    bool used = true;
  };
  struct Touch {
    std::size_t mark = 0;
    Eigen::Vector3d stated_mm = Eigen::Vector3d::Zero();
    double tool_length_mm = 0;
    Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();
    bool other_tool = false;  ///< than that of the first touch: its length has an error of its own
  };
  Camera frame;
  Eigen::Matrix3d machine_from_spindle =
      Eigen::Matrix3d::Identity();                      ///< stated, of the first station
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< about which the machine is stretched
  std::vector<Station> stations;
  std::vector<NetworkObservation> observations;  ///< of marks
  std::vector<Touch> touches;
  std::size_t marks = 0;
  std::size_t stays = 0;
  BoardMachineErrors machine;
  double tool_length_sigma_mm = 0;
  std::optional<CameraPlacePrior> place;
};

/// Whether an observation is used, and its station.
[[nodiscard]] bool TakesPart(const BoardNetwork& network, const NetworkObservation& observation);
/// Of the marks, those that an observation shows that takes part.
[[nodiscard]] std::vector<bool> SeenMarks(const BoardNetwork& network);

/// Unknowns that all pictures share, in their order; then the marks, three each.
enum BoardIndex {
  kBoardCamera = 0,  // kCameraParameters of them
  kBoardPlace = 7,   // of the camera in the taper, among its parameters
  kBoardScale = kCameraParameters,
  kBoardSquare = kBoardScale + 3,  // xy, xz, yz
  kBoardLean = kBoardSquare + 3,
  kBoardTool = kBoardLean + 2,
  kBoardStays = kBoardTool + 1,  // of each stay but the first
};

struct BoardState {
  Camera camera;
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  Eigen::Vector3d square_rad = Eigen::Vector3d::Zero();
  Eigen::Vector2d lean_rad = Eigen::Vector2d::Zero();
  double tool_mm = 0;
  std::vector<double> index_rad;  ///< of each stay; that of the first is 0
  std::vector<Eigen::Vector3d> marks_mm;
  std::vector<Eigen::Vector3d> off_mm;  ///< of each station from where it was stated
};

/// The number of shared unknowns.
[[nodiscard]] Eigen::Index SharedUnknowns(const BoardNetwork& network);
/// What is known of a shared unknown beforehand, k = 1; 0: nothing. Priors are about 0.
[[nodiscard]] double PriorSigma(const BoardNetwork& network, Eigen::Index unknown);
/// The shared unknowns as a vector, and a state with others.
[[nodiscard]] Eigen::VectorXd SharedOf(const BoardNetwork& network, const BoardState& state);
void SetShared(const Eigen::VectorXd& shared, BoardState& state);

/// Where the spindle really is at a stated place: stretched and skewed about the middle. x along
/// the machine's X, y in the plane of X and Y.
[[nodiscard]] Eigen::Vector3d ActualPlace(const BoardNetwork& network, const BoardState& state,
                                          const Eigen::Vector3d& stated_mm);
/// Turns the taper's frame into the machine's at a station.
[[nodiscard]] Eigen::Matrix3d MachineFromTaper(const BoardNetwork& network, const BoardState& state,
                                               std::size_t station);

/// Of one station, made once for all of its observations.
struct StationFrame {
  Eigen::Vector3d actual_mm;
  Eigen::Matrix3d taper_from_machine;
  Eigen::Matrix3d by_lean[2];  ///< of taper_from_machine
  Eigen::Matrix3d by_index;
};
[[nodiscard]] StationFrame FrameOf(const BoardNetwork& network, const BoardState& state,
                                   std::size_t station);

/// Seen less projected, not whitened. Absent where the camera cannot see the mark.
[[nodiscard]] std::optional<Eigen::Vector2d> ResidualOf(const BoardNetwork& network,
                                                        const BoardState& state,
                                                        const NetworkObservation& observation);

struct MarkPartials {
  Eigen::Vector2d residual;  ///< projected less seen
  Eigen::Matrix<double, 2, Eigen::Dynamic> by_shared;
  Eigen::Matrix<double, 2, 3> by_mark;   ///< that by the station's place is its negative
  Eigen::Matrix<double, 2, 3> by_taper;  ///< by the point in the taper's frame
  Eigen::Vector3d taper_mm;
};
/// False where the camera cannot see the mark. `partials` keeps its memory.
[[nodiscard]] bool PartialsOf(const BoardNetwork& network, const BoardState& state,
                              const StationFrame& frame, const NetworkObservation& observation,
                              MarkPartials& partials);

/// Of a touch along a machine axis, k = 1: of the touch, the approach, and another tool's length.
/// Infinite where the touch tells nothing.
[[nodiscard]] double TouchVariance(const BoardNetwork& network, const BoardNetwork::Touch& touch,
                                   Eigen::Index axis);

/// One touch: mark less tool's tip along the machine's axes, mm.
struct TouchPartials {
  Eigen::Vector3d residual_mm;
  Eigen::Matrix<double, 3, Eigen::Dynamic> by_shared;  ///< by the mark it is the identity
};
[[nodiscard]] TouchPartials PartialsOf(const BoardNetwork& network, const BoardState& state,
                                       const BoardNetwork::Touch& touch);

}  // namespace trammel::part_alignment
