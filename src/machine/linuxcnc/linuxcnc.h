// LinuxCNC as the machine of part alignment: moves without a running spindle, and work offsets that
// are read back.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc_limits.h"
#include "machine/linuxcnc/linuxcnc_shell.h"

namespace trammel::machine {

struct LinuxCncOptions {
  LinuxCncAddress address;
  /// Joints 0 … joints - 1 must be homed.
  int joints = 3;
  /// C is the spindle's own axis: it holds the spindle where it is, so that the camera cannot turn.
  bool c_holds_spindle = false;
  /// Without such an axis: a person has locked the spindle in its oriented position.
  bool spindle_locked_by_hand = false;
};

struct LinuxCncState {
  bool estop = true;
  bool on = false;
  bool homed = false;
  bool spindle_stopped = false;
  bool idle = false;    ///< no program runs or is paused
  std::string mode;     ///< "MANUAL", "AUTO", "MDI"
  bool metric = false;  ///< the machine's own unit is the millimetre
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< actual, machine coordinates
  double c_deg = 0;
};

/// A work offset as LinuxCNC keeps it: machine = origin + Rz(rotation) (program + G92) + tool.
struct LinuxCncOffset {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  double rotation_deg = 0;
};

struct LinuxCncOffsets {
  LinuxCncOffset offset;      ///< of the slot that was asked for
  bool g92 = false;           ///< an active G92 or G52 shifts every work offset
  bool metric = true;         ///< G21 is active
  double tool_length_mm = 0;  ///< G43's, along Z
};

/// A client of linuxcncrsh that never starts the spindle. Errors: kMachine (line, refusal, time
/// limit, an answer that no machine can give), kSafety (a condition below is not met), kInterrupted
/// (stop).
///
/// Motion runs on a leash: a move is sent in pieces of at most half a second, so that it ends by
/// itself soon after the line is lost or this process dies. Every piece and the whole move have a
/// time limit. On a stop, a refusal, or a time limit the move is aborted and the machine seen to
/// stand before the call returns.
class LinuxCnc {
 public:
  [[nodiscard]] static Result<std::unique_ptr<LinuxCnc>> Connect(const LinuxCncOptions& options,
                                                                 const std::stop_token& stop);

  [[nodiscard]] Result<LinuxCncState> State(const std::stop_token& stop);

  /// Refuses (kSafety, with what to do) unless the machine is out of emergency stop, on, homed,
  /// metric and idle, and the spindle stopped, for `motion` held in its place, too. Then takes MDI
  /// mode.
  [[nodiscard]] Result<void> Prepare(bool motion, const std::stop_token& stop);

  /// A straight move of X, Y and Z in machine coordinates (G53), seen to arrive within 1 µm.
  /// Refuses a place outside the limits of the axes in LinuxCNC's INI file. Prepares before it.
  /// @param feed_mm_min  10 … 100000
  [[nodiscard]] Result<void> MoveTo(const Eigen::Vector3d& machine_mm, double feed_mm_min,
                                    const std::stop_token& stop);

  /// @param slot  1 (G54) … 9 (G59.3)
  [[nodiscard]] Result<LinuxCncOffsets> ReadOffsets(int slot, const std::stop_token& stop);

  /// Sets all four numbers and reads them back; an error unless they agree to the six digits that
  /// LinuxCNC shows. Refuses while a G92 is active. Prepares before it.
  [[nodiscard]] Result<void> WriteOffset(int slot, const LinuxCncOffset& offset,
                                         const std::stop_token& stop);

 private:
  LinuxCnc(LinuxCncShell shell, LinuxCncOptions options);

  /// X, Y, Z in mm and C in degrees, within what the machine can reach.
  [[nodiscard]] Result<Eigen::Vector4d> Position(const std::stop_token& stop);
  /// Asks for the limits of the axes, once.
  [[nodiscard]] Result<void> LearnTravel(const std::stop_token& stop);
  /// What the interpreter makes of a text with parameters.
  [[nodiscard]] Result<std::string> Interpreted(const std::string& text,
                                                const std::stop_token& stop);
  [[nodiscard]] Result<void> MoveInPieces(const Eigen::Vector3d& start_mm,
                                          const Eigen::Vector3d& end_mm, double feed_mm_min,
                                          const std::stop_token& stop);
  [[nodiscard]] Result<void> MoveOnce(const Eigen::Vector3d& machine_mm, double feed_mm_min,
                                      double time_limit_s, const std::stop_token& stop);
  /// Until the controller is idle; C must be where it was.
  [[nodiscard]] Result<void> AwaitRest(double c_deg, const std::stop_token& stop);
  /// What the controller had to complain of before is not about what comes now.
  [[nodiscard]] Result<void> ForgetComplaints(const std::stop_token& stop);
  /// The error that the controller has to tell, if any.
  [[nodiscard]] Result<std::optional<std::string>> Complaint(const std::stop_token& stop);
  /// Ends all motion; says where the machine stands, or that nobody knows.
  [[nodiscard]] std::string Halt();

  LinuxCncShell shell_;
  LinuxCncOptions options_;
  LinuxCncTravel travel_;
  bool travel_known_ = false;
  int messages_ = 0;  ///< numbers the read-backs, so that an old one is not taken for a new one
};

}  // namespace trammel::machine
