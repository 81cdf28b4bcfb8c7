// What reports of answers share: numbers in JSON, lines of text, and the page.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "document/figure.h"

namespace trammel::report {

/// Lists and lists of rows; null for what is not finite.
[[nodiscard]] nlohmann::ordered_json List(const Eigen::VectorXd& values);
[[nodiscard]] nlohmann::ordered_json Rows(const Eigen::MatrixXd& matrix);

/// "verdict   cannot tell: why".
[[nodiscard]] std::string VerdictLine(Verdict verdict, const std::string& reason);

/// A line for each text, ten characters behind the begin of its label.
[[nodiscard]] std::string Lines(const char* label, const std::vector<std::string>& texts);

/// Plain text, which may hold any bytes: the headline, what to do next, and all in words.
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
