// LinuxCNC as the machine of part alignment: moves without a running spindle, and work offsets that
// are read back.
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
  /// C is the spindle's own axis: it holds the spindle where it is, so that the camera cannot turn.
  bool c_holds_spindle = false;
  /// Without such an axis: a person has locked the spindle in its oriented position.
  bool spindle_locked_by_hand = false;
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

/// LinuxCNC as a client that never starts the spindle. Errors: kMachine (refusal, time limit, an
/// answer that no machine can give), kSafety (a condition below is not met, or somebody else
/// took the controller over), kInterrupted (stop).
///
/// Motion runs on a leash: a move is sent in pieces of half a second, so that it ends by itself
/// soon after this process dies. Every piece and the whole move have a time limit. On a stop, a
/// refusal, or a time limit the move is aborted and the machine seen to stand before the call
/// returns. MDI mode is taken once: when somebody else has changed the mode since, nothing is sent
/// any more, no abort either, for what moves then is theirs.
class LinuxCnc {
 public:
  [[nodiscard]] static Result<std::unique_ptr<LinuxCnc>> Connect(const LinuxCncOptions& options,
                                                                 const std::stop_token& stop);

  [[nodiscard]] Result<LinuxCncState> State(const std::stop_token& stop);

  /// Sends nothing that the machine does. In an emergency stop and unhomed, too.
  [[nodiscard]] Result<LinuxCncFacts> Facts(const std::stop_token& stop);

  /// Refuses (kSafety, with what to do) unless the machine is out of emergency stop, on, homed,
  /// metric and idle, and the spindle stopped, for `motion` held in its place, too. Then takes MDI
  /// mode.
  [[nodiscard]] Result<void> Prepare(bool motion, const std::stop_token& stop);

  /// A straight move of X, Y and Z in machine coordinates (G53), seen to arrive within 1 µm.
  /// Refuses a place outside the limits of the axes in LinuxCNC's INI file. Prepares before it.
  /// @param feed_mm_min  10 … 100000
  [[nodiscard]] Result<void> MoveTo(const Eigen::Vector3d& machine_mm, double feed_mm_min,
                                    const std::stop_token& stop);

  /// Turns the spindle by its axis C; X, Y and Z stay. Ends as MoveTo does. Prepares before it.
  /// REQUIRES c_holds_spindle.
  /// @param speed_deg_min  10 … 100000
  [[nodiscard]] Result<void> TurnTo(double c_deg, double speed_deg_min,
                                    const std::stop_token& stop);

  /// The limits of X, Y and Z in LinuxCNC's INI file; ±kFarthest_mm where it has none. Prepares
  /// before it.
  [[nodiscard]] Result<LinuxCncTravel> Travel(const std::stop_token& stop);

  /// @param slot  1 (G54) … 9 (G59.3)
  [[nodiscard]] Result<LinuxCncOffsets> ReadOffsets(int slot, const std::stop_token& stop);

  /// Sets all four numbers and reads them back; an error unless they agree to the six digits that
  /// LinuxCNC shows. Refuses while a G92 is active. Prepares before it.
  [[nodiscard]] Result<void> WriteOffset(int slot, const LinuxCncOffset& offset,
                                         const std::stop_token& stop);

 private:
  LinuxCnc(std::unique_ptr<LinuxCncSession> session, LinuxCncOptions options);

  /// The session's, at a place within what the machine can reach and in a mode that is still ours.
  [[nodiscard]] Result<LinuxCncMotion> Motion(const std::stop_token& stop);
  [[nodiscard]] Result<void> CheckMode(const std::string& mode);
  /// Asks for the limits of the axes, once.
  [[nodiscard]] Result<void> LearnTravel(const std::stop_token& stop);
  /// Which axes a move drives: X, Y and Z in mm, or C in degrees.
  enum class Driven { kXyz, kC };
  [[nodiscard]] Result<void> Drive(Driven driven, const Eigen::Vector4d& to, double feed_min,
                                   const std::stop_token& stop);
  [[nodiscard]] Result<void> MoveInPieces(Driven driven, const Eigen::Vector4d& from,
                                          const Eigen::Vector4d& to, double feed_min, double piece,
                                          const std::stop_token& stop);
  [[nodiscard]] Result<void> MoveOnce(Driven driven, const Eigen::Vector4d& to, double feed_min,
                                      double time_limit_s, const std::stop_token& stop);
  /// Until the controller is idle; C must be at `c_deg`.
  [[nodiscard]] Result<void> AwaitRest(double c_deg, const std::stop_token& stop);
  /// Ends all motion of ours; says where the machine stands, or that nobody knows.
  [[nodiscard]] std::string Halt();

  std::unique_ptr<LinuxCncSession> session_;
  LinuxCncOptions options_;
  LinuxCncTravel travel_;
  bool travel_known_ = false;
  bool held_ = false;   ///< MDI mode was taken
  bool taken_ = false;  ///< by somebody else since
};

}  // namespace trammel::machine
