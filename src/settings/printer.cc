#include "settings/printer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "gcode/dialect.h"
#include "settings/material.h"

namespace trammel::settings {
namespace {

using P = PrinterSettings;
using F = FilamentSettings;

constexpr std::string_view kPrinter = "printer";
constexpr std::string_view kFilament = "filament";

constexpr auto kPrinterFields = std::to_array<PrinterField>({
    {kPrinter, "dialect", &P::dialect, "", 0, 0,
     "Firmware: klipper, marlin, reprapfirmware, prusa (Buddy) or bambu. Sets start_gcode and "
     "end_gcode, where they are left out."},
    {kPrinter, "bed_size_x", &P::bed_size_x_mm, "mm", 10, 2000,
     "Width of the bed. Where size and origin are all left out and the nozzle does not reach the "
     "default: what it reaches."},
    {kPrinter, "bed_size_y", &P::bed_size_y_mm, "mm", 10, 2000, "Depth of the bed."},
    {kPrinter, "bed_origin_x", &P::bed_origin_x_mm, "mm", -2000, 2000,
     "X of the bed's left edge: -125 where a 250 mm bed has (0, 0) in its middle."},
    {kPrinter, "bed_origin_y", &P::bed_origin_y_mm, "mm", -2000, 2000,
     "Y of the bed's front edge."},
    {kPrinter, "bed_shape", &P::bed_shape, "", 0, 0,
     "rectangle, or ellipse: round beds as of deltas, inscribed in the bed's size. Left out: by "
     "the "
     "printer's kinematics, where it states one."},
    {kPrinter, "bed_margin", &P::bed_margin_mm, "mm", 0, 100,
     "Kept free of filament along the bed's edge."},
    {kPrinter, "nozzle_diameter", &P::nozzle_diameter_mm, "mm", 0.1, 2,
     "Bore of the nozzle. Left out: the printer's own, where it states one."},
    {kPrinter, "travel_speed", &P::travel_speed_mm_s, "mm/s", 1, 1000,
     "Speed of moves without filament."},
    {kPrinter, "z_speed", &P::z_speed_mm_s, "mm/s", 0.1, 100, "Speed of moves in z."},
    {kPrinter, "retract_length", &P::retract_length_mm, "mm", 0, 20,
     "Filament drawn back before a travel: about 0.5 with a direct drive, 2 to 6 with a Bowden "
     "tube."},
    {kPrinter, "retract_speed", &P::retract_speed_mm_s, "mm/s", 0.1, 200,
     "Speed of the filament when it is drawn back or pushed alone."},
    {kPrinter, "z_hop", &P::z_hop_mm, "mm", 0, 10, "How far the nozzle rises before a travel."},
    {kPrinter, "z_offset", &P::z_offset_mm, "mm", -0.5, 2,
     "Added to the height of the layer; at most half a layer downwards."},
    {kPrinter, "park_x", &P::park_x_mm, "mm", -2000, 2000,
     "Where the nozzle waits when done. Left out: bed_margin from the left edge, or the middle of "
     "a round bed and of dialect bambu."},
    {kPrinter, "park_y", &P::park_y_mm, "mm", -2000, 2000,
     "Where the nozzle waits when done. Left out: bed_margin from the front edge."},
    {kPrinter, "park_lift", &P::park_lift_mm, "mm", 1, 200,
     "Height above the layer before the first travel and when done; clears clips and the pattern."},
    {kPrinter, "start_gcode", &P::start_gcode, "", 0, 0,
     "Heats, homes, levels; may be just a macro call. {placeholders} stand for values. A "
     "temperature "
     "that it does not name by its placeholder is set behind it."},
    {kPrinter, "end_gcode", &P::end_gcode, "", 0, 0,
     "Ends the print; has to switch the heaters off."},
    {kPrinter, "restore_acceleration", &P::restore_acceleration_mm_s2, "mm/s²", 1, 1e6,
     "Acceleration set at the end. Left out: the pattern's stays."},
});

constexpr auto kFilamentFields = std::to_array<FilamentField>({
    {kFilament, "material", &F::material, "", 0, 0,
     "pla, petg, abs, asa, tpu, pc or pa: gives both temperatures and the density, where they are "
     "not set. Empty: nothing is printed unless both temperatures are set."},
    {kFilament, "filament_diameter", &F::filament_diameter_mm, "mm", 1, 4,
     "Diameter of the filament. Left out: the printer's own, where it states one."},
    {kFilament, "density", &F::filament_density_g_cm3, "g/cm³", 0.5, 10,
     "Only for the weight that is shown. Left out: the material's."},
    {kFilament, "nozzle_temperature", &F::nozzle_temperature_c, "°C", 170, 500,
     "Temperature while printing. Left out: the material's."},
    {kFilament, "idle_nozzle_temperature", &F::idle_nozzle_temperature_c, "°C", 0, 500,
     "While the bed heats and while waiting for a scan: hot enough to be quick, too cold to ooze; "
     "0 switches off. Left out: 60 below nozzle_temperature."},
    {kFilament, "bed_temperature", &F::bed_temperature_c, "°C", 0, 200,
     "Temperature of the bed; 0: it stays off. Left out: the material's."},
});

SettingProblem InPrinter(std::string key, std::string message) {
  return {std::string(kPrinter), std::move(key), std::move(message)};
}

}  // namespace

std::string_view ToString(BedShape shape) {
  return shape == BedShape::kEllipse ? "ellipse" : "rectangle";
}

std::optional<BedShape> ParseBedShape(std::string_view name) {
  for (BedShape shape : {BedShape::kRectangle, BedShape::kEllipse}) {
    if (ToString(shape) == name) return shape;
  }
  return std::nullopt;
}

std::span<const PrinterField> PrinterFields() { return kPrinterFields; }
std::span<const FilamentField> FilamentFields() { return kFilamentFields; }

double BedReach(const PrinterSettings& printer, double x_mm, double y_mm, double margin_mm) {
  const double half_x_mm = printer.bed_size_x_mm / 2;
  const double half_y_mm = printer.bed_size_y_mm / 2;
  // Nothing remains of such a bed.
  if (half_x_mm <= margin_mm || half_y_mm <= margin_mm) {
    return std::numeric_limits<double>::infinity();
  }
  const double x = (x_mm - printer.bed_origin_x_mm - half_x_mm) / (half_x_mm - margin_mm);
  const double y = (y_mm - printer.bed_origin_y_mm - half_y_mm) / (half_y_mm - margin_mm);
  return printer.bed_shape == BedShape::kEllipse ? std::hypot(x, y)
                                                 : std::max(std::abs(x), std::abs(y));
}

ParkPosition ParkPositionOf(const PrinterSettings& printer) {
  const bool corner = printer.bed_shape == BedShape::kRectangle &&
                      !gcode::WordsOf(printer.dialect).cutter_in_corner;
  const double default_x_mm =
      printer.bed_origin_x_mm + (corner ? printer.bed_margin_mm : printer.bed_size_x_mm / 2);
  return {printer.park_x_mm.value_or(default_x_mm),
          printer.park_y_mm.value_or(printer.bed_origin_y_mm + printer.bed_margin_mm)};
}

std::optional<SettingProblem> FindParkProblem(const PrinterSettings& printer) {
  using Problem = std::optional<SettingProblem>;
  const ParkPosition park = ParkPositionOf(printer);
  const auto off = [](const char* key, double value, double lo, double size) -> Problem {
    if (value >= lo && value <= lo + size) return std::nullopt;
    return InPrinter(key, fmt::format("{} mm is off the bed, {} ... {} mm", value, lo, lo + size));
  };
  if (Problem problem = off("park_x", park.x_mm, printer.bed_origin_x_mm, printer.bed_size_x_mm)) {
    return problem;
  }
  if (Problem problem = off("park_y", park.y_mm, printer.bed_origin_y_mm, printer.bed_size_y_mm)) {
    return problem;
  }
  if (const double reach = BedReach(printer, park.x_mm, park.y_mm, 0);
      printer.bed_shape == BedShape::kEllipse && reach > 1) {
    return InPrinter("park_x",
                     fmt::format("parking at ({}, {}) mm is at {:.3f} of the round bed's radius; "
                                 "at most 1",
                                 park.x_mm, park.y_mm, reach));
  }
  return std::nullopt;
}

std::optional<SettingProblem> FindBeadProblem(const PrinterSettings& printer,
                                              std::string_view section, double layer_height_mm,
                                              double line_width_mm) {
  if (layer_height_mm > printer.nozzle_diameter_mm) {
    return SettingProblem{std::string(section), "layer_height",
                          fmt::format("{} mm is above nozzle_diameter = {} mm", layer_height_mm,
                                      printer.nozzle_diameter_mm)};
  }
  const double lo_mm = std::max(layer_height_mm, printer.nozzle_diameter_mm / 2);
  const double hi_mm = 3 * printer.nozzle_diameter_mm;
  if (line_width_mm < lo_mm || line_width_mm > hi_mm) {
    return SettingProblem{
        std::string(section), "line_width",
        fmt::format("{} mm is outside {} ... {} mm, what a {} mm nozzle lays at a layer "
                    "height of {} mm",
                    line_width_mm, lo_mm, hi_mm, printer.nozzle_diameter_mm, layer_height_mm)};
  }
  const double lowest_mm = -layer_height_mm / 2;
  if (printer.z_offset_mm < lowest_mm) {
    return InPrinter("z_offset", fmt::format("{} mm is below {} mm, half of layer_height: the "
                                             "nozzle would gouge the plate",
                                             printer.z_offset_mm, lowest_mm));
  }
  return std::nullopt;
}

std::vector<gcode::Placeholder> Placeholders(const PrinterSettings& printer,
                                             const FilamentSettings& filament,
                                             const Drawing& drawing) {
  const auto number = [](double value) { return gcode::FormatNumber(value, 4); };
  return {
      {"nozzle_temperature_c", number(NozzleTemperature_c(filament).value_or(0))},
      {"idle_nozzle_temperature_c", number(IdleNozzleTemperature_c(filament).value_or(0))},
      {"bed_temperature_c", number(BedTemperature_c(filament).value_or(0))},
      {"nozzle_diameter_mm", number(printer.nozzle_diameter_mm)},
      {"filament_diameter_mm", number(filament.filament_diameter_mm)},
      {"layer_height_mm", number(drawing.layer_height_mm)},
      {"line_width_mm", number(drawing.line_width_mm)},
      {"retract_length_mm", number(printer.retract_length_mm)},
      {"acceleration_mm_s2", number(drawing.acceleration_mm_s2)},
      {"min_x_mm", number(drawing.min_x_mm)},
      {"min_y_mm", number(drawing.min_y_mm)},
      {"max_x_mm", number(drawing.max_x_mm)},
      {"max_y_mm", number(drawing.max_y_mm)},
      {"size_x_mm", number(drawing.max_x_mm - drawing.min_x_mm)},
      {"size_y_mm", number(drawing.max_y_mm - drawing.min_y_mm)},
      {"bed_min_x_mm", number(printer.bed_origin_x_mm)},
      {"bed_min_y_mm", number(printer.bed_origin_y_mm)},
      {"bed_max_x_mm", number(printer.bed_origin_x_mm + printer.bed_size_x_mm)},
      {"bed_max_y_mm", number(printer.bed_origin_y_mm + printer.bed_size_y_mm)},
  };
}

}  // namespace trammel::settings
