#include "sim/slicer_patterns/pattern_sketch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include "base/check.h"

namespace trammel::sim {
namespace {

constexpr double kFilamentMm = 1.75;
constexpr double kFilamentMm2 = std::numbers::pi / 4 * kFilamentMm * kFilamentMm;
constexpr double kTravelMmS = 150;
constexpr double kRetractMmS = 35;
constexpr double kStrokeMm = 2;  // of a glyph

}  // namespace

double BeadArea(double width_mm, double height_mm) {
  return height_mm * BeadDistance(width_mm, height_mm);
}

double BeadDistance(double width_mm, double height_mm) {
  return width_mm - height_mm * (1 - std::numbers::pi / 4);
}

PatternSketch::PatternSketch(const PatternOptions& options, const SketchHabits& habits)
    : options_(options), habits_(habits) {}

void PatternSketch::Line(std::string_view text) {
  text_ += text;
  text_ += '\n';
}

void PatternSketch::Remark(std::string_view text) {
  if (options_.comments) Line(fmt::format("; {}", text));
}

void PatternSketch::Begin() {
  if (options_.firmware == PatternFirmware::kPrusa) Line("M862.3 P \"MK4\"");
  Line(fmt::format("M140 S{:.0f}", options_.plate_c));
  Line(fmt::format("M104 S{:.0f}", options_.nozzle_c));
  Line(fmt::format("M190 S{:.0f}", options_.plate_c));
  Line(fmt::format("M109 S{:.0f}", options_.nozzle_c));
  Line("G28");
  Line("G21");
  Line("G90");
  Line(options_.absolute_e ? "M82" : "M83");
  Line("G92 E0");
}

void PatternSketch::End() {
  std::string line = "G1";
  Filament(-habits_.retract_mm, line);
  Line(line + fmt::format(" F{:.0f}", kRetractMmS * 60));
  Line(fmt::format("G1 Z{:.3f} F600", z_mm_ + 20));
  Line("M104 S0");
  Line("M140 S0");
  Line("M84");
}

void PatternSketch::SetAcceleration(double mm_s2) {
  Line(options_.firmware == PatternFirmware::kKlipper
           ? fmt::format("SET_VELOCITY_LIMIT ACCEL={:.0f}", mm_s2)
       : options_.firmware == PatternFirmware::kRepRap ? fmt::format("M204 P{:.0f}", mm_s2)
                                                       : fmt::format("M204 S{:.0f}", mm_s2));
}

void PatternSketch::SetCorner(double mm_s) {
  Line(options_.firmware == PatternFirmware::kKlipper
           ? fmt::format("SET_VELOCITY_LIMIT SQUARE_CORNER_VELOCITY={:g}", mm_s)
       : options_.firmware == PatternFirmware::kRepRap
           ? fmt::format("M566 X{:g} Y{:g}", 60 * mm_s, 60 * mm_s)
           : fmt::format("M205 X{:g} Y{:g}", mm_s, mm_s));
}

void PatternSketch::SetAdvance(double seconds) {
  switch (options_.firmware) {
    case PatternFirmware::kKlipper:
      return Line(fmt::format("SET_PRESSURE_ADVANCE ADVANCE={:.6g}", seconds));
    case PatternFirmware::kMarlin:
      return Line(fmt::format("M900 K{:.6g}", seconds));
    case PatternFirmware::kRepRap:
      return Line(fmt::format("M572 D0 S{:.6g}", seconds));
    case PatternFirmware::kBambu:
      return Line(fmt::format("M900 K{:.6g} L1000 M10", seconds));
    case PatternFirmware::kPrusa: {
      const double smooth = options_.smooth_time_s;
      return Line(fmt::format("M572 S{:.6g}", seconds) +
                  (smooth >= 0 ? fmt::format(" W{:g}", smooth) : ""));
    }
  }
}

void PatternSketch::SetLayer(double z_mm) {
  z_mm_ = z_mm;
  Line(fmt::format("G1 Z{:.3f} F600", z_mm));
}

void PatternSketch::Turn(double angle_rad, const PatternPoint& about) {
  angle_rad_ = angle_rad;
  about_ = about;
}

PatternPoint PatternSketch::Turned(const PatternPoint& point) const {
  const double x = point.x_mm - about_.x_mm;
  const double y = point.y_mm - about_.y_mm;
  const double c = std::cos(angle_rad_);
  const double s = std::sin(angle_rad_);
  return {about_.x_mm + c * x - s * y, about_.y_mm + s * x + c * y};
}

void PatternSketch::Filament(double mm, std::string& line) {
  e_mm_ += mm;
  fmt::format_to(std::back_inserter(line), " E{:.5f}", options_.absolute_e ? e_mm_ : mm);
}

void PatternSketch::TravelTo(const PatternPoint& to, bool retracts) {
  const double length_mm = std::hypot(to.x_mm - place_.x_mm, to.y_mm - place_.y_mm);
  if (length_mm < 1e-6) return;
  const PatternPoint at = Turned(to);
  const bool retract = retracts && length_mm > habits_.retract_over_mm;
  if (retract) {
    std::string line = "G1";
    Filament(-habits_.retract_mm, line);
    Line(line + fmt::format(" F{:.0f}", kRetractMmS * 60));
    if (habits_.hop_mm > 0) Line(fmt::format("G1 Z{:.3f} F600", z_mm_ + habits_.hop_mm));
  }
  Line(fmt::format("G1 X{:.3f} Y{:.3f} F{:.0f}", at.x_mm, at.y_mm, kTravelMmS * 60));
  if (retract) {
    if (habits_.hop_mm > 0) Line(fmt::format("G1 Z{:.3f} F600", z_mm_));
    std::string line = "G1";
    Filament(habits_.retract_mm, line);
    Line(line + fmt::format(" F{:.0f}", kRetractMmS * 60));
  }
  place_ = to;
}

void PatternSketch::ExtrudeTo(const PatternPoint& to, double area_mm2, double feed_mm_s) {
  const double length_mm = std::hypot(to.x_mm - place_.x_mm, to.y_mm - place_.y_mm);
  TRAMMEL_CHECK(length_mm > 0 && area_mm2 > 0, "length = {}, area = {}", length_mm, area_mm2);
  const PatternPoint at = Turned(to);
  std::string line = fmt::format("G1 X{:.3f} Y{:.3f}", at.x_mm, at.y_mm);
  Filament(options_.flow_ratio * area_mm2 * length_mm / kFilamentMm2, line);
  Line(line + fmt::format(" F{:.0f}", feed_mm_s * 60));
  place_ = to;
}

void DrawLoops(PatternSketch& sketch, PatternBox box, int loops, const PatternPen& pen) {
  const double area = BeadArea(pen.width_mm, pen.height_mm);
  const double inset = BeadDistance(pen.width_mm, pen.height_mm);
  for (int loop = 0; loop < loops; ++loop) {
    sketch.TravelTo({box.left_mm, box.bottom_mm}, loop == 0);
    sketch.Remark("Draw perimeter (up)");
    sketch.ExtrudeTo({box.left_mm, box.top_mm}, area, pen.feed_mm_s);
    sketch.ExtrudeTo({box.right_mm, box.top_mm}, area, pen.feed_mm_s);
    sketch.ExtrudeTo({box.right_mm, box.bottom_mm}, area, pen.feed_mm_s);
    sketch.ExtrudeTo({box.left_mm, box.bottom_mm}, area, pen.feed_mm_s);
    box = {box.left_mm + inset, box.bottom_mm + inset, box.right_mm - inset, box.top_mm - inset};
  }
}

void DrawFilledBox(PatternSketch& sketch, const PatternBox& box, const PatternPen& pen) {
  const double area = BeadArea(pen.width_mm, pen.height_mm);
  const double distance = BeadDistance(pen.width_mm, pen.height_mm);
  constexpr int kOutlines = 2;
  DrawLoops(sketch, box, kOutlines, pen);
  sketch.Remark("Fill");
  const double inset = (kOutlines - 0.5) * distance;
  const PatternBox inner{box.left_mm + inset, box.bottom_mm + inset, box.right_mm - inset,
                         box.top_mm - inset};
  if (inner.left_mm >= inner.right_mm || inner.bottom_mm >= inner.top_mm) return;
  const double first = inner.left_mm + inner.bottom_mm;
  const double last = inner.right_mm + inner.top_mm;
  const double pitch = distance * std::numbers::sqrt2;
  bool forward = true;
  for (double sum = first + pitch; sum < last; sum += pitch) {
    const double low_x = std::max(inner.left_mm, sum - inner.top_mm);
    const double high_x = std::min(inner.right_mm, sum - inner.bottom_mm);
    if (high_x - low_x < 0.1) continue;
    const double from = forward ? low_x : high_x;
    const double to = forward ? high_x : low_x;
    sketch.TravelTo({from, sum - from}, false);
    sketch.ExtrudeTo({to, sum - to}, area, pen.feed_mm_s);
    forward = !forward;
  }
}

namespace {

using PenStroke = std::vector<PatternPoint>;

// Returns the strokes of one character in its cell of 2 x 4 mm, open by `open_mm` where a "0" ends.
std::vector<PenStroke> StrokesOf(char character, const GlyphStyle& style, double open_mm) {
  switch (character) {
    case '0':
      return {{{0, 0}, {2, 0}, {2, 4}, {0, 4}, {0, open_mm}}};
    case '1':
      return style.one_left ? std::vector<PenStroke>{{{0, 0}, {0, 4}}}
                            : std::vector<PenStroke>{{{1, 0}, {1, 4}}};
    case '2':
      return {{{0, 4}, {2, 4}, {2, 2}, {0, 2}, {0, 0}, {2, 0}}};
    case '3':
      return {{{0, 4}, {2, 4}, {2, 0}, {0, 0}}, {{0, 2}, {2, 2}}};
    case '4':
      return {{{0, 4}, {0, 2}, {2, 2}}, {{2, 4}, {2, 0}}};
    case '5':
      return {{{2, 4}, {0, 4}, {0, 2}, {2, 2}, {2, 0}, {0, 0}}};
    case '6':
      return {{{2, 4}, {0, 4}, {0, 0}, {2, 0}, {2, 2}, {0, 2}}};
    case '7':
      return {{{0, 4}, {2, 4}, {2, 0}}};
    case '8':
      return {{{0, 2}, {0, 4}, {2, 4}, {2, 0}, {0, 0}, {0, 2}, {2, 2}}};
    case '9':
      return style.nine_foot
                 ? std::vector<PenStroke>{{{2, 2}, {0, 2}, {0, 4}, {2, 4}, {2, 0}, {0, 0}}}
                 : std::vector<PenStroke>{{{2, 2}, {0, 2}, {0, 4}, {2, 4}, {2, 0}}};
    case '.':
      return style.narrow ? std::vector<PenStroke>{{{0, 0}, {0, style.dot_mm}}}
                          : std::vector<PenStroke>{{{1, 0}, {1, style.dot_mm}}};
    default:
      return {};
  }
}

double AdvanceOf(char character, const GlyphStyle& style) {
  const bool thin = style.narrow && (character == '1' || character == '.');
  return thin ? 1 : kStrokeMm + 1;
}

}  // namespace

double GlyphsLength(std::string_view text, const GlyphStyle& style) {
  double length = 0;
  for (const char character : text) length += AdvanceOf(character, style);
  return std::max(0.0, length - 1);
}

void DrawGlyphs(PatternSketch& sketch, std::string_view text, const PatternPoint& from,
                bool upwards, const GlyphStyle& style, const PatternPen& pen) {
  double along = 0;
  for (const char character : text) {
    sketch.Remark(fmt::format("Glyph: {}", character));
    const auto place = [&](const PatternPoint& p) {
      const double right = along + p.x_mm;
      return upwards ? PatternPoint{from.x_mm - p.y_mm, from.y_mm + right}
                     : PatternPoint{from.x_mm + right, from.y_mm + p.y_mm};
    };
    for (const PenStroke& stroke : StrokesOf(character, style, pen.width_mm / 2)) {
      sketch.TravelTo(place(stroke.front()));
      for (std::size_t i = 1; i < stroke.size(); ++i) {
        sketch.ExtrudeTo(place(stroke[i]), BeadArea(pen.width_mm, pen.height_mm), pen.feed_mm_s);
      }
    }
    along += AdvanceOf(character, style);
  }
}

}  // namespace trammel::sim
