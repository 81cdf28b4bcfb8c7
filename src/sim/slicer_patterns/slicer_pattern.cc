#include "sim/slicer_patterns/slicer_pattern.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sim/print/named_number.h"
#include "sim/slicer_patterns/pattern_writers.h"

namespace trammel::sim {
namespace {

constexpr std::size_t kMostValues = 400;
constexpr std::size_t kMostInBatch = 4;
constexpr double kOrcaLinePitchMm = 3.5;
constexpr double kOrcaBedMarginMm = 10;

constexpr NamedChoice<PatternKind> kKinds[] = {{"orca-line", PatternKind::kOrcaLine},
                                               {"orca-pattern", PatternKind::kOrcaPattern},
                                               {"ellis", PatternKind::kEllis},
                                               {"marlin-lines", PatternKind::kMarlinLines},
                                               {"orca-batch", PatternKind::kOrcaBatch}};
constexpr NamedChoice<PatternFirmware> kFirmwares[] = {{"klipper", PatternFirmware::kKlipper},
                                                       {"marlin", PatternFirmware::kMarlin},
                                                       {"rrf", PatternFirmware::kRepRap},
                                                       {"bambu", PatternFirmware::kBambu},
                                                       {"prusa", PatternFirmware::kPrusa}};

struct PatternBound {
  const char* name;
  double value;
  double least;
  double most;
};

Result<void> CheckOptions(const PatternOptions& o) {
  for (const PatternBound& b : {PatternBound{"start", o.start_s, 0, 10},
                                {"end", o.end_s, 0, 10},
                                {"step", o.step_s, 1e-6, 10},
                                {"slow", o.slow_mm_s, 1, 1000},
                                {"fast", o.fast_mm_s, 1, 1000},
                                {"first-layer-speed", o.first_layer_mm_s, 1, 1000},
                                {"acceleration", o.acceleration_mm_s2, 50, 1e5},
                                {"corner", o.corner_mm_s, 0, 50},
                                {"smooth-time", o.smooth_time_s, -1, 0.2},
                                {"nozzle", o.nozzle_mm, 0.2, 1},
                                {"first-layer", o.first_layer_mm, 0.05, 0.8},
                                {"layer", o.layer_mm, 0.05, 0.8},
                                {"flow-ratio", o.flow_ratio, 0.5, 1.5},
                                {"bed width", o.bed_x_mm, 100, 1000},
                                {"bed depth", o.bed_y_mm, 100, 1000},
                                {"bars", double(o.bars), 0, 2},
                                {"walls", double(o.walls), 1, 8},
                                {"layers", double(o.layers), 2, 10},
                                {"spacing", o.spacing_mm, 0.5, 20},
                                {"nozzle temperature", o.nozzle_c, 150, 400},
                                {"plate temperature", o.plate_c, 0, 150}}) {
    if (!(b.value >= b.least && b.value <= b.most)) {
      return Fail(fmt::format("{} = {}: must be {} ... {}", b.name, b.value, b.least, b.most));
    }
  }
  if (!(o.end_s > o.start_s)) {
    return Fail(fmt::format("end = {}: must be above the start, {}", o.end_s, o.start_s));
  }
  for (const auto& [name, list, most] : {std::tuple{"speeds", &o.speeds_mm_s, 1000.0},
                                         {"accelerations", &o.accelerations_mm_s2, 1e5}}) {
    const bool within = std::all_of(list->begin(), list->end(),
                                    [&](double value) { return value >= 1 && value <= most; });
    if (list->empty() || list->size() > kMostInBatch || !within) {
      return Fail(fmt::format("{} = {:g}: must be 1 to {} numbers of 1 ... {:g}", name,
                              fmt::join(*list, ","), kMostInBatch, most));
    }
  }
  if (o.rotation_deg % 45 != 0 || o.rotation_deg < 0 || o.rotation_deg > 315) {
    return Fail(
        fmt::format("rotation = {}: must be a multiple of 45 within 0 ... 315", o.rotation_deg));
  }
  return {};
}

// Returns what OrcaSlicer and Bambu Studio append: the profile's settings.
void AppendConfig(const PatternOptions& o, PatternSketch& sketch) {
  const char* flavor = o.firmware == PatternFirmware::kKlipper  ? "klipper"
                       : o.firmware == PatternFirmware::kRepRap ? "reprapfirmware"
                                                                : "marlin";
  sketch.Line("; CONFIG_BLOCK_START");
  for (const std::string& line :
       {fmt::format("filament_flow_ratio = {:g}", o.flow_ratio),
        fmt::format("gcode_flavor = {}", flavor),
        fmt::format("initial_layer_print_height = {:g}", o.first_layer_mm),
        fmt::format("initial_layer_speed = {:g}", o.first_layer_mm_s),
        fmt::format("layer_height = {:g}", o.layer_mm),
        fmt::format("line_width = {:g}", 1.125 * o.nozzle_mm),
        fmt::format("nozzle_diameter = {:g}", o.nozzle_mm),
        fmt::format("outer_wall_acceleration = {:g}", o.acceleration_mm_s2),
        fmt::format("outer_wall_jerk = {:g}", o.corner_mm_s),
        fmt::format("outer_wall_speed = {:g}", o.fast_mm_s),
        fmt::format("printable_area = 0x0,{0:g}x0,{0:g}x{1:g},0x{1:g}", o.bed_x_mm, o.bed_y_mm)}) {
    sketch.Line("; " + line);
  }
  sketch.Line("; CONFIG_BLOCK_END");
}

bool IsOrca(PatternKind kind) {
  return kind == PatternKind::kOrcaLine || kind == PatternKind::kOrcaPattern ||
         kind == PatternKind::kOrcaBatch;
}

SketchHabits HabitsOf(PatternKind kind) {
  switch (kind) {
    case PatternKind::kOrcaLine:
    case PatternKind::kOrcaPattern:
    case PatternKind::kOrcaBatch:
      return {0.8, 0.4, 0};
    case PatternKind::kEllis:
      return {0.5, 0.1, 2};
    case PatternKind::kMarlinLines:
      return {1, 0, 0};
  }
  return {};
}

}  // namespace

Result<PatternKind> ParsePatternKind(std::string_view name) {
  return ChoiceOf(kKinds, "pattern", name);
}

std::string_view ToString(PatternKind kind) {
  for (const auto& entry : kKinds) {
    if (entry.value == kind) return entry.name;
  }
  return "";
}

Result<PatternFirmware> ParsePatternFirmware(std::string_view name) {
  return ChoiceOf(kFirmwares, "firmware", name);
}

PatternOptions PatternDefaults(PatternKind kind) {
  PatternOptions options;
  options.kind = kind;
  switch (kind) {
    case PatternKind::kOrcaLine:
      break;
    case PatternKind::kOrcaPattern:
    case PatternKind::kOrcaBatch:
      options.end_s = 0.08;
      options.step_s = 0.005;
      break;
    case PatternKind::kEllis:
      options.end_s = 0.08;
      options.step_s = 0.005;
      options.first_layer_mm = 0.25;
      break;
    case PatternKind::kMarlinLines:
      options.firmware = PatternFirmware::kMarlin;
      options.step_s = 0.005;
      options.fast_mm_s = 70;
      options.acceleration_mm_s2 = 500;
      options.first_layer_mm = 0.2;
      break;
  }
  return options;
}

Result<std::vector<double>> PatternValues(const PatternOptions& options) {
  TRY(CheckOptions(options));
  const double quotient = (options.end_s - options.start_s) / options.step_s;
  if (quotient > static_cast<double>(kMostValues)) {
    return Fail(fmt::format("step = {}: more than {} lines from {} to {}", options.step_s,
                            kMostValues, options.start_s, options.end_s));
  }
  std::vector<double> values;
  if (options.kind == PatternKind::kMarlinLines) {
    for (double value = options.start_s; value <= options.end_s; value += options.step_s) {
      values.push_back(value);
    }
    return values;
  }
  double count = 0;
  if (options.kind == PatternKind::kOrcaLine) {
    count = std::min(std::round(std::ceil(quotient)) + 1,
                     std::floor((options.bed_y_mm - kOrcaBedMarginMm) / kOrcaLinePitchMm));
  } else if (IsOrca(options.kind)) {
    count = std::ceil(quotient + 1);
  } else {
    count = std::round(quotient) + 1;
  }
  for (int i = 0; i < static_cast<int>(count); ++i) {
    values.push_back(options.start_s + i * options.step_s);
  }
  return values;
}

std::string CutLabel(double value, int digits, std::size_t characters) {
  return fmt::format("{:.{}g}", value, digits).substr(0, characters);
}

std::string RoundLabel(double value, int decimals) {
  const double scale = std::pow(10, decimals);
  return fmt::format("{:.6g}", std::round(value * scale) / scale);
}

Result<void> CheckOnBed(const PatternBox& box, const PatternOptions& options) {
  const double left = options.round_bed ? -options.bed_x_mm / 2 : 0;
  const double bottom = options.round_bed ? -options.bed_y_mm / 2 : 0;
  if (box.left_mm >= left && box.bottom_mm >= bottom && box.right_mm <= left + options.bed_x_mm &&
      box.top_mm <= bottom + options.bed_y_mm) {
    return {};
  }
  return Fail(fmt::format(
      "the pattern of {:.0f} x {:.0f} mm does not fit on the bed of {:g} x {:g} mm: fewer values, "
      "or a larger bed",
      box.right_mm - box.left_mm, box.top_mm - box.bottom_mm, options.bed_x_mm, options.bed_y_mm));
}

Result<SlicerPattern> WriteSlicerPattern(const PatternOptions& options) {
  SlicerPattern pattern;
  pattern.pressure_advance_s = TRY(PatternValues(options));
  const std::vector<double>& values = pattern.pressure_advance_s;
  PatternSketch sketch(options, HabitsOf(options.kind));
  const bool orca = IsOrca(options.kind);
  if (orca) {
    sketch.Line(options.firmware == PatternFirmware::kBambu ? "; generated by BambuStudio"
                                                            : "; generated by OrcaSlicer");
  }
  if (options.kind == PatternKind::kOrcaLine) {
    TRY(DrawOrcaLines(options, values, sketch));
  } else if (options.kind == PatternKind::kMarlinLines) {
    TRY(DrawMarlinLines(options, values, sketch));
  } else {
    TRY(DrawChevrons(options, values, sketch));
  }
  sketch.End();
  if (orca) AppendConfig(options, sketch);
  pattern.gcode = sketch.Take();
  return pattern;
}

}  // namespace trammel::sim
