// Model of the chain from a mark on the table to a picture, with the machine's errors and
// derivatives.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "part_alignment/board/board_calibration.h"
#include "part_alignment/network/observation.h"

namespace trammel::part_alignment {

/// Measurement in numbers: all inputs of an adjustment.
struct BoardNetwork {
  struct Station {
    Eigen::Vector3d stated_mm = Eigen::Vector3d::Zero();
    double turn_rad = 0;   ///< spindle rotation since the first station
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
  std::vector<NetworkObservation> observations;  ///< mark observations
  std::vector<Touch> touches;
  std::size_t marks = 0;
  std::size_t stays = 0;
  BoardMachineErrors machine;
  double tool_length_sigma_mm = 0;
  std::optional<CameraPlacePrior> place;
};

/// True if an observation and its station are used.
[[nodiscard]] bool TakesPart(const BoardNetwork& network, const NetworkObservation& observation);
/// Returns the marks that a used observation shows.
[[nodiscard]] std::vector<bool> SeenMarks(const BoardNetwork& network);

/// Order of the unknowns that all pictures share; the marks follow, three each.
enum BoardIndex {
  kBoardCamera = 0,  // kCameraParameters of them
  kBoardPlace = 7,   // camera's place in the taper, one of its parameters
  kBoardScale = kCameraParameters,
  kBoardSquare = kBoardScale + 3,  // xy, xz, yz
  kBoardLean = kBoardSquare + 3,
  kBoardTool = kBoardLean + 2,
  kBoardStays = kBoardTool + 1,  // one per spindle angle but the first
};

struct BoardState {
  Camera camera;
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  Eigen::Vector3d square_rad = Eigen::Vector3d::Zero();
  Eigen::Vector2d lean_rad = Eigen::Vector2d::Zero();
  double tool_mm = 0;
  std::vector<double> index_rad;  ///< per spindle angle; 0 for the first
  std::vector<Eigen::Vector3d> marks_mm;
  std::vector<Eigen::Vector3d> off_mm;  ///< per station, from its stated position
};

/// Returns the number of shared unknowns.
[[nodiscard]] Eigen::Index SharedUnknowns(const BoardNetwork& network);
/// Returns the prior uncertainty of a shared unknown, k = 1; 0: no prior. Priors are about 0.
[[nodiscard]] double PriorSigma(const BoardNetwork& network, Eigen::Index unknown);
/// Returns the shared unknowns as a vector; SetShared replaces them in a state.
[[nodiscard]] Eigen::VectorXd SharedOf(const BoardNetwork& network, const BoardState& state);
void SetShared(const Eigen::VectorXd& shared, BoardState& state);

/// Computes the spindle's actual position from a stated one: stretched and skewed about the middle.
/// The x axis is along the machine's X, y in the plane of X and Y.
[[nodiscard]] Eigen::Vector3d ActualPlace(const BoardNetwork& network, const BoardState& state,
                                          const Eigen::Vector3d& stated_mm);
/// Returns the rotation from the taper's frame to the machine's at a station.
[[nodiscard]] Eigen::Matrix3d MachineFromTaper(const BoardNetwork& network, const BoardState& state,
                                               std::size_t station);

/// Rotations of one station, computed once for all of its observations.
struct StationFrame {
  Eigen::Vector3d actual_mm;
  Eigen::Matrix3d taper_from_machine;
  Eigen::Matrix3d by_lean[2];  ///< partial of taper_from_machine
  Eigen::Matrix3d by_index;
};
[[nodiscard]] StationFrame FrameOf(const BoardNetwork& network, const BoardState& state,
                                   std::size_t station);

/// Computes observed minus projected, not whitened. Absent if the camera cannot see the mark.
[[nodiscard]] std::optional<Eigen::Vector2d> ResidualOf(const BoardNetwork& network,
                                                        const BoardState& state,
                                                        const NetworkObservation& observation);

struct MarkPartials {
  Eigen::Vector2d residual;  ///< projected less seen
  Eigen::Matrix<double, 2, Eigen::Dynamic> by_shared;
  Eigen::Matrix<double, 2, 3> by_mark;   ///< negative of that by the station's place
  Eigen::Matrix<double, 2, 3> by_taper;  ///< by the point in the taper frame
  Eigen::Vector3d taper_mm;
};
/// Computes an observation's partials; false if the camera cannot see the mark. Reuses the memory
/// of `partials`.
[[nodiscard]] bool PartialsOf(const BoardNetwork& network, const BoardState& state,
                              const StationFrame& frame, const NetworkObservation& observation,
                              MarkPartials& partials);

/// Returns a touch's variance along a machine axis, k = 1: touch, approach, and another tool's
/// length. Infinite if the touch does not measure the axis.
[[nodiscard]] double TouchVariance(const BoardNetwork& network, const BoardNetwork::Touch& touch,
                                   Eigen::Index axis);

/// One touch: mark minus tool tip along the machine's axes, mm.
struct TouchPartials {
  Eigen::Vector3d residual_mm;
  Eigen::Matrix<double, 3, Eigen::Dynamic> by_shared;  ///< by the mark: identity
};
[[nodiscard]] TouchPartials PartialsOf(const BoardNetwork& network, const BoardState& state,
                                       const BoardNetwork::Touch& touch);

}  // namespace trammel::part_alignment
