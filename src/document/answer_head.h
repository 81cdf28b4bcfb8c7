// The head of a picture of an answer.
#pragma once

#include <string>
#include <vector>

#include "base/measured.h"
#include "document/canvas.h"

namespace trammel::report {

struct AnswerHead {
  std::string title;  ///< the quantity: "Pressure advance"
  Verdict verdict = Verdict::kRefused;
  std::string value = {};               ///< with its unit; only of a good answer
  std::string interval = {};            ///< its 95 % interval
  std::string reason = {};              ///< of an answer that is not good
  std::vector<std::string> facts = {};  ///< filament, printer, date
};

/// Draws verdict, value, interval and facts, or the reason in place of a value, above each other.
[[nodiscard]] Canvas DrawAnswerHead(const AnswerHead& head, double width_px);

}  // namespace trammel::report
