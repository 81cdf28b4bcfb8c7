#include "session/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "machine/camera/camera.h"
#include "machine/net/host_clock.h"

namespace trammel::procedure {
namespace {

using machine::PrinterReadiness;
using machine::PrinterState;

constexpr double kAsk_s = 10;

// G1, M104, T0: every firmware has those that a pattern needs, and old ones do not list them.
bool IsClassic(const std::string& word) {
  return word.size() >= 2 && std::string("GMT").find(word[0]) != std::string::npos &&
         std::all_of(word.begin() + 1, word.end(), [](char c) { return c >= '0' && c <= '9'; });
}

Check CheckReadiness(const PrinterState& state) {
  if (state.readiness == PrinterReadiness::kReady) return Pass("printer", "ready");
  return Miss("printer", fmt::format("the printer is not ready but in \"{}\": {}; look at its own "
                                     "screen, then FIRMWARE_RESTART",
                                     ToString(state.readiness), machine::FirstLine(state.message)));
}

Check CheckIdle(const PrinterState& state) {
  if (state.print_state == "printing" || state.print_state == "paused") {
    return Miss("idle", fmt::format("the printer is busy: {} is {}; wait for its end or cancel it",
                                    state.print_file, state.print_state));
  }
  if (state.paused) {
    return Miss("idle", "the printer is paused: RESUME or CANCEL_PRINT (or CLEAR_PAUSE) first");
  }
  return Pass("idle", "no job is running");
}

// Detects motion by hand or by a macro, which no job's state shows.
Check CheckResting(const Session& session) {
  constexpr double kRest_s = 10;  // trammel's last motion is visible for half a second
  const auto rests = session.printer.WaitUntil(
      [](const PrinterState& now) { return now.idle_state != "Printing"; }, "the printer to rest",
      session.Within(kRest_s));
  if (rests) return Pass("idle", "no job is running");
  if (rests.error().kind == ErrorKind::kInterrupted) return NotMade("idle", rests.error());
  return Miss("idle",
              "the printer is moving, or busy with somebody's commands; wait for their end: " +
                  rests.error().message);
}

}  // namespace

Check Pass(std::string name, std::string detail) {
  return {std::move(name), true, std::move(detail)};
}

Check Miss(std::string name, std::string detail) {
  return {std::move(name), false, std::move(detail)};
}

Check Unsafe(std::string name, std::string detail) {
  Check check = Miss(std::move(name), std::move(detail));
  check.unsafe = true;
  return check;
}

Check NotMade(std::string name, const Error& error) {
  Check check = Miss(std::move(name), error.message);
  check.stopped = error.kind == ErrorKind::kInterrupted;
  return check;
}

std::vector<Check> CheckReady(const Session& session) {
  auto state = session.printer.State(session.Within(kAsk_s));
  if (state && state->readiness == PrinterReadiness::kStartup) {
    constexpr double kStart_s = 60;
    session.Report("waiting for the printer to start", kStart_s);
    if (auto ready = session.printer.WaitUntilReady(session.Within(kStart_s)); !ready) {
      return {NotMade("printer", ready.error())};
    }
    state = session.printer.State(session.Within(kAsk_s));
  }
  if (!state) return {NotMade("printer", state.error())};
  std::vector<Check> checks = {CheckReadiness(*state)};
  if (!checks.back().passed) return checks;
  checks.push_back(CheckIdle(*state));
  if (checks.back().passed && state->idle_state == "Printing") {
    checks.back() = CheckResting(session);
  }
  return checks;
}

Check CheckCommands(const Session& session, const std::string& name, const std::string& gcode) {
  std::string known_words;
  std::size_t at = 0;
  while (at < gcode.size()) {
    const std::size_t end = std::min(gcode.find('\n', at), gcode.size());
    const std::string line = gcode.substr(at, end - at);
    at = end + 1;
    const std::string word = line.substr(0, line.find_first_of(" \t\r;"));
    if (word.empty() || IsClassic(word)) continue;
    const auto known = session.printer.HasCommand(word, session.Within(kAsk_s));
    if (!known) return NotMade(name, known.error());
    if (!*known) {
      return Miss(name,
                  fmt::format("the printer has no command {}: write a macro of that name (see "
                              "klipper/), or name another",
                              word));
    }
    known_words += (known_words.empty() ? "" : ", ") + word;
  }
  if (gcode.empty()) return Pass(name, "not set");
  return Pass(name, known_words.empty() ? "plain G-code" : known_words);
}

Check CheckLimit(const Session& session) {
  const auto known = session.printer.HasCommand(kKeepAlive, session.Within(kAsk_s));
  if (!known) return NotMade("own limit", known.error());
  if (*known) return Pass("own limit", "laser and heaters go off by themselves should trammel die");
  Check check =
      Miss("own limit",
           fmt::format("the printer has no {}: with klipper/trammel.cfg laser and heaters go "
                       "off by themselves should trammel die",
                       kKeepAlive));
  check.advice = true;
  return check;
}

std::vector<Check> CheckTiming(const Session& session) {
  constexpr double kWanted_s = 0.005;  // 0.035 mm at 7 mm/s
  std::vector<Check> checks;
  const auto clock = session.printer.Clock(kWanted_s, session.Within(kAsk_s));
  if (!clock) {
    checks.push_back(NotMade("clock", clock.error()));
  } else {
    const double bound_s = clock->PrintTimeBound(machine::HostNow());
    const std::string figure =
        fmt::format("the printer's time is known to {:.1f} ms", 1e3 * bound_s);
    checks.push_back(
        bound_s <= kWanted_s
            ? Pass("clock", figure)
            : Miss("clock", figure + ": is its host overloaded, or the network slow?"));
  }
  const auto moves = session.printer.RecordMoves(session.Within(kAsk_s));
  checks.push_back(moves ? Pass("motion", "the printer tells its moves")
                         : NotMade("motion", moves.error()));
  return checks;
}

Check CheckDisk(const std::filesystem::path& folder, double record_s, double frames_per_s) {
  // A JPEG of 1280x720 takes 50 to 150 kB; as much again is reserved for others.
  constexpr double kFrameBytes = 150e3;
  return CheckDisk(folder, 2 * record_s * frames_per_s * kFrameBytes);
}

Check CheckDisk(const std::filesystem::path& folder, double needed) {
  std::error_code error;
  const auto space = std::filesystem::space(folder, error);
  if (error) {
    return Miss("disk", fmt::format("{}: {}", folder.string(), error.message()));
  }
  const auto free = static_cast<double>(space.available);
  const std::string figures = fmt::format("{:.1f} GB free at {}, {:.1f} GB needed", free / 1e9,
                                          folder.string(), needed / 1e9);
  if (free < needed) {
    return Miss("disk", figures + ": delete old recordings, or name another folder with --out");
  }
  return Pass("disk", figures);
}

Result<void> FirstFailure(const std::vector<Check>& checks, ErrorKind kind) {
  for (const Check& check : checks) {
    if (!check.passed && !check.advice) {
      return Fail(fmt::format("{}: {}", check.name, check.detail),
                  check.stopped  ? ErrorKind::kInterrupted
                  : check.unsafe ? ErrorKind::kSafety
                                 : kind);
    }
  }
  return {};
}

}  // namespace trammel::procedure
