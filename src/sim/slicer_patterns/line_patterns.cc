#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "sim/slicer_patterns/pattern_writers.h"

namespace trammel::sim {
namespace {

constexpr double kSlowPartMm = 20;
constexpr double kFastPartMm = 40;

void SetMotion(const PatternOptions& options, PatternSketch& sketch) {
  sketch.SetAcceleration(options.acceleration_mm_s2);
  if (options.corner_mm_s > 0) sketch.SetCorner(options.corner_mm_s);
  if (options.firmware == PatternFirmware::kKlipper && options.smooth_time_s >= 0) {
    sketch.Line(fmt::format("SET_PRESSURE_ADVANCE SMOOTH_TIME={:g}", options.smooth_time_s));
  }
}

// OrcaSlicer's layout; x of the lines' starts, y of the first line.
struct OrcaLines {
  double pitch_mm = 3.5;
  double fast_mm = kFastPartMm;
  double start_x_mm = 0;
  double end_x_mm = 0;
  double first_y_mm = 0;
  double last_y_mm = 0;
  double bead_mm = 0.6;
  PatternBox tab;  // or the numbers' place
  double numbers_x_mm = 0;
};

constexpr double kTabMm = 24;
constexpr double kNumbersInTabMm = 4;
constexpr double kFreeNumbersMm = 3;  // right of free ends
constexpr double kGlyphHeightMm = 4;
constexpr double kNumbersBelowMm = 0.25;

OrcaLines LayOrcaLines(const PatternOptions& o, std::size_t count) {
  OrcaLines lay;
  if (o.bed_x_mm < 120) lay.fast_mm += o.bed_x_mm - 120;
  lay.bead_mm = (o.nozzle_mm < 0.51 ? 1.5 : 1.05) * o.nozzle_mm;
  const double length = 2 * kSlowPartMm + lay.fast_mm;
  const double beside = !o.numbers ? 0 : o.bars > 0 ? kTabMm + lay.bead_mm : 18;
  lay.start_x_mm = (o.bed_x_mm - length - beside) / 2;
  lay.end_x_mm = lay.start_x_mm + length;
  const double tall = lay.pitch_mm * static_cast<double>(count - 1);
  lay.first_y_mm = (o.bed_y_mm - tall) / 2;
  lay.last_y_mm = lay.first_y_mm + tall;
  const double tab_x = lay.end_x_mm + (o.bars == 2 ? lay.bead_mm : 0);
  lay.tab = {tab_x, lay.first_y_mm - lay.pitch_mm, tab_x + kTabMm, lay.last_y_mm + lay.pitch_mm};
  lay.numbers_x_mm = o.bars > 0 ? tab_x + kNumbersInTabMm : lay.end_x_mm + kFreeNumbersMm;
  return lay;
}

void DrawOrcaBar(PatternSketch& sketch, double x_mm, double from_y_mm, double to_y_mm,
                 double area_mm2, double feed_mm_s) {
  constexpr double kBarFlow = 1.2;
  sketch.TravelTo({x_mm, from_y_mm});
  sketch.ExtrudeTo({x_mm, to_y_mm}, kBarFlow * area_mm2, feed_mm_s);
}

void DrawOrcaNumbers(const PatternOptions& o, std::span<const double> values, const OrcaLines& lay,
                     const PatternPen& pen, PatternSketch& sketch) {
  constexpr int kDigits = 4;
  constexpr std::size_t kCharacters = 5;
  const std::size_t characters = o.firmware == PatternFirmware::kBambu ? 6 : kCharacters;
  for (std::size_t i = 0; i < values.size(); i += 2) {
    const double y = lay.first_y_mm + lay.pitch_mm * static_cast<double>(i);
    DrawGlyphs(sketch, CutLabel(values[i], kDigits, characters),
               {lay.numbers_x_mm, y - kNumbersBelowMm - kGlyphHeightMm / 2}, false, {}, pen);
  }
}

// Draws the bar that primes the nozzle; the oldest version has it left of the lines.
void DrawOrcaPrime(const PatternOptions& o, const OrcaLines& lay, double area,
                   PatternSketch& sketch) {
  if (o.bars > 0) {
    DrawOrcaBar(sketch, lay.start_x_mm, lay.last_y_mm + lay.pitch_mm, lay.first_y_mm, area,
                o.first_layer_mm_s);
    return;
  }
  constexpr double kBesideMm = 2;
  DrawOrcaBar(sketch, lay.start_x_mm - kBesideMm, lay.last_y_mm + 4 * lay.pitch_mm,
              lay.first_y_mm - 3 * lay.pitch_mm, area, o.first_layer_mm_s);
}

}  // namespace

Result<void> DrawOrcaLines(const PatternOptions& o, std::span<const double> values,
                           PatternSketch& sketch) {
  const OrcaLines lay = LayOrcaLines(o, values.size());
  TRY(CheckOnBed({lay.start_x_mm, lay.first_y_mm - lay.pitch_mm,
                  o.numbers ? std::max(lay.tab.right_mm, lay.end_x_mm) : lay.end_x_mm,
                  lay.last_y_mm + lay.pitch_mm},
                 o));
  const double area = BeadArea(lay.bead_mm, o.first_layer_mm);
  sketch.Begin();
  SetMotion(o, sketch);
  sketch.SetLayer(o.first_layer_mm);
  sketch.Line("; start pressure advance pattern for layer");
  if (o.bars == 2) sketch.SetAdvance(0);
  const PatternPen pen{lay.bead_mm, o.first_layer_mm, o.first_layer_mm_s};
  if (o.numbers && o.bars > 0) DrawFilledBox(sketch, lay.tab, pen);
  DrawOrcaPrime(o, lay, area, sketch);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double y = lay.first_y_mm + lay.pitch_mm * static_cast<double>(i);
    sketch.SetAdvance(values[i]);
    sketch.TravelTo({lay.start_x_mm, y});
    sketch.ExtrudeTo({lay.start_x_mm + kSlowPartMm, y}, area, o.slow_mm_s);
    sketch.ExtrudeTo({lay.end_x_mm - kSlowPartMm, y}, area, o.fast_mm_s);
    sketch.ExtrudeTo({lay.end_x_mm, y}, area, o.slow_mm_s);
    if (i == 0 && o.bars == 2) {
      sketch.SetAdvance(0);
      DrawOrcaBar(sketch, lay.end_x_mm, lay.first_y_mm, lay.last_y_mm + lay.pitch_mm, area,
                  o.first_layer_mm_s);
    }
  }
  sketch.SetAdvance(0);
  if (o.bars == 0) {
    constexpr double kTickFromMm = 2;
    constexpr double kTickMm = 5;
    for (const double x : {lay.start_x_mm + kSlowPartMm, lay.end_x_mm - kSlowPartMm}) {
      sketch.TravelTo({x, lay.last_y_mm + kTickFromMm});
      sketch.ExtrudeTo({x, lay.last_y_mm + kTickFromMm + kTickMm}, area, o.first_layer_mm_s);
    }
  }
  if (o.numbers) {
    const bool on_tab = o.bars > 0;
    if (on_tab) sketch.SetLayer(o.first_layer_mm + o.layer_mm);
    DrawOrcaNumbers(
        o, values, lay,
        {1.125 * o.nozzle_mm, on_tab ? o.layer_mm : o.first_layer_mm, o.first_layer_mm_s}, sketch);
  }
  sketch.Line("; end pressure advance pattern for layer");
  return {};
}

namespace {

constexpr double kMarlinPitchMm = 5;
constexpr double kMarlinBeadInNozzles = 1.2;
constexpr double kMarlinOverMm = 3;  // bars beyond the first and the last planned line

struct MarlinLines {
  double start_x_mm = 0;
  double end_x_mm = 0;
  double first_y_mm = 0;
  double last_y_mm = 0;  // of the plan: one step more than printed where the sum of steps misses it
  double bead_mm = 0.48;
  double area_mm2 = 0.096;
};

void WriteMarlinHeader(const PatternOptions& o, PatternSketch& sketch) {
  sketch.Line(o.firmware == PatternFirmware::kKlipper
                  ? "; ### Klipper Pressure Advance Calibration Pattern ###"
                  : "; ### Marlin K-Factor Calibration Pattern ###");
  sketch.Line("; -------------------------------------------");
  for (const std::string& line :
       {fmt::format("Nozzle Diameter = {:g}", o.nozzle_mm),
        fmt::format("Nozzle Temperature = {:.0f} C", o.nozzle_c),
        fmt::format("Bed Temperature = {:.0f} C", o.plate_c),
        fmt::format("Slow Printing Speed = {:.0f} mm/min", 60 * o.slow_mm_s),
        fmt::format("Fast Printing Speed = {:.0f} mm/min", 60 * o.fast_mm_s),
        fmt::format("Acceleration = {:.0f} mm/s^2", o.acceleration_mm_s2),
        fmt::format("Starting Value Factor = {:g}", o.start_s),
        fmt::format("Ending Value Factor = {:g}", o.end_s),
        fmt::format("Factor Stepping = {:g}", o.step_s),
        fmt::format("Bed Shape = {}", o.round_bed ? "Round" : "Rect"),
        fmt::format("Print Size X = {:g} mm", o.bed_x_mm),
        fmt::format("Layer Height = {:g}", o.first_layer_mm),
        fmt::format("Printing Direction = {} degree", o.rotation_deg),
        fmt::format("Line Spacing = {:g} mm", kMarlinPitchMm),
        fmt::format("Print Frame = {}", o.frame && !o.alternate)}) {
    sketch.Line("; " + line);
  }
}

// Draws two beads, the second one beside the first by `beside_mm`, up and down.
void DrawDoubleBar(PatternSketch& sketch, double x_mm, double beside_mm, const MarlinLines& lay,
                   double flow, double feed_mm_s) {
  const double bottom = lay.first_y_mm - kMarlinOverMm;
  const double top = lay.last_y_mm + kMarlinOverMm;
  sketch.TravelTo({x_mm, bottom});
  sketch.ExtrudeTo({x_mm, top}, flow * lay.area_mm2, feed_mm_s);
  sketch.TravelTo({x_mm + beside_mm, top}, false);
  sketch.ExtrudeTo({x_mm + beside_mm, bottom}, flow * lay.area_mm2, feed_mm_s);
}

void DrawMarlinLine(const PatternOptions& o, const MarlinLines& lay, double y, bool backwards,
                    PatternSketch& sketch) {
  const double sign = backwards ? -1 : 1;
  const double from = backwards ? lay.end_x_mm : lay.start_x_mm;
  sketch.ExtrudeTo({from + sign * kSlowPartMm, y}, lay.area_mm2, o.slow_mm_s);
  sketch.ExtrudeTo({from + sign * (kSlowPartMm + kFastPartMm), y}, lay.area_mm2, o.fast_mm_s);
  sketch.ExtrudeTo({from + sign * (2 * kSlowPartMm + kFastPartMm), y}, lay.area_mm2, o.slow_mm_s);
}

void DrawMarlinMarks(const PatternOptions& o, const MarlinLines& lay, PatternSketch& sketch) {
  constexpr double kMarkFromMm = 5;
  constexpr double kMarkMm = 20;
  for (const double x : {lay.start_x_mm + kSlowPartMm, lay.end_x_mm - kSlowPartMm}) {
    sketch.TravelTo({x, lay.last_y_mm + kMarkFromMm});
    sketch.ExtrudeTo({x, lay.last_y_mm + kMarkFromMm + kMarkMm}, lay.area_mm2, o.slow_mm_s);
  }
}

MarlinLines LayMarlinLines(const PatternOptions& o, const PatternPoint& centre) {
  MarlinLines lay;
  lay.bead_mm = kMarlinBeadInNozzles * o.nozzle_mm;
  lay.area_mm2 = lay.bead_mm * o.first_layer_mm;
  const double length = 2 * kSlowPartMm + kFastPartMm;
  lay.start_x_mm = centre.x_mm - length / 2;
  lay.end_x_mm = lay.start_x_mm + length;
  const double planned = std::round((o.end_s - o.start_s) / o.step_s);
  constexpr double kMarksMm = 25;
  lay.first_y_mm = centre.y_mm - (planned * kMarlinPitchMm + kMarksMm) / 2;
  lay.last_y_mm = lay.first_y_mm + planned * kMarlinPitchMm;
  return lay;
}

}  // namespace

Result<void> DrawMarlinLines(const PatternOptions& o, std::span<const double> values,
                             PatternSketch& sketch) {
  const PatternPoint centre =
      o.round_bed ? PatternPoint{} : PatternPoint{o.bed_x_mm / 2, o.bed_y_mm / 2};
  const MarlinLines lay = LayMarlinLines(o, centre);
  const double half_x = 42 + (o.prime ? 10 : 0) + (o.numbers ? 15 : 0);
  const double half_y = centre.y_mm - lay.first_y_mm + kMarlinOverMm;
  const double angle = o.rotation_deg * std::numbers::pi / 180;
  const double c = std::abs(std::cos(angle));
  const double s = std::abs(std::sin(angle));
  TRY(CheckOnBed({centre.x_mm - c * half_x - s * half_y, centre.y_mm - s * half_x - c * half_y,
                  centre.x_mm + c * half_x + s * half_y, centre.y_mm + s * half_x + c * half_y},
                 o));
  WriteMarlinHeader(o, sketch);
  sketch.Begin();
  SetMotion(o, sketch);
  sketch.SetLayer(o.first_layer_mm);
  sketch.Turn(angle, centre);
  sketch.SetAdvance(0);
  if (o.prime) {
    constexpr double kPrimeFlow = 2.5;
    constexpr double kPrimeBesideMm = 10;
    DrawDoubleBar(sketch, lay.start_x_mm - kPrimeBesideMm, 1.5 * lay.bead_mm, lay, kPrimeFlow,
                  o.slow_mm_s);
  }
  if (o.frame && !o.alternate) {
    constexpr double kFrameFlow = 1.1;
    DrawDoubleBar(sketch, lay.start_x_mm, lay.bead_mm, lay, kFrameFlow, o.slow_mm_s);
    DrawDoubleBar(sketch, lay.end_x_mm, -lay.bead_mm, lay, kFrameFlow, o.slow_mm_s);
  }
  sketch.Line("; print the test lines");
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double y = lay.first_y_mm + kMarlinPitchMm * static_cast<double>(i);
    const bool backwards = o.alternate && i % 2 == 1;
    const double x = backwards ? lay.end_x_mm : lay.start_x_mm;
    sketch.SetAdvance(values[i]);
    if (o.alternate && i > 0) {
      sketch.ExtrudeTo({x, y}, lay.area_mm2, o.fast_mm_s);
    } else {
      sketch.TravelTo({x, y});
    }
    DrawMarlinLine(o, lay, y, backwards, sketch);
  }
  sketch.SetAdvance(0);
  DrawMarlinMarks(o, lay, sketch);
  if (!o.numbers) return {};
  const bool klipper = o.firmware == PatternFirmware::kKlipper;
  const GlyphStyle style{true, true, !klipper, klipper ? 0.75 : 0.4};
  for (std::size_t i = 0; i < values.size(); i += 2) {
    const double y = lay.first_y_mm + kMarlinPitchMm * static_cast<double>(i);
    DrawGlyphs(sketch, RoundLabel(values[i], klipper ? 4 : 3), {lay.end_x_mm + 2, y - 2}, false,
               style, {lay.bead_mm, o.first_layer_mm, o.slow_mm_s});
  }
  return {};
}

}  // namespace trammel::sim
