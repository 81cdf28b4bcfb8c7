// The page of an answer: its headline, what to do next, its figures, and all in words.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "document/figure.h"

namespace trammel::report {

/// Plain text, which may hold any bytes.
struct AnswerPage {
  std::string title;
  Verdict verdict = Verdict::kRefused;
  std::string value;   ///< of a good answer; "No calibration" of another one
  std::string detail;  ///< beside it, in small letters
  std::string reason;  ///< why there is none
  std::vector<std::string> unchecked = {};
  std::string next;  ///< what to do
  std::vector<std::string> notices = {};
  std::string text;  ///< several lines
};

/// HTML that stands alone.
[[nodiscard]] std::string AnswerPageHtml(const AnswerPage& page, std::span<const Figure> figures);

}  // namespace trammel::report
