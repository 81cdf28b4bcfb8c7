#include "pressure_advance/setup/printed_mark.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "base/check.h"
#include "gcode/bead.h"
#include "gcode/dialect.h"
#include "settings/material.h"

namespace trammel::pressure_advance {
namespace {

using gcode::FormatNumber;

constexpr double kRunIn_mm = 20;        // 1 mm of filament: more than oozes while the bed heats
constexpr double kRunInBeside_mm = 25;  // outside of every picture of the mark
constexpr double kFastest_mm_s = 20;    // a first layer that sticks

double Speed_mm_s(const PatternConfig& config) {
  return std::min(kFastest_mm_s, config.frame_speed_mm_s);
}

bool OnBed(const PatternConfig& config, const MarkPlan& plan) {
  const double half = 0.5 * (plan.shape.side_mm + plan.shape.bead_mm);
  const auto inside = [&](double x, double y) {
    return settings::BedReach(config, x, y, config.bed_margin_mm) <= 1;
  };
  for (const double sx : {-1.0, 1.0}) {
    for (const double sy : {-1.0, 1.0}) {
      if (!inside(plan.x_mm + sx * half, plan.y_mm + sy * half)) return false;
    }
    if (!inside(plan.x_mm + sx * plan.run_in_half_mm, plan.run_in_y_mm)) return false;
  }
  return true;
}

class Writer {
 public:
  explicit Writer(const PatternConfig& config) : config_(config) {}
  void Line(std::string_view text) {
    out_ += text;
    out_ += '\n';
  }
  void Block(std::string_view text) {
    out_ += text;
    if (!text.empty() && text.back() != '\n') out_ += '\n';
  }
  // Lifts, moves there retracted, and lowers.
  void Travel(double from_x, double from_y, double x, double y) {
    Filament(-config_.retract_length_mm);
    Height(config_.layer_height_mm + config_.z_hop_mm);
    Go(from_x, from_y);
    Go(x, y);
    Height(config_.layer_height_mm);
    Filament(config_.retract_length_mm);
  }
  void Filament(double length_mm) {
    filament_ += length_mm;
    Line(fmt::format("G1 E{} F{}", FormatNumber(filament_, 5),
                     FormatNumber(60 * config_.retract_speed_mm_s, 2)));
  }
  void Bead(double x, double y) {
    const double length = std::hypot(x - x_, y - y_);
    filament_ += length * gcode::FilamentPerMm(config_.line_width_mm, config_.layer_height_mm,
                                               config_.filament_diameter_mm);
    Line(fmt::format("G1 X{} Y{} E{} F{}", FormatNumber(x, 3), FormatNumber(y, 3),
                     FormatNumber(filament_, 5), FormatNumber(60 * Speed_mm_s(config_), 2)));
    x_ = x, y_ = y;
  }
  void Height(double above_mm) {
    Line(fmt::format("G1 Z{} F{}", FormatNumber(config_.z_offset_mm + above_mm, 3),
                     FormatNumber(60 * config_.z_speed_mm_s, 2)));
  }
  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  void Go(double x, double y) {
    Line(fmt::format("G0 X{} Y{} F{}", FormatNumber(x, 3), FormatNumber(y, 3),
                     FormatNumber(60 * config_.travel_speed_mm_s, 2)));
    x_ = x, y_ = y;
  }
  const PatternConfig& config_;
  std::string out_;
  double filament_ = 0, x_ = 0, y_ = 0;  // E, absolute; the last place
};

void WriteSquare(const MarkPlan& plan, Writer& writer) {
  const double half = plan.shape.side_mm / 2;
  const double left = plan.x_mm - half, right = plan.x_mm + half;
  const double front = plan.y_mm - half, back = plan.y_mm + half;
  writer.Line("; run-in");
  writer.Travel(plan.x_mm - plan.run_in_half_mm, plan.run_in_y_mm + 1,
                plan.x_mm - plan.run_in_half_mm, plan.run_in_y_mm);
  writer.Bead(plan.x_mm + plan.run_in_half_mm, plan.run_in_y_mm);
  writer.Line(
      "; mark: the front side is reached from behind, the back side from the front, and so "
      "left and right");
  writer.Travel(left, front + 2, left, front);
  writer.Bead(right, front);
  writer.Bead(right, back);
  writer.Bead(left, back);
  writer.Bead(left, front);
}

}  // namespace

Result<MarkPlan> PlanMark(const PatternConfig& config, const MarkPlace& place, double camera_x_mm,
                          double camera_y_mm) {
  MarkPlan plan;
  plan.shape.bead_mm = config.line_width_mm;
  plan.run_in_half_mm = kRunIn_mm / 2;
  const double middle_x = config.bed_origin_x_mm + config.bed_size_x_mm / 2;
  const double middle_y = config.bed_origin_y_mm + config.bed_size_y_mm / 2;
  plan.x_mm = std::round(place.x_mm.value_or(middle_x + camera_x_mm / 2));
  plan.y_mm = std::round(place.y_mm.value_or(middle_y + camera_y_mm / 2));
  if (place.x_mm) plan.x_mm = *place.x_mm;
  if (place.y_mm) plan.y_mm = *place.y_mm;
  for (const double side : {-1.0, 1.0}) {
    plan.run_in_y_mm = plan.y_mm + side * kRunInBeside_mm;
    if (OnBed(config, plan)) return plan;
  }
  return Fail(
      fmt::format("the mark at ({:.1f}, {:.1f}) mm, with its run-in of {:.0f} mm at {:.0f} mm in "
                  "front of it or behind it, does not lie on the bed of {:.0f} x {:.0f} mm inside "
                  "its margin of {:.1f} mm: choose another place (--mark-at X,Y), or check "
                  "bed_size_x, bed_size_y, bed_origin_x and bed_origin_y of [printer]",
                  plan.x_mm, plan.y_mm, kRunIn_mm, kRunInBeside_mm, config.bed_size_x_mm,
                  config.bed_size_y_mm, config.bed_margin_mm),
      ErrorKind::kSafety);
}

std::string WriteMarkGcode(const MarkPlan& plan, const PatternConfig& config) {
  const double half = plan.shape.side_mm / 2;
  const double low_y = std::min(plan.run_in_y_mm, plan.y_mm - half);
  const double high_y = std::max(plan.run_in_y_mm, plan.y_mm + half);
  const auto known = settings::Placeholders(
      config, config,
      {config.layer_height_mm, config.line_width_mm, config.acceleration_mm_s2,
       plan.x_mm - plan.run_in_half_mm, low_y, plan.x_mm + plan.run_in_half_mm, high_y});
  const auto expand = [&known](const char* key, const std::string& text) {
    Result<std::string> expanded = gcode::ExpandPlaceholders(text, known);
    TRAMMEL_CHECK(expanded.has_value(), "{}: {}", key, expanded.error().message);
    return *std::move(expanded);
  };
  Writer writer(config);
  writer.Line("; trammel: mark for the camera");
  writer.Line("; heated to " + settings::DescribeTemperatures(config));
  writer.Block(expand("start_gcode", config.start_gcode));
  for (const std::string& line : settings::HeatBehind(config.start_gcode, config)) {
    writer.Line(line);
  }
  for (const std::string& line : gcode::SaveStateCommands(config.dialect)) writer.Line(line);
  for (const char* line : {"G21", "G90", "M82", "M220 S100", "M221 S100", "G92 E0", "M107"}) {
    writer.Line(line);
  }
  writer.Height(config.layer_height_mm + config.park_lift_mm);
  WriteSquare(plan, writer);
  writer.Filament(-config.retract_length_mm);
  writer.Height(config.layer_height_mm + config.park_lift_mm);
  writer.Line(gcode::WaitForMovesCommand());
  for (const std::string& line : gcode::RestoreStateCommands(config.dialect)) writer.Line(line);
  writer.Block(expand("idle_gcode", config.idle_gcode));
  return writer.Take();
}

double MarkTime_s(const MarkPlan& plan, const PatternConfig& config) {
  const double beads_mm = 4 * plan.shape.side_mm + 2 * plan.run_in_half_mm;
  constexpr double kTravels_s = 10;
  return beads_mm / Speed_mm_s(config) + 3 * config.park_lift_mm / config.z_speed_mm_s + kTravels_s;
}

}  // namespace trammel::pressure_advance
