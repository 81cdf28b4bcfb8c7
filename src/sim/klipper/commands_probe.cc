// PROBE and PROBE_ACCURACY with the load cell.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/statistics.h"
#include "sim/klipper/commands.h"

namespace trammel::sim {

namespace {

constexpr double kBeforeTouchS = 0.3;  // samples of a tap
constexpr double kAfterPullBackS = 0.32;

// Converts stretches of one straight movement along Z to a move of the queue; it may end at speed.
TimedMove TimedOf(std::span<const ZMove> moves, const std::array<double, 4>& place,
                  double end_z_mm) {
  TimedMove timed;
  timed.move.from = {place[0], place[1], moves.front().start_z_mm};
  timed.move.to = {place[0], place[1], end_z_mm};
  timed.start_s = moves.front().start_time_s;
  timed.length_mm = std::abs(end_z_mm - moves.front().start_z_mm);
  timed.move.acceleration_mm_s2 = moves.front().acceleration_mm_s2;
  for (const ZMove& move : moves) {
    if (move.acceleration_mm_s2 > 0) timed.accelerate_s = move.duration_s;
    if (move.acceleration_mm_s2 == 0) timed.cruise_s = move.duration_s;
    if (move.acceleration_mm_s2 < 0) timed.decelerate_s = move.duration_s;
  }
  timed.cruise_v_mm_s = timed.move.acceleration_mm_s2 * timed.accelerate_s;
  timed.end_v_mm_s = timed.decelerate_s > 0 ? 0 : timed.cruise_v_mm_s;
  timed.move.feed_mm_s = timed.cruise_v_mm_s;
  return timed;
}

// Taps repeatedly at the head's position.
struct Probing {
  TapMotion motion;
  double lift_speed_mm_s = 5;
  double retract_mm = 2;
  int samples = 1;
  bool accuracy = false;
  bool pulls_back = false;

  enum class Stage { kArrive, kTap, kEmpty } stage = Stage::kArrive;
  double until_s = 0;
  double from_s = 0;
  double halt_z_mm = 0;
  std::vector<ZMove> moves;
  std::vector<double> heights_mm;

  Result<bool> operator()(VirtualKlipper& machine) {
    if (machine.state() != KlippyState::kReady) {
      return Fail("Probing failed due to printer shutdown");
    }
    if (machine.print_now_s() < until_s) return false;
    if (stage == Stage::kEmpty) return Fail("No trigger on probe after full movement");
    if (stage == Stage::kArrive) {
      TRY(Start(machine));
      return false;
    }
    Finish(machine);
    const bool last = static_cast<int>(heights_mm.size()) == samples;
    if (!last || accuracy) {
      std::array<double, 4> up = machine.commanded_mm;
      up[2] = halt_z_mm + retract_mm;
      TRY(MoveTo(machine, up, lift_speed_mm_s));
      Rest(machine, Stage::kArrive);
    }
    if (last) Conclude(machine);
    return last;
  }

  // Waits until the queue is empty.
  void Rest(VirtualKlipper& machine, Stage next) {
    machine.motion().Flush(machine.print_now_s());
    machine.gcode.last_mm = machine.commanded_mm;
    until_s = machine.motion().print_time_s();
    stage = next;
  }

  Result<void> Start(VirtualKlipper& machine) {
    const std::array<double, 4> place = machine.commanded_mm;
    halt_z_mm = machine.cell()->NextHaltZ(motion, place[0], place[1]);
    if (halt_z_mm >= place[2]) return Fail("Probe triggered prior to movement");
    const double lowest_mm = machine.config().axis_minimum_mm[2];
    if (halt_z_mm < lowest_mm) {
      std::array<double, 4> down = place;
      down[2] = lowest_mm;
      TRY(MoveTo(machine, down, motion.approach_speed_mm_s));
      Rest(machine, Stage::kEmpty);
      return {};
    }
    MotionQueue& queue = machine.motion();
    machine.cell()->Tare(machine.print_now_s());
    moves = ApproachMoves(motion, queue.NextStart(machine.print_now_s()), place[2], halt_z_mm);
    queue.AppendTimed(TimedOf(moves, place, halt_z_mm));
    const double stop_s = queue.print_time_s();
    double end_z_mm = halt_z_mm;
    if (pulls_back) {
      const std::vector<ZMove> back = PullBackMoves(motion, stop_s, halt_z_mm);
      end_z_mm += motion.pull_back_mm;
      queue.AppendHalt(back.front().start_time_s);
      queue.AppendTimed(TimedOf(std::span(back).subspan(1), place, end_z_mm));
      moves.insert(moves.end(), back.begin(), back.end());
    } else {
      moves.push_back({stop_s + motion.told_after_s, 0, 0, 0, halt_z_mm, 0});
      queue.AppendHalt(moves.back().start_time_s);
    }
    const double down_s = (place[2] - halt_z_mm) / motion.approach_speed_mm_s;
    const double touch_s = stop_s - (machine.cell()->SurfaceZ(place[0], place[1]) - halt_z_mm) /
                                        motion.approach_speed_mm_s;
    from_s = std::max(stop_s - down_s, touch_s - kBeforeTouchS);
    machine.commanded_mm[2] = end_z_mm;
    Rest(machine, Stage::kTap);
    if (pulls_back) until_s += kAfterPullBackS;
    return {};
  }

  void Finish(VirtualKlipper& machine) {
    ProbedTap tap = machine.cell()->Collect(from_s, until_s);
    tap.x_mm = machine.commanded_mm[0];
    tap.y_mm = machine.commanded_mm[1];
    tap.surface_z_mm = machine.cell()->SurfaceZ(tap.x_mm, tap.y_mm);
    tap.moves = moves;
    tap.reported_z_mm = halt_z_mm;
    heights_mm.push_back(halt_z_mm);
    machine.last_probe_z_mm = halt_z_mm;
    machine.Inform(fmt::format("probe: at {:.3f},{:.3f} bed will contact at z={:.6f}", tap.x_mm,
                               tap.y_mm, halt_z_mm));
    machine.history().taps.push_back(std::move(tap));
  }

  void Conclude(VirtualKlipper& machine) {
    if (!accuracy) {
      machine.Inform(fmt::format("Result: at {:.3f},{:.3f} estimate contact at z={:.6f}",
                                 machine.commanded_mm[0], machine.commanded_mm[1],
                                 Mean(heights_mm)));
      return;
    }
    const auto [lowest, highest] = std::minmax_element(heights_mm.begin(), heights_mm.end());
    double squares = 0;
    for (const double z_mm : heights_mm) squares += std::pow(z_mm - Mean(heights_mm), 2);
    machine.Inform(fmt::format(
        "probe accuracy results: maximum {:.6f}, minimum {:.6f}, range {:.6f}, average {:.6f}, "
        "median {:.6f}, standard deviation {:.6f}",
        *highest, *lowest, *highest - *lowest, Mean(heights_mm), Median(heights_mm),
        std::sqrt(squares / static_cast<double>(heights_mm.size()))));
  }
};

Result<Probing> ReadProbing(const VirtualKlipper& machine, const Command& line, int usual_samples) {
  constexpr double kMaxSamples = 1000;
  const LoadCellConfig& config = *machine.config().load_cell;
  Probing probing;
  probing.motion = config.motion;
  probing.pulls_back = config.pulls_back;
  const auto speed = TRY(FloatOf(line, "PROBE_SPEED", {{}, 0, 50}));
  const auto lift = TRY(FloatOf(line, "LIFT_SPEED", {{}, 0, {}}));
  const auto samples = TRY(FloatOf(line, "SAMPLES", {1, {}, kMaxSamples}));
  const auto retract = TRY(FloatOf(line, "SAMPLE_RETRACT_DIST", {{}, 0, {}}));
  probing.motion.approach_speed_mm_s = speed.value_or(config.motion.approach_speed_mm_s);
  probing.lift_speed_mm_s = lift.value_or(config.lift_speed_mm_s);
  probing.samples = static_cast<int>(samples.value_or(usual_samples));
  probing.retract_mm = retract.value_or(config.retract_mm);
  if (!machine.homed[2]) return Fail("Must home before probe");
  return probing;
}

Result<Outcome> Probe(VirtualKlipper& machine, const Command& line) {
  Probing probing = TRY(ReadProbing(machine, line, 1));
  probing.Rest(machine, Probing::Stage::kArrive);
  return Outcome{probing, {}};
}

Result<Outcome> ProbeAccuracy(VirtualKlipper& machine, const Command& line) {
  constexpr int kUsualSamples = 10;
  Probing probing = TRY(ReadProbing(machine, line, kUsualSamples));
  probing.accuracy = true;
  probing.Rest(machine, Probing::Stage::kArrive);
  machine.Inform(fmt::format(
      "PROBE_ACCURACY at X:{:.3f} Y:{:.3f} Z:{:.3f} (samples={} retract={:.3f} "
      "speed={:.1f} lift_speed={:.1f})",
      machine.commanded_mm[0], machine.commanded_mm[1], machine.commanded_mm[2], probing.samples,
      probing.retract_mm, probing.motion.approach_speed_mm_s, probing.lift_speed_mm_s));
  return Outcome{probing, {}};
}

}  // namespace

const std::map<std::string, Handler>& ProbeCommands() {
  static const std::map<std::string, Handler> commands = {{"PROBE", Probe},
                                                          {"PROBE_ACCURACY", ProbeAccuracy}};
  return commands;
}

namespace {

/// Unexpected Python exception: Klipper stops.
tl::unexpected<Error> InternalError(VirtualKlipper& machine, const Command& line) {
  const std::string what = fmt::format("Internal error on command:\"{}\"", line.name);
  machine.Shutdown(what);
  return tl::unexpected(Error{ErrorKind::kInput, what});
}

const ToolConfig* ConfigOf(const VirtualKlipper& machine, int number) {
  for (const ToolConfig& tool : machine.config().tools) {
    if (tool.number == number) return &tool;
  }
  return nullptr;
}

/// Returns the tool given by T or TOOL; never the selected one here. Messages are the real ones,
/// for every command.
Result<int> ToolOf(const VirtualKlipper& machine, const Command& line) {
  if (const auto name = line.parameters.find("TOOL"); name != line.parameters.end()) {
    for (const ToolConfig& tool : machine.config().tools) {
      if (tool.name == name->second) return tool.number;
    }
    return Fail(fmt::format("Unknown config object '{}'", name->second));
  }
  const auto number = TRY(FloatOf(line, "T"));
  if (!number) return Fail("SET_TOOL_TEMPERATURE: No tool specified and no active tool");
  constexpr double kMax = 1e6;
  const int tool = static_cast<int>(std::clamp(*number, -kMax, kMax));
  if (tool != *number) {
    return Fail(
        fmt::format("Error on '{}': unable to parse {}", line.text, line.parameters.at("T")));
  }
  if (ConfigOf(machine, tool) == nullptr) {
    return Fail(fmt::format("SET_TOOL_TEMPERATURE: T{} not found", tool));
  }
  return tool;
}

/// Accepts numbers, texts in quotes, True, False and None; no other literals.
bool IsLiteral(const std::string& text) {
  if (ToNumber(text) || text == "True" || text == "False" || text == "None") return true;
  const char quote = text.empty() ? ' ' : text.front();
  return text.size() >= 2 && (quote == '\'' || quote == '"') && text.back() == quote;
}

Result<Outcome> SetParameter(VirtualKlipper& machine, const Command& line) {
  const auto tool = TRY(ToolOf(machine, line));
  const auto name = TRY(RequiredText(line, "PARAMETER"));
  const auto value = TRY(RequiredText(line, "VALUE"));
  const auto offset = std::find(kToolOffsetNames.begin(), kToolOffsetNames.end(), name);
  const bool is_offset = offset != kToolOffsetNames.end();
  if (!IsLiteral(value) || (is_offset && !ToNumber(value))) return InternalError(machine, line);
  if (machine.faults().deaf_tools) return Outcome{};
  ToolState& state = machine.tools[tool];
  state.parameters[name] = value;
  if (!is_offset) return Outcome{};
  const auto axis = static_cast<std::size_t>(offset - kToolOffsetNames.begin());
  state.offset_mm[axis] = ToNumber(value).value_or(0);
  machine.Record(fmt::format("tool{}_{}", tool, name), state.offset_mm[axis]);
  return Outcome{};
}

Result<Outcome> SaveParameter(VirtualKlipper& machine, const Command& line) {
  const auto tool = TRY(ToolOf(machine, line));
  const auto name = TRY(RequiredText(line, "PARAMETER"));
  const ToolState& state = machine.tools[tool];
  const auto value = state.parameters.find(name);
  if (value == state.parameters.end()) {
    return Fail(fmt::format("Tool does not have parameter {}", name));
  }
  machine.pending_items[ConfigOf(machine, tool)->name][name] = value->second;
  machine.save_config_pending = true;
  return Outcome{};
}

/// Selects a tool as before December 2025: its offset becomes G-code's own, if it was changed
/// before the tool is selected.
Result<Outcome> Select(VirtualKlipper& machine, int number) {
  const ToolConfig* tool = ConfigOf(machine, number);
  if (tool == nullptr) return Fail(fmt::format("Select tool: T{} not found", number));
  if (machine.homed != std::array{true, true, true}) {
    return Fail("Cannot perform toolchange, axis not homed. Required: xyz");
  }
  if (machine.active_tool == number) {
    machine.Inform(fmt::format("Tool {} already selected", tool->name));
    return Outcome{};
  }
  machine.active_tool = number;
  machine.active_extruder = tool->extruder();
  machine.Inform(fmt::format("Selected tool {} ({})", number, tool->name));
  const std::array<double, 3>& offset_mm = machine.tools[number].offset_mm;
  return Outcome{
      {},
      {fmt::format("SET_GCODE_OFFSET X={} Y={} Z={}", offset_mm[0], offset_mm[1], offset_mm[2])}};
}

Result<Outcome> SelectTool(VirtualKlipper& machine, const Command& line) {
  const auto tool = TRY(ToolOf(machine, line));
  return Select(machine, tool);
}

}  // namespace

bool IsToolChange(const VirtualKlipper& machine, const std::string& name) {
  const auto& tools = machine.config().tools;
  return std::any_of(tools.begin(), tools.end(), [&](const ToolConfig& tool) {
    return name == fmt::format("T{}", tool.number);
  });
}

Result<Outcome> ChangeTool(VirtualKlipper& machine, const Command& line) {
  return Select(machine, static_cast<int>(ToNumber(line.name.substr(1)).value_or(-1)));
}

const std::map<std::string, Handler>& ToolCommands() {
  static const std::map<std::string, Handler> commands = {
      {"SET_TOOL_PARAMETER", SetParameter},
      {"SAVE_TOOL_PARAMETER", SaveParameter},
      {"SELECT_TOOL", SelectTool},
  };
  return commands;
}

}  // namespace trammel::sim
