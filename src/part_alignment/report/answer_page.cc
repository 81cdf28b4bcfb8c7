#include "part_alignment/report/answer_page.h"

#include <fmt/format.h>

#include "document/page.h"

namespace trammel::report {

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
