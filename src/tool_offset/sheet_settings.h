// Every setting of the printed sheet.
#pragma once

#include <string>
#include <vector>

#include "gcode/dialect.h"

namespace trammel::tool_offset {

/// What is drawn, and with what; ranges stand in SheetFields().
struct SheetSettings {
  // What is measured.
  std::vector<int> tools = {0, 1};  ///< Numbers as the firmware has them, 2 … 8 (one: self-test).
  int reference_tool = 0;           ///< One of them; all offsets are against it.
  int controls = 2;                 ///< [2, 8] structures per axis, half of them each way.
  int pick_ups = 0;        ///< [0, 4] times that each tool is put back and picked up again.
  bool self_test = false;  ///< One tool, structures with programmed offsets.

  // The combs.
  double pitch_mm = 3.7;         ///< [2, 10]; no whole number of motor cycles, tilted or not.
  int teeth = 17;                ///< [5, 60] per comb.
  double leg_spacing_mm = 0.75;  ///< Between the two legs of a finger.
  double leg_length_mm = 6;      ///< [3, 20]
  double overlap_mm = 4;         ///< Along the legs, where both combs stand side by side.
  double structure_gap_mm = 3;   ///< Between structures, and to the box.
  double tilt_deg = 15;          ///< [5, 40] or negative: both motors move along every leg.
  double line_width_mm = 0.4;    ///< [0.1, 1.5]
};

}  // namespace trammel::tool_offset
