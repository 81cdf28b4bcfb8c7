// Lists what the answer is made of: the rows that the terminal and the page show.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/profile/analysis.h"

namespace trammel::report {

struct AnswerRow {
  std::string name;      ///< "speeding up"
  std::string value;     ///< "0.0368 s"; a verdict where there is none
  std::string interval;  ///< "95 %: 0.0351 to 0.0385 s"; empty where there is none
  std::string note;      ///< plain text
};

/// Rows of the storage model, both speed changes, the paper's score and each pattern. None has a
/// number unless analysis.pressure_advance is good.
[[nodiscard]] std::vector<AnswerRow> AnswerRows(const pressure_advance::Analysis& analysis);

}  // namespace trammel::report
