#include "document/page.h"

#include <fmt/format.h>

#include "base/check.h"
#include "document/html.h"
#include "document/report_style.h"

namespace trammel::report {

std::string PageBegin(std::string_view title, std::string_view heading) {
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'\"/>\n";
  page += fmt::format("<title>{}</title>\n<style>{}@media screen and (prefers-color-scheme:dark){{",
                      EscapeHtml(title), kReportStyle);
  page += DarkPaletteStyle();
  return page +
         fmt::format("}}\n</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n", EscapeHtml(heading));
}

std::string PageEnd() {
  return "<footer>Made by trammel. This page stands alone: nothing is loaded from "
         "elsewhere.</footer>\n</main>\n</body>\n</html>\n";
}

std::string Card(std::string_view heading, std::string_view body) {
  const std::string title =
      heading.empty() ? "" : fmt::format("<h2>{}</h2>\n", EscapeHtml(heading));
  return fmt::format("<section class=\"card\">\n{}{}</section>\n", title, body);
}

std::string HeadCard(Verdict verdict, std::string_view body, std::string_view words) {
  return fmt::format(
      "<section class=\"card head {}\">\n<p class=\"verdict\">{}</p>\n{}</section>\n",
      ToString(verdict), words.empty() ? VerdictWords(verdict) : EscapeHtml(words), body);
}

std::string UncheckedHtml(const std::vector<std::string>& unchecked) {
  std::string html;
  for (const std::string& what : unchecked) {
    html += fmt::format("<p class=\"reason\">Unchecked: {}</p>\n", EscapeHtml(what));
  }
  return html;
}

std::string AnswerLine(std::string_view value, std::string_view interval) {
  return fmt::format("<p class=\"value\">{} <small>{}</small></p>\n", EscapeHtml(value),
                     EscapeHtml(interval));
}

std::string ValueCell(std::string_view value, std::string_view interval) {
  return fmt::format("<span>{} <small>{}</small></span>", EscapeHtml(value), EscapeHtml(interval));
}

std::string ListCard(std::string_view heading, const std::vector<std::string>& lines) {
  if (lines.empty()) return {};
  std::string body = "<ul>\n";
  for (const std::string& line : lines) body += fmt::format("<li>{}</li>\n", EscapeHtml(line));
  return Card(heading, body + "</ul>\n");
}

std::string DrawingHtml(const Figure& figure, const PhotoDetail& detail) {
  const std::string& label = figure.seen.empty() ? figure.caption : figure.seen;
  if (!figure.narrow) {
    return fmt::format("<div>{}</div>", figure.canvas.ToSvgElement(label, detail));
  }
  return fmt::format("<div class=\"broad\">{}</div><div class=\"narrow\">{}</div>",
                     figure.canvas.ToSvgElement(label, detail),
                     figure.narrow->ToSvgElement(label, detail));
}

std::string FigureHtml(const Figure& figure, const PhotoDetail& detail) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n",
                     DrawingHtml(figure, detail), EscapeHtml(figure.caption));
}

std::string FittingPage(const std::function<std::string(std::size_t step)>& page) {
  std::string made;
  for (std::size_t step = 0; step < kPhotoSteps.size(); ++step) {
    made = page(step);
    if (made.size() <= kMostPageBytes) break;
  }
  return made;
}

void Table::Row(const std::vector<std::string>& cells, bool unused) {
  TRAMMEL_CHECK(cells.size() == columns_.size(), "{} cells in {} columns", cells.size(),
                columns_.size());
  rows_ += unused ? "<tr class=\"unused\">" : "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    rows_ += fmt::format("<td data-name=\"{}\"{}>{}</td>", EscapeHtml(columns_[i].name),
                         columns_[i].words ? " class=\"text\"" : "", cells[i]);
  }
  rows_ += "</tr>\n";
}

void Table::Note(const std::string& html) {
  rows_ += fmt::format("<tr class=\"unused\"><td class=\"text note\" colspan=\"{}\">{}</td></tr>\n",
                       columns_.size(), html);
}

std::string Table::Html() const {
  std::string head;
  for (const Column& column : columns_) {
    head += fmt::format("<th{}>{}</th>", column.words ? " class=\"text\"" : "",
                        EscapeHtml(column.name));
  }
  return fmt::format(
      "<div class=\"wide\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}"
      "</tbody></table></div>\n",
      head, rows_);
}

}  // namespace trammel::report
