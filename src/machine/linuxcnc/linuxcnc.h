// LinuxCNC as the machine of part alignment: moves without a running spindle, and work offsets with
// read-back.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc_session.h"

namespace trammel::machine {

struct LinuxCncOptions {
  LinuxCncSessionOptions session;
  /// Joints 0 … joints - 1 must be homed.
  int joints = 3;
  /// True if C is the spindle's own axis, which locks the spindle so that the camera cannot rotate.
  bool c_holds_spindle = false;
  /// True if, without such an axis, an operator has locked the spindle in its oriented position.
  bool spindle_locked_by_hand = false;
};

/// Work offset of LinuxCNC: machine = origin + Rz(rotation) (program + G92) + tool.
struct LinuxCncOffset {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  double rotation_deg = 0;
};

struct LinuxCncOffsets {
  LinuxCncOffset offset;      ///< of the requested slot
  bool g92 = false;           ///< an active G92 or G52 shifts every work offset
  bool metric = true;         ///< G21 is active
  double tool_length_mm = 0;  ///< G43's, along Z
};

/// LinuxCNC as a client that never starts the spindle. Errors: kMachine (rejection, time limit, an
/// impossible answer), kSafety (a condition below is not met, or another client took over the
/// controller), kInterrupted (stop).
///
/// Moves are sent in pieces of half a second, so that motion ends soon after this process dies.
/// Every piece and the whole move have a time limit. On a stop, a rejection, or a time limit the
/// move is aborted, and the call returns only after the machine stopped. MDI mode is set once: if
/// another client has changed the mode since, nothing more is sent, not even an abort, since any
/// motion is then theirs.
class LinuxCnc {
 public:
  [[nodiscard]] static Result<std::unique_ptr<LinuxCnc>> Connect(const LinuxCncOptions& options,
                                                                 const std::stop_token& stop);

  [[nodiscard]] Result<LinuxCncState> State(const std::stop_token& stop);

  /// Reads facts without sending any command. Also works in an emergency stop and unhomed.
  [[nodiscard]] Result<LinuxCncFacts> Facts(const std::stop_token& stop);

  /// Checks that the machine is out of emergency stop, on, homed, metric and idle, and the spindle
  /// stopped, and for `motion` also locked. Otherwise fails (kSafety, with the remedy). Then sets
  /// MDI mode.
  [[nodiscard]] Result<void> Prepare(bool motion, const std::stop_token& stop);

  /// Moves X, Y and Z straight in machine coordinates (G53) and checks arrival within 1 µm. Rejects
  /// a target outside the axis limits of LinuxCNC's INI file. Calls Prepare first.
  /// @param feed_mm_min  10 … 100000
  [[nodiscard]] Result<void> MoveTo(const Eigen::Vector3d& machine_mm, double feed_mm_min,
                                    const std::stop_token& stop);

  /// Rotates the spindle by its axis C, with X, Y and Z fixed. Ends as MoveTo does. Calls Prepare
  /// first. REQUIRES c_holds_spindle.
  /// @param speed_deg_min  10 … 100000
  [[nodiscard]] Result<void> TurnTo(double c_deg, double speed_deg_min,
                                    const std::stop_token& stop);

  /// Returns the limits of X, Y and Z in LinuxCNC's INI file; ±kFarthest_mm if it has none. Calls
  /// Prepare first.
  [[nodiscard]] Result<LinuxCncTravel> Travel(const std::stop_token& stop);

  /// @param slot  1 (G54) … 9 (G59.3)
  [[nodiscard]] Result<LinuxCncOffsets> ReadOffsets(int slot, const std::stop_token& stop);

  /// Sets all four numbers and reads them back; an error unless they agree to the six digits that
  /// LinuxCNC shows. Fails while a G92 is active. Calls Prepare first.
  [[nodiscard]] Result<void> WriteOffset(int slot, const LinuxCncOffset& offset,
                                         const std::stop_token& stop);

 private:
  LinuxCnc(std::unique_ptr<LinuxCncSession> session, LinuxCncOptions options);

  /// Returns the session's motion, after checks that the position is reachable and the mode still
  /// ours.
  [[nodiscard]] Result<LinuxCncMotion> Motion(const std::stop_token& stop);
  [[nodiscard]] Result<void> CheckMode(const std::string& mode);
  /// Reads the axis limits, once.
  [[nodiscard]] Result<void> LearnTravel(const std::stop_token& stop);
  /// Axes that a move drives: X, Y and Z in mm, or C in degrees.
  enum class Driven { kXyz, kC };
  [[nodiscard]] Result<void> Drive(Driven driven, const Eigen::Vector4d& to, double feed_min,
                                   const std::stop_token& stop);
  [[nodiscard]] Result<void> MoveInPieces(Driven driven, const Eigen::Vector4d& from,
                                          const Eigen::Vector4d& to, double feed_min, double piece,
                                          const std::stop_token& stop);
  [[nodiscard]] Result<void> MoveOnce(Driven driven, const Eigen::Vector4d& to, double feed_min,
                                      double time_limit_s, const std::stop_token& stop);
  /// Waits until the controller is idle; C must be at `c_deg`.
  [[nodiscard]] Result<void> AwaitRest(double c_deg, const std::stop_token& stop);
  /// Stops all motion of ours; returns text with the machine's position, or that it is unknown.
  [[nodiscard]] std::string Halt();

  std::unique_ptr<LinuxCncSession> session_;
  LinuxCncOptions options_;
  LinuxCncTravel travel_;
  bool travel_known_ = false;
  bool held_ = false;   ///< MDI mode was taken
  bool taken_ = false;  ///< true if another client took over
};

}  // namespace trammel::machine
