#include "part_alignment/report/answer_page.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "document/json_number.h"
#include "document/page.h"

namespace trammel::report {

nlohmann::ordered_json List(const Eigen::VectorXd& values) {
  auto list = nlohmann::ordered_json::array();
  for (const double value : values) list.push_back(Number(value));
  return list;
}

nlohmann::ordered_json Rows(const Eigen::MatrixXd& matrix) {
  auto rows = nlohmann::ordered_json::array();
  for (const auto& row : matrix.rowwise()) rows.push_back(List(row.transpose()));
  return rows;
}

std::string VerdictLine(Verdict verdict, const std::string& reason) {
  return fmt::format("verdict   {}{}{}\n", VerdictText(verdict), reason.empty() ? "" : ": ",
                     reason);
}

std::string Lines(const char* label, const std::vector<std::string>& texts) {
  std::string lines;
  for (const std::string& text : texts) lines += fmt::format("{:<9} {}\n", label, text);
  return lines;
}

std::string AnswerPageHtml(const AnswerPage& page, std::span<const Figure> figures) {
  std::string head = AnswerLine(page.value, page.detail);
  if (!page.reason.empty()) {
    head += fmt::format("<p class=\"reason\">{}</p>\n", EscapeHtml(page.reason));
  }
  head += UncheckedHtml(page.unchecked);
  std::string html = PageBegin(page.title, page.title) + HeadCard(page.verdict, head) +
                     Card("What to do next", fmt::format("<p>{}</p>\n", EscapeHtml(page.next))) +
                     ListCard("Worth knowing", page.notices);
  for (const Figure& figure : figures) html += Card("", FigureHtml(figure));
  return html + Card("All in words", fmt::format("<pre>{}</pre>\n", EscapeHtml(page.text))) +
         PageEnd();
}

}  // namespace trammel::report
