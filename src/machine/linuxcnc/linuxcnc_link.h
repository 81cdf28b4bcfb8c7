// How LinuxCNC is spoken to: the seam between what is asked of a milling machine and the two ways
// to its controller.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc_limits.h"

namespace trammel::machine {

struct LinuxCncState {
  bool estop = true;
  bool on = false;
  bool homed = false;
  bool spindle_stopped = false;
  bool idle = false;         ///< no program runs or is paused
  std::string mode;          ///< "MANUAL", "AUTO", "MDI"
  bool metric = false;       ///< the machine's own unit is the millimetre
  bool c_axis = true;        ///< it has an axis C; true where the link does not tell
  double feed_override = 1;  ///< 0: nothing moves; 1 where the link does not tell
  /// What the machine's trajectory is limited to; infinite where the link does not tell.
  double fastest_mm_s = std::numeric_limits<double>::infinity();
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< actual, machine coordinates
  double c_deg = 0;
};

/// How a machine is built and set up; read without a command to it.
struct LinuxCncFacts {
  LinuxCncState state;  ///< `homed`: of all joints that there are
  /// Whether the link tells the rest.
  bool complete = false;
  std::string axes;            ///< letters, as in "XYZC"
  double unit_mm = 1;          ///< the machine's own unit of length
  LinuxCncTravel travel;       ///< by the limits of the axes
  int joints = 0;              ///< 1 … 16
  std::vector<int> not_homed;  ///< joints, from 0
  int tool = 0;                ///< number of the one in the spindle; 0: none
  double tool_length_mm = 0;   ///< Z of that one in the tool table
  int tools = 0;               ///< in the table

  [[nodiscard]] bool HasAxis(char letter) const { return axes.find(letter) != std::string::npos; }
};

/// What changes while a machine moves.
struct LinuxCncMotion {
  Eigen::Vector4d position = Eigen::Vector4d::Zero();  ///< X, Y, Z in mm and C in degrees, as told
  /// Where the controller wants it to be; absent where the link does not tell.
  std::optional<Eigen::Vector4d> commanded;
  std::string mode;
  bool on = true;  ///< its power, which an emergency stop takes away
  bool idle = false;
  bool ended = false;  ///< the last block has surely been taken up and ended; false where the link
                       ///< cannot know
  bool spindle_stopped = false;
  std::optional<std::string> complaint;  ///< what the controller has to say against it
};

/// Errors: kMachine (line, refusal, time limit, an answer that is none), kSafety (somebody else
/// commands the controller), kInterrupted (stop). Numbers that it tells are finite.
class LinuxCncLink {
 public:
  LinuxCncLink() = default;
  LinuxCncLink(const LinuxCncLink&) = delete;
  LinuxCncLink& operator=(const LinuxCncLink&) = delete;
  virtual ~LinuxCncLink() = default;

  /// @param joints  0 … joints - 1 must be homed for `homed`
  [[nodiscard]] virtual Result<LinuxCncState> State(int joints, const std::stop_token& stop) = 0;
  /// @param joints  as of State, where the link cannot tell how many there are
  [[nodiscard]] virtual Result<LinuxCncFacts> Facts(int joints, const std::stop_token& stop);
  [[nodiscard]] virtual Result<LinuxCncMotion> Motion(const std::stop_token& stop) = 0;
  [[nodiscard]] virtual Result<void> TakeMdi(const std::stop_token& stop) = 0;
  /// A block that does not move the machine.
  [[nodiscard]] virtual Result<void> Mdi(const std::string& block, const std::stop_token& stop) = 0;
  /// Begins a move, and does not wait for its end.
  [[nodiscard]] virtual Result<void> Move(const std::string& block,
                                          const std::stop_token& stop) = 0;
  /// What the interpreter makes of a text with parameters.
  [[nodiscard]] virtual Result<std::string> Interpreted(const std::string& text,
                                                        const std::stop_token& stop) = 0;
  /// Drops what the controller had to complain of before: it is not about what comes now.
  [[nodiscard]] virtual Result<void> ForgetComplaints(const std::stop_token& stop) = 0;
  [[nodiscard]] virtual Result<std::optional<std::string>> Complaint(
      const std::stop_token& stop) = 0;
  /// Ends all motion, over a new line where the old one is lost.
  [[nodiscard]] virtual Result<void> Abort() = 0;
};

}  // namespace trammel::machine
