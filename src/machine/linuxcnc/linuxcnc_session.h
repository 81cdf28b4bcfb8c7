// Session with LinuxCNC through a Python helper: its state, and blocks for its interpreter, with
// limits on the possible positions.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/net/dialogue_process.h"

namespace trammel::machine {

/// Upper limit of any machine's axis length.
inline constexpr double kFarthest_mm = 1e5;

/// Minimum and maximum machine coordinates of X, Y and Z.
struct LinuxCncTravel {
  Eigen::Vector3d low_mm = Eigen::Vector3d::Constant(-kFarthest_mm);
  Eigen::Vector3d high_mm = Eigen::Vector3d::Constant(kFarthest_mm);
};

/// Parses minimum and maximum of X, of Y and of Z from a message of LinuxCNC: "######" if its INI
/// file has none. Error (kMachine): anything else, or an invalid range.
[[nodiscard]] Result<LinuxCncTravel> ParseTravel(const std::string& shown);

/// Error (kMachine): a reported position that is impossible for the machine. An axis at its limit
/// may overshoot by a millimetre.
[[nodiscard]] Result<void> CheckStatedPlace(const Eigen::Vector3d& machine_mm,
                                            const LinuxCncTravel& travel);

/// Error (kSafety): a target outside the travel.
[[nodiscard]] Result<void> CheckTarget(const Eigen::Vector3d& machine_mm,
                                       const LinuxCncTravel& travel);

/// Returns the number of equal pieces of a path, none longer than `piece_mm`.
/// REQUIRES 0 <= way_mm <= 4 kFarthest_mm, piece_mm >= 0.01.
[[nodiscard]] int PiecesOf(double way_mm, double piece_mm);

/// Returns the beginning of a controller's message, for errors.
[[nodiscard]] std::string Clipped(const std::string& said);

struct LinuxCncState {
  bool estop = true;
  bool on = false;
  bool homed = false;
  bool spindle_stopped = false;
  bool idle = false;         ///< no program runs or is paused
  std::string mode;          ///< "MANUAL", "AUTO", "MDI"
  bool metric = false;       ///< the machine's own unit is the millimetre
  bool c_axis = true;        ///< it has an axis C
  double feed_override = 1;  ///< 0: nothing moves
  double fastest_mm_s = 0;   ///< the limit of the machine's trajectory
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< actual, machine coordinates
  double c_deg = 0;
};

/// Configuration of a machine; read without sending it a command.
struct LinuxCncFacts {
  LinuxCncState state;         ///< `homed`: of all joints that there are
  std::string axes;            ///< letters, as in "XYZC"
  double unit_mm = 1;          ///< the machine's own unit of length
  LinuxCncTravel travel;       ///< from the axis limits
  int joints = 0;              ///< 1 … 16
  std::vector<int> not_homed;  ///< joints, from 0
  int tool = 0;                ///< number of the one in the spindle; 0: none
  double tool_length_mm = 0;   ///< Z of that one in the tool table
  int tools = 0;               ///< in the tool table

  [[nodiscard]] bool HasAxis(char letter) const { return axes.find(letter) != std::string::npos; }
};

/// State that changes while a machine moves.
struct LinuxCncMotion {
  Eigen::Vector4d position = Eigen::Vector4d::Zero();   ///< X, Y, Z in mm and C in degrees
  Eigen::Vector4d commanded = Eigen::Vector4d::Zero();  ///< likewise, where it is to be
  std::string mode;
  bool idle = false;  ///< the last block was taken up and has ended
  bool spindle_stopped = false;
};

struct LinuxCncSessionOptions {
  /// Helper that implements session.py's protocol: its path and arguments. Empty: session.py
  /// itself, run by the Python of LinuxCNC's module.
  std::vector<std::string> helper;
  double time_limit_s = 5;  ///< > 0; of each answer
};

/// Exchanges messages with a helper (session.py) over its standard input and output: no port, no
/// password, the user's own rights. A move ends with this process, however that ends. Once another
/// client has sent LinuxCNC a command (except an override), each request fails (kSafety) and
/// nothing is sent. Operator messages are left to LinuxCNC's screens.
///
/// Errors: kMachine (the helper, a rejection, a time limit, an invalid answer), kSafety,
/// kInterrupted (stop). Numbers in answers are finite.
class LinuxCncSession {
 public:
  /// Errors (kMachine): no Python, no module, no running LinuxCNC of this user.
  [[nodiscard]] static Result<std::unique_ptr<LinuxCncSession>> Join(
      const LinuxCncSessionOptions& options, const std::stop_token& stop);

  /// @param joints  0 … joints - 1 must be homed for `homed`
  [[nodiscard]] Result<LinuxCncState> State(int joints, const std::stop_token& stop);
  [[nodiscard]] Result<LinuxCncFacts> Facts(const std::stop_token& stop);
  [[nodiscard]] Result<LinuxCncMotion> Motion(const std::stop_token& stop);
  [[nodiscard]] Result<void> TakeMdi(const std::stop_token& stop);
  /// Runs a block that does not move the machine.
  [[nodiscard]] Result<void> Mdi(const std::string& block, const std::stop_token& stop);
  /// Starts a move without waiting for its end.
  [[nodiscard]] Result<void> Move(const std::string& block, const std::stop_token& stop);
  /// Returns a text with parameters as the interpreter expands it.
  [[nodiscard]] Result<std::string> Interpreted(const std::string& text,
                                                const std::stop_token& stop);
  /// Stops all motion, by another helper if this one is lost.
  [[nodiscard]] Result<void> Abort();

 private:
  LinuxCncSession(std::unique_ptr<DialogueProcess> helper, LinuxCncSessionOptions options);

  [[nodiscard]] Result<nlohmann::json> Ask(nlohmann::json request, const std::stop_token& stop);
  [[nodiscard]] Result<void> Do(nlohmann::json request, const std::stop_token& stop);
  [[nodiscard]] static Result<LinuxCncMotion> ParseMotion(const nlohmann::json& answer);
  [[nodiscard]] static Result<LinuxCncState> ParseState(const nlohmann::json& answer, int joints);

  std::unique_ptr<DialogueProcess> helper_;
  LinuxCncSessionOptions options_;
  int asked_ = 0;  ///< numbers the requests, so that a late answer is not taken for a new one
};

}  // namespace trammel::machine
