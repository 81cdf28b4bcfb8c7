// Values on the command line: pressure advances, segments, sizes, shifts of tools.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "pressure_advance/line_motion.h"

namespace trammel::app {

/// Reads `0,0.01,0.02`, `START:END:STEP` or `START:END:COUNT`, both ends included. The third part
/// is a step where it fits between the ends, else a count: 0:0.1:0.005 has 21 values, 0:0.06:10
/// has ten.
/// @returns At least one value, in s, rounded to 1e-9 s. Errors: not numbers, negative, above 10 s,
///          reversed, a step that does not divide the range, more than 1000 values.
[[nodiscard]] Result<std::vector<double>> ParsePressureAdvances(std::string_view text);

/// Reads `FRACTION:SPEED,FRACTION:SPEED,…`, for example 0.1:10,0.6:100,0.3:10.
/// @returns Segments whose fractions sum to 1 (to 1e-3) and whose speeds lie within 0.1 … 2000
///          mm/s, or an error that names the part and the bound.
[[nodiscard]] Result<std::vector<pressure_advance::Segment>> ParseSegments(std::string_view text);

struct WholePair {
  int first = 0;
  int second = 0;
};

/// Reads `9x3` or `1280x720`; nothing where the text is not two whole numbers with an x between.
[[nodiscard]] std::optional<WholePair> ParseWholePair(std::string_view text);

struct ToolShift {
  int tool = 0;
  double x_mm = 0;
  double y_mm = 0;
};

/// Reads `TOOL:X,Y`, for example 1:0.2,-0.1: tools 0 ... most_tool, X and Y within +-1000 mm.
/// @param option  begins the message of the error.
[[nodiscard]] Result<ToolShift> ParseToolShift(std::string_view option, std::string_view text,
                                               int most_tool);

}  // namespace trammel::app
