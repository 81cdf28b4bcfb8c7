#include "machine/linuxcnc/linuxcnc.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "base/check.h"
#include "machine/net/host_clock.h"
#include "machine/net/wait.h"

namespace trammel::machine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kPoll_s = 0.02;
constexpr double kLeash_s = 0.5;
constexpr double kShortestPiece = 0.01;  // mm or degrees
constexpr double kArrived = 1e-3;        // mm or degrees
constexpr double kHeld_deg = 0.01;
constexpr double kFarthest_deg = 3600;  // of C from 0: cables end somewhere
// Tolerance of LinuxCNC's six displayed decimals.
constexpr double kShown = 1.1e-6;
constexpr int kFirstParameter = 5221;  // X of G54
constexpr int kParametersPerSlot = 20;

/// Waits; false once stopped.
bool Pause(const std::stop_token& stop) {
  return WaitForFd(-1, 0, HostNow() + kPoll_s, stop) != Waited::kStopped;
}

tl::unexpected<Error> Broken(std::string what) {
  return Fail(std::move(what), ErrorKind::kMachine);
}
tl::unexpected<Error> Unsafe(std::string what) { return Fail(std::move(what), ErrorKind::kSafety); }

std::string At(const Vector4d& position) {
  return fmt::format("X {:.3f} Y {:.3f} Z {:.3f}", position.x(), position.y(), position.z());
}

Result<LinuxCncOffsets> ParseOffsets(const std::string& message) {
  std::istringstream stream(message);
  std::string word;
  std::vector<double> numbers;
  while (stream >> word) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos) continue;
    std::istringstream value(word.substr(equals + 1));
    double number = 0;
    if (value >> number && std::isfinite(number)) numbers.push_back(number);
  }
  constexpr std::size_t kWanted = 7;
  constexpr double kMaxTurned_deg = 1e6;
  const auto no_length = [](double mm) { return std::abs(mm) > kFarthest_mm; };
  const auto no_flag = [](double flag) { return flag != 0 && flag != 1; };
  if (numbers.size() != kWanted || std::any_of(numbers.begin(), numbers.begin() + 3, no_length) ||
      std::abs(numbers[3]) > kMaxTurned_deg || no_flag(numbers[4]) || no_flag(numbers[5]) ||
      no_length(numbers[6])) {
    return Broken(
        fmt::format("LinuxCNC shows its offsets as \"{}\", which cannot be", Clipped(message)));
  }
  return LinuxCncOffsets{{{numbers[0], numbers[1], numbers[2]}, numbers[3]},
                         numbers[4] != 0,
                         numbers[5] != 0,
                         numbers[6]};
}

Result<void> CheckState(const LinuxCncState& state, const LinuxCncOptions& options, bool motion) {
  if (state.estop) return Unsafe("LinuxCNC is in emergency stop; release it at the machine");
  if (!state.on) return Unsafe("LinuxCNC's machine power is off; switch it on at the machine");
  if (!state.homed) {
    return Unsafe(fmt::format("not all of LinuxCNC's joints 0 … {} are homed; home the machine",
                              options.joints - 1));
  }
  if (!state.metric) {
    return Unsafe("LinuxCNC's own unit is not the millimetre; only metric machines are driven");
  }
  if (!state.idle) return Unsafe("LinuxCNC runs a program or a move; wait for it or abort it");
  if (!state.spindle_stopped) return Unsafe("the spindle turns; stop it: a camera is to sit in it");
  if (motion && state.feed_override == 0) {
    return Unsafe("LinuxCNC's feed override stands at 0: turn it up, nothing moves there");
  }
  if (motion && options.c_holds_spindle && !state.c_axis) {
    return Unsafe("LinuxCNC has no axis C that could hold the spindle; lock it by hand");
  }
  if (motion && !options.c_holds_spindle && !options.spindle_locked_by_hand) {
    return Unsafe(
        "nothing says that the spindle is held in its oriented position: name its C axis, or "
        "confirm that it has been locked by hand");
  }
  return {};
}

}  // namespace

LinuxCnc::LinuxCnc(std::unique_ptr<LinuxCncSession> session, LinuxCncOptions options)
    : session_(std::move(session)), options_(std::move(options)) {}

Result<std::unique_ptr<LinuxCnc>> LinuxCnc::Connect(const LinuxCncOptions& options,
                                                    const std::stop_token& stop) {
  auto session = TRY(LinuxCncSession::Join(options.session, stop));
  return std::unique_ptr<LinuxCnc>(new LinuxCnc(std::move(session), options));
}

Result<void> LinuxCnc::CheckMode(const std::string& mode) {
  taken_ = taken_ || (held_ && mode != "MDI");
  if (!taken_) return {};
  return Unsafe(
      fmt::format("somebody took LinuxCNC over (it is in {} mode): nothing more is sent "
                  "to it, and whatever moves is theirs",
                  mode));
}

Result<LinuxCncMotion> LinuxCnc::Motion(const std::stop_token& stop) {
  auto motion = session_->Motion(stop);
  if (!motion) return motion;
  TRY(CheckMode(motion->mode));
  // Before the axes are homed, their limits are meaningless.
  TRY(CheckStatedPlace(motion->position.head<3>(), travel_known_ ? travel_ : LinuxCncTravel()));
  return motion;
}

Result<void> LinuxCnc::LearnTravel(const std::stop_token& stop) {
  if (travel_known_) return {};
  const auto shown = TRY(session_->Interpreted(
      "#<_ini[AXIS_X]MIN_LIMIT> #<_ini[AXIS_X]MAX_LIMIT> #<_ini[AXIS_Y]MIN_LIMIT> "
      "#<_ini[AXIS_Y]MAX_LIMIT> #<_ini[AXIS_Z]MIN_LIMIT> #<_ini[AXIS_Z]MAX_LIMIT>",
      stop));
  travel_ = TRY(ParseTravel(shown));
  travel_known_ = true;
  return {};
}

Result<LinuxCncState> LinuxCnc::State(const std::stop_token& stop) {
  auto state = session_->State(options_.joints, stop);
  if (!state) return state;
  TRY(CheckStatedPlace(state->position_mm, travel_known_ ? travel_ : LinuxCncTravel()));
  return state;
}

Result<LinuxCncFacts> LinuxCnc::Facts(const std::stop_token& stop) { return session_->Facts(stop); }

Result<void> LinuxCnc::Prepare(bool motion, const std::stop_token& stop) {
  const auto state = TRY(State(stop));
  TRY(CheckMode(state.mode));
  TRY(CheckState(state, options_, motion));
  if (held_) return {};
  TRY(session_->TakeMdi(stop));
  held_ = true;
  return {};
}

std::string LinuxCnc::Halt() {
  constexpr double kStanding_mm = 1e-6;
  const std::stop_token never;
  if (const auto aborted = session_->Abort(); !aborted) {
    if (aborted.error().kind == ErrorKind::kSafety) return "whatever moves is theirs";
    return "the helper is lost and the move could not be aborted; it ends by itself with the piece "
           "that was sent: look at the machine";
  }
  std::optional<Vector4d> last;
  const double deadline_s = HostNow() + options_.session.time_limit_s;
  while (HostNow() < deadline_s) {
    const auto motion = Motion(never);
    if (!motion) break;
    if (last && motion->idle && (motion->position - *last).norm() < kStanding_mm) {
      return "the machine stands at " + At(motion->position);
    }
    last = motion->position;
    Pause(never);
  }
  return "the move was aborted, but the machine was not seen to stand: look at it";
}

Result<void> LinuxCnc::MoveOnce(Driven driven, const Vector4d& to, double feed_min,
                                double time_limit_s, const std::stop_token& stop) {
  const bool turns = driven == Driven::kC;
  const auto off_by = [&](const Vector4d& at) {
    return turns ? std::abs(at[3] - to[3]) : (at - to).head<3>().cwiseAbs().maxCoeff();
  };
  const std::string goal = turns ? fmt::format("C {:.3f}", to[3]) : At(to);
  const std::string words = turns ? fmt::format("C{:.6f}", to[3])
                                  : fmt::format("X{:.6f} Y{:.6f} Z{:.6f}", to.x(), to.y(), to.z());
  const auto move = fmt::format("G21 G90 G94 G53 G1 {} F{:.3f}", words, feed_min);
  TRY(session_->Move(move, stop));
  // A machine that approaches is still moving, however slowly: feed override, a busy computer.
  constexpr double kPatience = 20;  // limits, for the whole move
  const double end_s = HostNow() + kPatience * time_limit_s;
  double deadline_s = HostNow() + time_limit_s;
  double closest = std::numeric_limits<double>::infinity();
  while (HostNow() < std::min(deadline_s, end_s)) {
    const auto now = TRY(Motion(stop));
    const double off = off_by(now.position);
    if (off < kArrived && now.idle) return {};
    // A move that reached its target may settle a little later.
    if (now.idle && off_by(now.commanded) >= kArrived) {
      return Broken(
          fmt::format("the move to {} ended at {}: somebody aborted it, or LinuxCNC "
                      "refuses it; its own screen says why",
                      goal, At(now.position)));
    }
    if (off < closest - kArrived) {
      closest = off;
      deadline_s = HostNow() + time_limit_s;
    }
    if (!now.spindle_stopped) return Unsafe("the spindle was started during the move");
    if (!Pause(stop)) return Fail("stopped", ErrorKind::kInterrupted);
  }
  return Broken(fmt::format("the move to {} did not arrive within {:.1f} s", goal, time_limit_s));
}

Result<LinuxCncTravel> LinuxCnc::Travel(const std::stop_token& stop) {
  TRY(Prepare(true, stop));
  TRY(LearnTravel(stop));
  return travel_;
}

Result<void> LinuxCnc::MoveTo(const Vector3d& machine_mm, double feed_mm_min,
                              const std::stop_token& stop) {
  const auto travel = TRY(Travel(stop));
  TRY(CheckTarget(machine_mm, travel));
  return Drive(Driven::kXyz, {machine_mm.x(), machine_mm.y(), machine_mm.z(), 0}, feed_mm_min,
               stop);
}

Result<void> LinuxCnc::TurnTo(double c_deg, double speed_deg_min, const std::stop_token& stop) {
  constexpr double kMaxTurned_deg = 720;
  TRAMMEL_CHECK(options_.c_holds_spindle && std::abs(c_deg) <= kMaxTurned_deg, "C = {} deg", c_deg);
  TRY(Prepare(true, stop));
  return Drive(Driven::kC, {0, 0, 0, c_deg}, speed_deg_min, stop);
}

Result<void> LinuxCnc::Drive(Driven driven, const Vector4d& to, double feed_min,
                             const std::stop_token& stop) {
  TRAMMEL_CHECK(feed_min >= 10 && feed_min <= 1e5, "feed = {} mm/min or deg/min", feed_min);
  const auto state = TRY(State(stop));
  TRY(CheckMode(state.mode));
  // The trajectory's limits apply to moves in mm.
  const double fastest_min = driven == Driven::kXyz ? 60 * state.fastest_mm_s : feed_min;
  const double true_feed_min = std::min(feed_min * state.feed_override, fastest_min);
  const double piece = std::max(kShortestPiece, true_feed_min / 60 * kLeash_s);
  const Vector3d& at = state.position_mm;
  const Vector4d from(at.x(), at.y(), at.z(), state.c_deg);
  if (driven == Driven::kC && !(std::abs(state.c_deg) <= kFarthest_deg)) {
    return Broken(
        fmt::format("LinuxCNC says that C stands at {:g} degrees: turn it to 0, or look "
                    "at the controller's scales",
                    state.c_deg));
  }
  auto moved = MoveInPieces(driven, from, to, feed_min, piece, stop);
  if (moved) moved = AwaitRest(driven == Driven::kC ? to[3] : state.c_deg, stop);
  if (moved || taken_) return moved;
  return Fail(fmt::format("{}; {}", moved.error().message, Halt()), moved.error().kind);
}

Result<void> LinuxCnc::MoveInPieces(Driven driven, const Vector4d& from, const Vector4d& to,
                                    double feed_min, double piece, const std::stop_token& stop) {
  // A feed override may slow a machine down to a tenth.
  constexpr double kSlowest = 10;
  const Vector4d way = to - from;
  const double length = driven == Driven::kC ? std::abs(way[3]) : way.head<3>().norm();
  const int pieces = PiecesOf(length, piece);
  const double piece_limit_s = options_.session.time_limit_s + kSlowest * kLeash_s;
  const double limit_s = piece_limit_s + kSlowest * 60 * length / feed_min;
  const double deadline_s = HostNow() + limit_s;
  for (int i = 1; i <= pieces; ++i) {
    if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
    if (HostNow() > deadline_s) {
      return Broken(
          fmt::format("the move is not done after {:.1f} s, ten times what it takes at "
                      "its feed; look at the feed override",
                      limit_s));
    }
    const double left = 1 - static_cast<double>(i) / pieces;
    TRY(MoveOnce(driven, to - left * way, feed_min, piece_limit_s, stop));
  }
  return {};
}

Result<void> LinuxCnc::AwaitRest(double c_deg, const std::stop_token& stop) {
  const double deadline_s = HostNow() + options_.session.time_limit_s;
  while (HostNow() < deadline_s) {
    const auto motion = TRY(Motion(stop));
    if (motion.idle) {
      if (std::abs(motion.position[3] - c_deg) <= kHeld_deg) return {};
      return Unsafe(
          fmt::format("the spindle's axis C went from {:.4f} to {:.4f} degrees during the "
                      "move; clamp it",
                      c_deg, motion.position[3]));
    }
    if (!Pause(stop)) return Fail("stopped", ErrorKind::kInterrupted);
  }
  return Broken("LinuxCNC arrived, but does not come to rest");
}

Result<LinuxCncOffsets> LinuxCnc::ReadOffsets(int slot, const std::stop_token& stop) {
  TRAMMEL_CHECK(slot >= 1 && slot <= 9, "slot = {}", slot);
  const int x = kFirstParameter + kParametersPerSlot * (slot - 1);
  TRY(Prepare(false, stop));
  const auto shown = TRY(session_->Interpreted(
      fmt::format("x=#{} y=#{} z=#{} r=#{} g92=#5210 metric=#<_metric> tool=#5403", x, x + 1, x + 2,
                  x + 9),
      stop));
  return ParseOffsets(shown);
}

Result<void> LinuxCnc::WriteOffset(int slot, const LinuxCncOffset& offset,
                                   const std::stop_token& stop) {
  TRAMMEL_CHECK(std::isfinite(offset.rotation_deg), "slot = {}", slot);
  if (auto checked = CheckTarget(offset.origin_mm, {}); !checked) {
    return Fail(fmt::format("the origin of work offset {}: {}", slot, checked.error().message),
                checked.error().kind);
  }
  const auto before = TRY(ReadOffsets(slot, stop));
  if (before.g92) {
    return Unsafe("a G92 (or G52) is active and would shift the part: cancel it with G92.1");
  }
  const Vector3d& at = offset.origin_mm;
  const auto set = fmt::format("G21 G10 L2 P{} X{:.6f} Y{:.6f} Z{:.6f} R{:.9f}", slot, at.x(),
                               at.y(), at.z(), offset.rotation_deg);
  TRY(session_->Mdi(set, stop));
  if (!before.metric) {
    TRY(session_->Mdi("G20", stop));
  }
  const auto after = TRY(ReadOffsets(slot, stop));
  const LinuxCncOffset& kept = after.offset;
  // Rotations are equal modulo a whole turn.
  const double turn_deg = std::remainder(kept.rotation_deg - offset.rotation_deg, 360.0);
  if ((kept.origin_mm - at).cwiseAbs().maxCoeff() > kShown || std::abs(turn_deg) > kShown) {
    return Broken(fmt::format(
        "LinuxCNC keeps X {:.6f} Y {:.6f} Z {:.6f} R {:.6f} where X {:.6f} Y {:.6f} Z {:.6f} R "
        "{:.6f} was set",
        kept.origin_mm.x(), kept.origin_mm.y(), kept.origin_mm.z(), kept.rotation_deg, at.x(),
        at.y(), at.z(), offset.rotation_deg));
  }
  return {};
}

}  // namespace trammel::machine
