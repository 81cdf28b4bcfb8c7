// Head of an answer's picture.
#pragma once

#include <string>
#include <vector>

#include "base/measured.h"
#include "document/canvas.h"

namespace trammel::report {

struct AnswerHead {
  std::string title;  ///< the quantity: "Pressure advance"
  Verdict verdict = Verdict::kRefused;
  std::string value = {};               ///< with unit; only if the answer is good
  std::string interval = {};            ///< 95 % interval
  std::string reason = {};              ///< why the answer is not good
  std::vector<std::string> facts = {};  ///< filament, printer, date
};

/// Draws verdict, value, interval and facts below each other, or the reason in place of a value.
[[nodiscard]] Canvas DrawAnswerHead(const AnswerHead& head, double width_px);

}  // namespace trammel::report
