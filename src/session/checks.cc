#include "session/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "machine/camera/camera.h"
#include "machine/net/host_clock.h"
#include "settings/material.h"

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

// Moved by hand or by a macro, which no job's state tells.
Check CheckResting(const Session& session) {
  constexpr double kRest_s = 10;  // its own last motion counts for half a second
  const auto rests = session.printer.WaitUntil(
      [](const PrinterState& now) { return now.idle_state != "Printing"; }, "the printer to rest",
      session.Within(kRest_s));
  if (rests) return Pass("idle", "no job is running");
  if (rests.error().kind == ErrorKind::kInterrupted) return NotMade("idle", rests.error());
  return Miss("idle",
              "the printer is moving, or busy with somebody's commands; wait for their end: " +
                  rests.error().message);
}

/// What the printer's configuration allows, as far as it tells.
struct HeaterLimits {
  std::optional<double> nozzle_min_extrude_c;
  std::optional<double> nozzle_max_c;
  std::optional<double> bed_max_c;
};

Result<HeaterLimits> ReadHeaterLimits(const Session& session, const std::string& asked_for) {
  const auto status = session.printer.Query({{"configfile", {"settings"}}}, session.Within(kAsk_s));
  if (!status) return tl::unexpected(status.error());
  const auto member = [](const nlohmann::json& object, const std::string& name) {
    const auto found = object.is_object() ? object.find(name) : object.end();
    return found == object.end() ? nlohmann::json() : *found;
  };
  const nlohmann::json sections = member(member(*status, "configfile"), "settings");
  const auto number = [&](const std::string& section, const char* key) -> std::optional<double> {
    const nlohmann::json value = member(member(sections, section), key);
    return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
  };
  const std::string extruder =
      asked_for.empty() ? session.printer.LastState().active_extruder : asked_for;
  const std::string nozzle = extruder.empty() ? "extruder" : extruder;
  return HeaterLimits{number(nozzle, "min_extrude_temp"), number(nozzle, "max_temp"),
                      number("heater_bed", "max_temp")};
}

}  // namespace

Check Pass(std::string name, std::string detail) {
  return {std::move(name), true, std::move(detail)};
}

Check Miss(std::string name, std::string detail) {
  return {std::move(name), false, std::move(detail)};
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
    session.Say("waiting for the printer to start", kStart_s);
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
  constexpr double kWanted_s = 0.005;  // at 7 mm/s 0.035 mm
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

Check CheckTemperatures(const Session& session, const settings::FilamentSettings& filament,
                        const std::string& nozzle) {
  constexpr const char* kName = "temperatures";
  if (const auto problem = settings::FindTemperatureProblem(filament)) {
    Check check = Miss(kName, fmt::format("nothing can be printed: [{}] {}: {}", problem->section,
                                          problem->key, problem->message));
    check.advice = true;
    return check;
  }
  const auto asked = settings::TemperaturesOf(filament);
  const std::string shown = settings::DescribeTemperatures(filament);
  const auto limits = ReadHeaterLimits(session, nozzle);
  if (!limits) return NotMade(kName, limits.error());
  const auto refuse = [&](const char* key, double asked_c, const char* bound, double bound_c) {
    return Miss(
        kName, fmt::format("{}: [filament] {} = {:.4g} degC is {} this printer's {} = {:.4g} degC; "
                           "name the material that is loaded, or set {}",
                           shown, key, asked_c,
                           std::string_view(bound).starts_with("min") ? "below" : "above", bound,
                           bound_c, key));
  };
  if (limits->nozzle_min_extrude_c && asked.nozzle_c < *limits->nozzle_min_extrude_c) {
    return refuse("nozzle_temperature", asked.nozzle_c, "min_extrude_temp",
                  *limits->nozzle_min_extrude_c);
  }
  if (limits->nozzle_max_c && asked.nozzle_c > *limits->nozzle_max_c) {
    return refuse("nozzle_temperature", asked.nozzle_c, "max_temp of the extruder",
                  *limits->nozzle_max_c);
  }
  if (limits->nozzle_max_c && asked.idle_nozzle_c > *limits->nozzle_max_c) {
    return refuse("idle_nozzle_temperature", asked.idle_nozzle_c, "max_temp of the extruder",
                  *limits->nozzle_max_c);
  }
  if (limits->bed_max_c && asked.bed_c > *limits->bed_max_c) {
    return refuse("bed_temperature", asked.bed_c, "max_temp of the bed", *limits->bed_max_c);
  }
  return Pass(kName, shown);
}

Check CheckDisk(const std::filesystem::path& folder, double record_s, double frames_per_s) {
  // A JPEG of 1280x720 takes 50 to 150 kB; as much again is left to others.
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
                  check.stopped         ? ErrorKind::kInterrupted
                  : check.name == "bed" ? ErrorKind::kSafety
                                        : kind);
    }
  }
  return {};
}

}  // namespace trammel::procedure
