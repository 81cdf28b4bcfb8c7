// Pen over the bed that writes G-code: what all pattern tools have in common.
#pragma once

#include <string>
#include <string_view>

#include "sim/slicer_patterns/slicer_pattern.h"

namespace trammel::sim {

struct PatternPoint {
  double x_mm = 0;
  double y_mm = 0;
};

/// Returns the area of a bead with half-round sides, mm^2.
[[nodiscard]] double BeadArea(double width_mm, double height_mm);
/// Returns the distance at which such beads touch without a groove: their area over their height.
[[nodiscard]] double BeadDistance(double width_mm, double height_mm);

/// Habits of a tool between two strokes.
struct SketchHabits {
  double retract_mm = 0.8;
  double hop_mm = 0.4;
  double retract_over_mm = 0;  ///< no retraction for travels up to this
};

class PatternSketch {
 public:
  PatternSketch(const PatternOptions& options, const SketchHabits& habits);

  /// Writes a line as it is.
  void Line(std::string_view text);
  /// Writes a line that slicers leave out unless verbose.
  void Remark(std::string_view text);
  /// Heats, homes and sets modes.
  void Begin();
  void End();
  void SetAcceleration(double mm_s2);
  void SetCorner(double mm_s);
  void SetAdvance(double seconds);
  void SetLayer(double z_mm);
  /// Turns everything that follows about a point, counter-clockwise.
  void Turn(double angle_rad, const PatternPoint& about);
  void TravelTo(const PatternPoint& to, bool retracts = true);
  /// REQUIRES a length > 0.
  void ExtrudeTo(const PatternPoint& to, double area_mm2, double feed_mm_s);

  [[nodiscard]] const PatternPoint& place() const { return place_; }
  [[nodiscard]] std::string Take() { return std::move(text_); }

 private:
  void Filament(double mm, std::string& line);
  [[nodiscard]] PatternPoint Turned(const PatternPoint& point) const;

  PatternOptions options_;
  SketchHabits habits_;
  std::string text_;
  PatternPoint place_{-1e9, -1e9};
  PatternPoint about_;
  double angle_rad_ = 0;
  double z_mm_ = 0;
  double e_mm_ = 0;
};

struct PatternBox {
  double left_mm = 0;
  double bottom_mm = 0;
  double right_mm = 0;
  double top_mm = 0;
};

struct PatternPen {
  double width_mm = 0.4;
  double height_mm = 0.2;
  double feed_mm_s = 30;
};

/// Draws loops inwards, the outermost with its centre line on the box.
void DrawLoops(PatternSketch& sketch, PatternBox box, int loops, const PatternPen& pen);
/// Draws an outline and fills it with lines at 45 degrees.
void DrawFilledBox(PatternSketch& sketch, const PatternBox& box, const PatternPen& pen);

/// Digits as a tool draws them, of seven strokes 2 mm long.
struct GlyphStyle {
  bool narrow = false;     ///< 1 mm after "1" and "." in place of 3 mm
  bool one_left = false;   ///< "1" at the cell's left edge; else in its middle
  bool nine_foot = false;  ///< "9" has a bottom stroke
  double dot_mm = 1;       ///< length of the stroke of "."
};

/// Returns the length of a text, to the last stroke's end.
[[nodiscard]] double GlyphsLength(std::string_view text, const GlyphStyle& style);
/// Draws a text from the lower left corner of its first character; upwards turns it by 90 degrees
/// counter-clockwise. Characters other than digits and "." are left blank.
void DrawGlyphs(PatternSketch& sketch, std::string_view text, const PatternPoint& from,
                bool upwards, const GlyphStyle& style, const PatternPen& pen);

}  // namespace trammel::sim
