#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "sim/slicer_patterns/pattern_writers.h"

namespace trammel::sim {
namespace {

constexpr double kArmMm = 30;
constexpr double kArmReachMm = kArmMm / std::numbers::sqrt2;  // in x and in y
constexpr double kLabelMarginMm = 2.5;
constexpr double kCubeMm = 5;

// Differences of the tools.
struct ChevronTool {
  bool orca = false;
  bool bambu = false;
  int loops = 3;
  double shorter_mm =
      1.99;  // by which the first layer's arms begin inside the frame, 0.4 mm nozzle
  GlyphStyle glyphs;
};

ChevronTool ToolOf(const PatternOptions& o) {
  if (o.kind == PatternKind::kEllis) return {false, false, 4, 2.7, {true, true, false, 0.75}};
  return {true, o.firmware == PatternFirmware::kBambu, 3, 1.99, {}};
}

struct Chevrons {
  PatternBox frame;  // centre line of the outer loop
  PatternBox tab;
  double wall_mm = 0.45;
  double frame_wall_mm = 0.56;
  double wall_step_mm = 0.576;  // along x
  double pitch_mm = 3.6;
  double first_x_mm = 0;
  std::vector<std::string> labels;  // of candidates 0, 2, 4 …; empty: none
};

// Returns the labels at candidates 0, 2, 4 …: values, and where Orca adds them flow and
// acceleration.
std::vector<std::string> LabelsOf(const PatternOptions& o, const ChevronTool& tool,
                                  std::span<const double> values, double area_mm2) {
  std::vector<std::string> labels;
  if (!tool.orca) {
    for (std::size_t i = 0; i < values.size(); i += 2) labels.push_back(RoundLabel(values[i], 4));
    return labels;
  }
  constexpr std::size_t kMostCharacters = 5;
  const std::string acceleration = fmt::format("{:.0f}", o.acceleration_mm_s2);
  std::size_t longest = tool.bambu ? 1 : acceleration.size();
  for (std::size_t i = 0; i < values.size(); i += 2) {
    longest = std::max(longest, fmt::format("{:.6g}", values[i]).size());
  }
  longest = std::min(longest, tool.bambu ? kMostCharacters + 1 : kMostCharacters);
  const auto cut = [&](double value) {
    const auto digits =
        static_cast<int>(value >= 1000 ? longest : std::max<std::size_t>(2, longest) - 1);
    return CutLabel(value, digits, longest);
  };
  for (std::size_t i = 0; i < values.size(); i += 2) labels.push_back(cut(values[i]));
  if (tool.bambu) return labels;
  // At positions n + 2 and n + 4, n the count of candidates; the others remain empty.
  labels.resize((values.size() + 4) / 2 + 1);
  labels[(values.size() + 2) / 2] = cut(o.fast_mm_s * area_mm2 * o.flow_ratio);
  labels[(values.size() + 4) / 2] = cut(o.acceleration_mm_s2);
  return labels;
}

Chevrons LayChevrons(const PatternOptions& o, const ChevronTool& tool,
                     std::span<const double> values) {
  Chevrons lay;
  lay.wall_mm = 1.125 * o.nozzle_mm;
  lay.frame_wall_mm = 1.4 * o.nozzle_mm;
  lay.wall_step_mm = BeadDistance(lay.wall_mm, o.layer_mm) * std::numbers::sqrt2;
  const double across_mm = (o.walls - 1) * lay.wall_step_mm;
  lay.pitch_mm = across_mm + lay.wall_mm + o.spacing_mm;
  const double loop_step = BeadDistance(lay.frame_wall_mm, o.first_layer_mm);
  const double shift = (tool.loops - 1) * loop_step + lay.frame_wall_mm + 1;
  const double width = static_cast<double>(values.size() - 1) * lay.pitch_mm + across_mm +
                       kArmReachMm + 3 * loop_step + shift;
  if (o.numbers) {
    lay.labels = LabelsOf(o, tool, values, BeadArea(lay.wall_mm, o.layer_mm));
  }
  double text = 0;
  for (const std::string& label : lay.labels)
    text = std::max(text, GlyphsLength(label, tool.glyphs));
  const double tab_height = o.numbers ? text + kLabelMarginMm : 0;
  lay.frame.left_mm = (o.bed_x_mm - width) / 2;
  lay.frame.right_mm = lay.frame.left_mm + width;
  lay.frame.bottom_mm = (o.bed_y_mm - 2 * kArmReachMm - tab_height) / 2;
  lay.frame.top_mm = lay.frame.bottom_mm + 2 * kArmReachMm;
  lay.first_x_mm = lay.frame.left_mm + shift;
  const double last_label =
      lay.first_x_mm + lay.pitch_mm * static_cast<double>((values.size() - 1) / 2 * 2);
  const bool whole = tool.orca && !tool.bambu;
  lay.tab = {lay.frame.left_mm, lay.frame.top_mm + loop_step,
             whole ? lay.frame.right_mm : last_label + across_mm / 2 + 2 + 1.5 * lay.frame_wall_mm,
             lay.frame.top_mm + loop_step + tab_height};
  return lay;
}

void WriteEllisHeader(const PatternOptions& o, std::span<const double> values,
                      PatternSketch& sketch) {
  sketch.Line("; ### Ellis' Pressure Advance / Linear Advance Calibration Tool ###");
  sketch.Line("; ---------------------------------------------------------------");
  sketch.Line("; Printer:");
  std::string list;
  for (const double value : values) list += (list.empty() ? "" : ", ") + RoundLabel(value, 4);
  for (const std::string& line :
       {fmt::format("Bed Size X: {:g}", o.bed_x_mm), fmt::format("Bed Size Y: {:g}", o.bed_y_mm),
        fmt::format("Nozzle Diameter: {:g}", o.nozzle_mm),
        fmt::format("Layer Height: {:g}", o.layer_mm),
        fmt::format("First Layer Height: {:g}", o.first_layer_mm),
        fmt::format("First Layer Printing Speed: {:.0f} mm/min", 60 * o.first_layer_mm_s),
        fmt::format("Printing Speed: {:.0f} mm/min", 60 * o.fast_mm_s),
        fmt::format("Acceleration: {:.0f} mm/s^2", o.acceleration_mm_s2),
        fmt::format("Line Width: {:g} mm", 1.125 * o.nozzle_mm),
        fmt::format("Pattern Spacing: {:g} mm", o.spacing_mm),
        fmt::format("Wall Count: {}", o.walls), fmt::format("Number of Layers: {}", o.layers),
        fmt::format("Side Length: {:g} mm", kArmMm), std::string("Corner Angle: 90 degrees"),
        fmt::format("Start: {:g}", o.start_s), fmt::format("End: {:g}", o.end_s),
        fmt::format("Increment: {:g}", o.step_s), std::string("Increment Smooth Time: false"),
        "Values: " + list}) {
    sketch.Line(";  - " + line);
  }
}

void DrawCube(const PatternOptions& o, const ChevronTool& tool, const Chevrons& lay, double height,
              double feed, PatternSketch& sketch) {
  const double inside =
      3 * BeadDistance(lay.frame_wall_mm, o.first_layer_mm) + 1.2;  // right of the left bar
  const double middle = (lay.frame.bottom_mm + lay.frame.top_mm) / 2;
  const PatternBox box =
      tool.bambu ? PatternBox{lay.frame.left_mm, lay.frame.bottom_mm - 2 - kCubeMm,
                              lay.frame.left_mm + kCubeMm, lay.frame.bottom_mm - 2}
                 : PatternBox{lay.frame.left_mm + inside, middle - kCubeMm / 2,
                              lay.frame.left_mm + inside + kCubeMm, middle + kCubeMm / 2};
  const double half = lay.wall_mm / 2;
  DrawFilledBox(sketch,
                {box.left_mm + half, box.bottom_mm + half, box.right_mm - half, box.top_mm - half},
                {lay.wall_mm, height, feed});
}

void DrawWalls(const PatternOptions& o, const ChevronTool& tool, const Chevrons& lay,
               std::span<const double> values, int layer, PatternSketch& sketch) {
  const bool first = layer == 0;
  const double shorter = first ? tool.shorter_mm * o.nozzle_mm / 0.4 / std::numbers::sqrt2 : 0;
  const double height = first ? o.first_layer_mm : o.layer_mm;
  const double area = BeadArea(lay.wall_mm, height);
  const double feed = first ? o.first_layer_mm_s : o.fast_mm_s;
  const double middle = lay.frame.bottom_mm + kArmReachMm;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sketch.SetAdvance(values[i]);
    for (int wall = 0; wall < o.walls; ++wall) {
      const double x =
          lay.first_x_mm + lay.pitch_mm * static_cast<double>(i) + wall * lay.wall_step_mm;
      sketch.TravelTo({x + shorter, lay.frame.bottom_mm + shorter});
      sketch.Remark("Print pattern wall");
      sketch.ExtrudeTo({x + kArmReachMm, middle}, area, feed);
      sketch.ExtrudeTo({x + shorter, lay.frame.top_mm - shorter}, area, feed);
    }
  }
}

void DrawLabels(const PatternOptions& o, const ChevronTool& tool, const Chevrons& lay,
                PatternSketch& sketch) {
  constexpr double kGlyphHalfMm = 2;
  constexpr double kOrcaAsideMm = 0.29;
  const double middle = (o.walls - 1) * lay.wall_step_mm / 2 + (tool.orca ? kOrcaAsideMm : 0);
  for (std::size_t k = 0; k < lay.labels.size(); ++k) {
    const double x = lay.first_x_mm + 2 * lay.pitch_mm * static_cast<double>(k) + middle;
    DrawGlyphs(sketch, lay.labels[k], {x + kGlyphHalfMm, lay.tab.bottom_mm + kLabelMarginMm / 2},
               true, tool.glyphs, {lay.wall_mm, o.layer_mm, o.first_layer_mm_s});
  }
}

// Draws Orca's line along the left bar at its own acceleration, by which firmware is made to take
// note of the one that follows.
void DrawTrickLine(const PatternOptions& o, const Chevrons& lay, PatternSketch& sketch) {
  const double x = lay.frame.left_mm + BeadDistance(lay.frame_wall_mm, o.first_layer_mm);
  sketch.SetAcceleration(o.acceleration_mm_s2 - 1);
  sketch.TravelTo({x, lay.frame.bottom_mm + 1});
  sketch.ExtrudeTo({x, lay.frame.top_mm - 1}, BeadArea(lay.wall_mm, o.layer_mm), o.fast_mm_s);
  sketch.SetAcceleration(o.acceleration_mm_s2);
}

void DrawLayer(const PatternOptions& o, const ChevronTool& tool, const Chevrons& lay,
               std::span<const double> values, int layer, PatternSketch& sketch) {
  if (tool.orca) {
    sketch.Line(fmt::format("; start pressure advance pattern for layer {}", layer + 1));
  }
  sketch.SetAdvance(values.front());
  if (layer == 0) {
    const PatternPen pen{lay.frame_wall_mm, o.first_layer_mm, o.first_layer_mm_s};
    DrawLoops(sketch, lay.frame, tool.loops, pen);
    if (o.numbers) DrawFilledBox(sketch, lay.tab, pen);
  } else if (layer == 1) {
    DrawLabels(o, tool, lay, sketch);
  }
  if (tool.orca) {
    if (layer > 0) DrawTrickLine(o, lay, sketch);
    DrawCube(o, tool, lay, layer == 0 ? o.first_layer_mm : o.layer_mm,
             layer == 0 ? o.first_layer_mm_s : 2 * o.first_layer_mm_s, sketch);
  }
  DrawWalls(o, tool, lay, values, layer, sketch);
  if (tool.orca) sketch.Line("; end pressure advance pattern for layer");
}

// One of several patterns on a plate.
struct PlacedChevrons {
  PatternOptions options;
  Chevrons lay;
};

void Shift(PatternBox& box, double x_mm, double y_mm) {
  box = {box.left_mm + x_mm, box.bottom_mm + y_mm, box.right_mm + x_mm, box.top_mm + y_mm};
}

// Returns one pattern for each speed and acceleration, speeds fastest, in rows about the bed's
// middle, and their outline. The tool's own arranger is a general one: its places are others.
std::vector<PlacedChevrons> Arrange(const PatternOptions& options, const ChevronTool& tool,
                                    std::span<const double> values, PatternBox& all) {
  constexpr double kApartMm = 5;
  std::vector<PlacedChevrons> placed;
  PatternBox box;  // of the largest
  for (const double acceleration : options.accelerations_mm_s2) {
    for (const double speed : options.speeds_mm_s) {
      PatternOptions o = options;
      o.fast_mm_s = speed;
      o.acceleration_mm_s2 = acceleration;
      placed.push_back({o, LayChevrons(o, tool, values)});
      const Chevrons& lay = placed.back().lay;
      box.right_mm = std::max(box.right_mm, lay.frame.right_mm - lay.frame.left_mm);
      box.top_mm = std::max(box.top_mm, lay.tab.top_mm - lay.frame.bottom_mm);
    }
  }
  const std::size_t columns = options.speeds_mm_s.size();
  const std::size_t rows = options.accelerations_mm_s2.size();
  const double pitch_x = box.right_mm + kApartMm;
  const double pitch_y = box.top_mm + kApartMm;
  all.left_mm = (options.bed_x_mm - static_cast<double>(columns) * pitch_x + kApartMm) / 2;
  all.bottom_mm = (options.bed_y_mm - static_cast<double>(rows) * pitch_y + kApartMm) / 2;
  all.right_mm = options.bed_x_mm - all.left_mm;
  all.top_mm = options.bed_y_mm - all.bottom_mm;
  for (std::size_t k = 0; k < placed.size(); ++k) {
    Chevrons& lay = placed[k].lay;
    const double x = all.left_mm + static_cast<double>(k % columns) * pitch_x - lay.frame.left_mm;
    const double y =
        all.bottom_mm + static_cast<double>(k / columns) * pitch_y - lay.frame.bottom_mm;
    lay.first_x_mm += x;
    Shift(lay.frame, x, y);
    Shift(lay.tab, x, y);
  }
  return placed;
}

}  // namespace

Result<void> DrawChevrons(const PatternOptions& o, std::span<const double> values,
                          PatternSketch& sketch) {
  const ChevronTool tool = ToolOf(o);
  const bool batch = o.kind == PatternKind::kOrcaBatch;
  std::vector<PlacedChevrons> patterns;
  PatternBox box;
  if (batch) {
    patterns = Arrange(o, tool, values, box);
  } else {
    patterns.push_back({o, LayChevrons(o, tool, values)});
    const Chevrons& lay = patterns[0].lay;
    box = {lay.frame.left_mm, lay.frame.bottom_mm - (tool.bambu ? 2 + kCubeMm : 0),
           lay.frame.right_mm, lay.tab.top_mm};
  }
  TRY(CheckOnBed(box, o));
  if (!tool.orca) WriteEllisHeader(o, values, sketch);
  sketch.Begin();
  sketch.SetAcceleration(o.acceleration_mm_s2);
  if (o.corner_mm_s > 0) sketch.SetCorner(o.corner_mm_s);
  if (o.firmware == PatternFirmware::kKlipper && o.smooth_time_s >= 0) {
    sketch.Line(fmt::format("SET_PRESSURE_ADVANCE SMOOTH_TIME={:g}", o.smooth_time_s));
  }
  for (int layer = 0; layer < o.layers; ++layer) {
    sketch.SetLayer(o.first_layer_mm + layer * o.layer_mm);
    for (const PlacedChevrons& pattern : patterns) {
      const std::string name =
          fmt::format("printing object pa_pattern_{:g}_{:g} id:0 copy 0", pattern.options.fast_mm_s,
                      pattern.options.acceleration_mm_s2);
      if (batch) {
        sketch.Line("; " + name);
        sketch.SetAcceleration(pattern.options.acceleration_mm_s2);
      }
      DrawLayer(pattern.options, tool, pattern.lay, values, layer, sketch);
      if (batch) sketch.Line("; stop " + name);
    }
  }
  sketch.SetAdvance(values.front());
  return {};
}

}  // namespace trammel::sim
