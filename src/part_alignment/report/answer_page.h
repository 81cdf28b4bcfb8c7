// Shared parts of answer reports: numbers in JSON, lines of text, and the page.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "document/figure.h"

namespace trammel::report {

/// Returns lists, and lists of rows; null for numbers that are not finite.
[[nodiscard]] nlohmann::ordered_json List(const Eigen::VectorXd& values);
[[nodiscard]] nlohmann::ordered_json Rows(const Eigen::MatrixXd& matrix);

/// "verdict   cannot tell: why".
[[nodiscard]] std::string VerdictLine(Verdict verdict, const std::string& reason);

/// Returns a line for each text, ten characters behind the start of its label.
[[nodiscard]] std::string Lines(const char* label, const std::vector<std::string>& texts);

/// Plain text of an answer, of any bytes: the headline, the next step, and all in words.
struct AnswerPage {
  std::string title;
  Verdict verdict = Verdict::kRefused;
  std::string value;   ///< if the answer is good; otherwise "No calibration"
  std::string detail;  ///< beside it, in small letters
  std::string reason;  ///< why there is no answer
  std::vector<std::string> unchecked = {};
  std::string next;  ///< user's next step
  std::vector<std::string> notices = {};
  std::string text;  ///< several lines
};

/// Returns self-contained HTML.
[[nodiscard]] std::string AnswerPageHtml(const AnswerPage& page, std::span<const Figure> figures);

}  // namespace trammel::report
