// Virtual milling machine in host time, as seen by a helper that joins LinuxCNC.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "base/result.h"
#include "sim/spindle/spindle_lens.h"

namespace trammel::sim {

/// Faults. Counts are of moves that were begun; 0: never.
struct MillFaults {
  bool not_homed = false;
  bool spindle_turns = false;
  int estop_at_move = 0;    ///< the emergency stop is pressed in that one
  int silent_at_move = 0;   ///< from this move on its server closes every connection
  int refused_at_move = 0;  ///< this move is refused, as by a controller's own limits
};

struct MillOptions {
  Triple travel_low_mm = {0, 0, 0};
  Triple travel_high_mm = {1200, 800, 1000};
  Triple start_mm = {600, 400, 520};
  double hurry = 1;  ///< times the speed that is asked for, 0.01 … 1000
  MillFaults faults;
};

/// Positions of the axes, as reported by the controller.
struct MillPlace {
  Triple stated_mm = {};
  double c_deg = 0;
  bool moving = false;
  std::uint64_t approach = 0;  ///< counts moves of X, Y, Z that were begun
  std::uint64_t turn = 0;      ///< counts moves of C that changed it
};

/// Three axes and C that move at the requested speed and stop at once. Answers trammel's requests
/// to its LinuxCNC helper: lines of JSON with an "id" and "do" (look, state, facts, take, mdi,
/// show, abort). Serves every client. Thread-safe.
class VirtualMill {
 public:
  explicit VirtualMill(const MillOptions& options);

  /// Returns the answer to a line of a client, without its line end.
  [[nodiscard]] std::string Answer(const std::string& line, double now_s);
  /// Ends current motion and restores the mode, as LinuxCNC's helper does at its end.
  void Leave(double now_s);
  [[nodiscard]] MillPlace At(double now_s) const;
  /// False from a fault on: its server is gone.
  [[nodiscard]] bool serves() const;

 private:
  [[nodiscard]] nlohmann::json Do(const nlohmann::json& request, double now_s);
  [[nodiscard]] nlohmann::json Look(double now_s) const;
  [[nodiscard]] nlohmann::json State(double now_s) const;
  [[nodiscard]] nlohmann::json Facts(double now_s) const;
  [[nodiscard]] nlohmann::json Mdi(const std::string& block, double now_s);
  void Move(const std::string& block, double now_s);
  void Stop(double now_s);
  [[nodiscard]] double Progress(double now_s) const;
  [[nodiscard]] std::array<double, 4> Now(double now_s) const;
  [[nodiscard]] std::string Shown(const std::string& text) const;

  MillOptions options_;
  mutable std::mutex mutex_;
  std::string mode_ = "MANUAL";
  bool on_ = true;
  std::array<double, 4> from_ = {};  ///< X, Y, Z, C
  std::array<double, 4> to_ = {};
  double begin_s_ = 0;
  double duration_s_ = 0;
  double estop_s_ = std::numeric_limits<double>::infinity();  ///< time of the emergency stop
  int moves_ = 0;
  std::uint64_t approach_ = 0;
  std::uint64_t turn_ = 0;
  bool serves_ = true;
};

/// Serves the machine on a port of 127.0.0.1 from its own thread.
class MillServer {
 public:
  /// @param port  0 takes a free one
  /// Error (kMachine): the port cannot be listened on.
  [[nodiscard]] static Result<std::unique_ptr<MillServer>> Start(int port,
                                                                 std::shared_ptr<VirtualMill> mill);
  virtual ~MillServer() = default;
  [[nodiscard]] virtual int port() const = 0;
};

/// Forwards standard input to a virtual mill on a port of 127.0.0.1, and its answers to standard
/// output, until either ends. Error (kMachine): no server on that port.
[[nodiscard]] Result<void> JoinMill(int port);

}  // namespace trammel::sim
