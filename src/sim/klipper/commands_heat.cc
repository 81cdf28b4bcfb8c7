// G-code for heaters and the fan.
#include <fmt/format.h>

#include <algorithm>

#include "sim/klipper/commands.h"

namespace trammel::sim {
namespace {

std::string Report(const VirtualKlipper& machine) {
  std::string text =
      fmt::format("B:{:.1f} /{:.1f} T0:{:.1f} /{:.1f}", machine.bed.temperature_c,
                  machine.bed.target_c, machine.nozzle.temperature_c, machine.nozzle.target_c);
  int tool = 0;
  for (const Heater& heater : machine.more_nozzles) {
    text += fmt::format(" T{}:{:.1f} /{:.1f}", ++tool, heater.temperature_c, heater.target_c);
  }
  return text;
}

// Waits for a condition and reports the temperatures once a second meanwhile.
Wait Reporting(std::function<bool(const VirtualKlipper&)> done) {
  double next_s = -1;
  return [done = std::move(done), next_s](VirtualKlipper& machine) mutable -> Result<bool> {
    constexpr double kEveryS = 1;
    if (machine.state() != KlippyState::kReady || done(machine)) return true;
    if (machine.now_s() >= next_s) {
      next_s = machine.now_s() + kEveryS;
      machine.Respond(Report(machine));
    }
    return false;
  };
}

Result<Outcome> Heat(VirtualKlipper& machine, Heater& heater, double target_c, bool wait) {
  if (target_c != 0 && (target_c < 0 || target_c > heater.config.highest_c)) {
    return Fail(fmt::format("Requested temperature ({:.1f}) out of range ({:.1f}:{:.1f})", target_c,
                            0.0, heater.config.highest_c));
  }
  machine.SetHeaterTarget(heater, target_c);
  if (!wait || target_c == 0) return Outcome{};
  return Outcome{Reporting([&heater](const VirtualKlipper&) { return !Busy(heater); }), {}};
}

Result<Outcome> HeatByLetter(VirtualKlipper& machine, const CommandLine& line) {
  const auto target = TRY(FloatOf(line, "S"));
  const bool nozzle = line.name == "M104" || line.name == "M109";
  const bool wait = line.name == "M109" || line.name == "M190";
  const auto tool = TRY(FloatOf(line, "T"));
  const std::string extruder = !tool        ? machine.active_extruder
                               : *tool == 0 ? "extruder"
                                            : fmt::format("extruder{:.0f}", *tool);
  Heater* heater = nozzle ? machine.FindHeater(extruder) : &machine.bed;
  if (heater == nullptr) return Fail("Extruder not configured");
  return Heat(machine, *heater, target.value_or(0), wait);
}

Result<Outcome> SetHeater(VirtualKlipper& machine, const CommandLine& line) {
  const auto name = TRY(RequiredText(line, "HEATER"));
  Heater* heater = machine.FindHeater(name);
  if (heater == nullptr) return Fail(fmt::format("The value '{}' is not valid for HEATER", name));
  const auto target = TRY(FloatOf(line, "TARGET"));
  return Heat(machine, *heater, target.value_or(0), false);
}

Result<Outcome> HeatersOff(VirtualKlipper& machine, const CommandLine&) {
  for (Heater* heater : machine.Heaters()) machine.SetHeaterTarget(*heater, 0);
  return Outcome{};
}

Result<Outcome> WaitForTemperature(VirtualKlipper& machine, const CommandLine& line) {
  const auto name = TRY(RequiredText(line, "SENSOR"));
  const Heater* heater = machine.FindHeater(name);
  if (heater == nullptr) return Fail(fmt::format("Unknown sensor '{}'", name));
  const auto minimum = TRY(FloatOf(line, "MINIMUM"));
  const auto maximum = TRY(FloatOf(line, "MAXIMUM"));
  if (!minimum && !maximum) {
    return Fail("Error on 'TEMPERATURE_WAIT': missing MINIMUM or MAXIMUM.");
  }
  const double lo = minimum.value_or(-1e9);
  const double hi = maximum.value_or(1e9);
  return Outcome{Reporting([heater, lo, hi](const VirtualKlipper&) {
                   return heater->temperature_c >= lo && heater->temperature_c <= hi;
                 }),
                 {}};
}

Result<Outcome> ActivateExtruder(VirtualKlipper& machine, const CommandLine& line) {
  const auto name = TRY(RequiredText(line, "EXTRUDER"));
  const Heater* heater = machine.FindHeater(name);
  if (heater == nullptr || heater == &machine.bed) {
    return Fail(fmt::format("The value '{}' is not valid for EXTRUDER", name));
  }
  machine.active_extruder = name;
  return Outcome{};
}

Result<Outcome> TellTemperatures(VirtualKlipper& machine, const CommandLine&) {
  machine.Respond(Report(machine));
  return Outcome{};
}

Result<Outcome> Fan(VirtualKlipper& machine, const CommandLine& line) {
  const auto speed = TRY(FloatOf(line, "S", {0, {}, {}}));
  machine.fan_speed = line.name == "M107" ? 0 : std::min(1.0, speed.value_or(255) / 255);
  return Outcome{};
}

}  // namespace

const std::map<std::string, Handler>& HeatCommands() {
  static const std::map<std::string, Handler> commands = {
      {"M104", HeatByLetter},
      {"M109", HeatByLetter},
      {"M140", HeatByLetter},
      {"M190", HeatByLetter},
      {"SET_HEATER_TEMPERATURE", SetHeater},
      {"TURN_OFF_HEATERS", HeatersOff},
      {"TEMPERATURE_WAIT", WaitForTemperature},
      {"ACTIVATE_EXTRUDER", ActivateExtruder},
      {"M105", TellTemperatures},
      {"M106", Fan},
      {"M107", Fan},
  };
  return commands;
}

}  // namespace trammel::sim
