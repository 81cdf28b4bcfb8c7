#include "document/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "base/check.h"
#include "base/utf8.h"

namespace trammel::report {
std::string EscapeHtml(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : Utf8OrReplaced(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string Base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      group = group << 8U | (i < count ? static_cast<std::uint8_t>(bytes[at + i]) : 0U);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      out += i <= count ? kDigits[(group >> (18 - 6 * i)) & 63U] : '=';
    }
  }
  return out;
}

namespace {

inline constexpr std::string_view kReportStyle = R"css(
:root{color-scheme:light dark;--page:#f4f6f8;--card:#fff;--ink:#1d2430;--muted:#5a6472;--edge:#d8dee5;
--good:#0a5fa5;--warn:#8a4b00;--bad:#a32014;--code:#eef1f5}

@media(prefers-color-scheme:dark){:root{--page:#14181e;--card:#1d232b;--ink:#e8ecf1;--muted:#a3adba;
--edge:#333c47;--good:#7cc0f2;--warn:#f2b25c;--bad:#ff9a8c;--code:#2a323c}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:16px/1.5 system-ui,"DejaVu Sans",sans-serif}
main{max-width:860px;margin:0 auto;padding:20px 16px 48px}
h1{font-size:1.25rem;margin:0}h2{font-size:1.1rem;margin:0 0 10px}p{margin:.5em 0}
h1+.card{margin-top:14px}
.facts{color:var(--muted);font-size:.9rem;margin:2px 0 16px;overflow-wrap:anywhere}
.card{background:var(--card);border:1px solid var(--edge);border-radius:10px;padding:16px 20px;margin:0 0 16px}
.head{border-left:6px solid var(--good)}.head.cannot_tell{border-left-color:var(--warn)}
.head.refused{border-left-color:var(--bad)}
.value{font-size:2.1rem;font-weight:700;line-height:1.2;margin:0}
.value small{font-size:1.2rem;font-weight:600;color:var(--muted)}

.verdict{display:inline-block;font-weight:700;border:1.5px solid currentColor;border-radius:99px;
padding:1px 12px;font-size:.9rem;color:var(--good)}
.cannot_tell .verdict{color:var(--warn)}.refused .verdict{color:var(--bad)}
.reason{font-size:1.05rem;overflow-wrap:anywhere}.quiet{color:var(--muted);font-size:.92rem}

pre{background:var(--code);border-radius:6px;padding:10px 12px;margin:6px 0 12px;white-space:pre-wrap;overflow-wrap:anywhere;
font:14px/1.45 "DejaVu Sans Mono",monospace}
code{font:.92em "DejaVu Sans Mono",monospace}
.option{white-space:nowrap}
.wide{overflow-x:auto}table{border-collapse:collapse;width:100%;font-size:.92rem}
th,td{padding:5px 10px;text-align:right;border-bottom:1px solid var(--edge);white-space:nowrap}
th{color:var(--muted);font-weight:600}th:first-child,td:first-child{text-align:left;padding-left:0}
td.text,th.text{text-align:left}td.text{white-space:normal;overflow-wrap:anywhere}
td.text:not(.note):not(:first-child){min-width:8em}tr.unused{color:var(--muted)}
td small{color:var(--muted);display:block}
figure{margin:0}figure svg{display:block;max-width:100%;height:auto}.narrow{display:none}
.view{margin:0 0 12px}.view svg{display:block;max-width:100%;height:auto}
p.plain{border-top:1px solid var(--edge);margin:0;padding:8px 0}
details{border-top:1px solid var(--edge);padding:8px 0}details figure{margin-top:10px}
summary{cursor:pointer;overflow-wrap:anywhere}

@media screen and (max-width:600px){main{padding:14px 8px 32px}.card{padding:14px 12px}
.narrow{display:block}.broad{display:none}.value{font-size:1.7rem}
table,tbody,tr{display:block}thead{display:none}tr{border-bottom:1px solid var(--edge);padding:6px 0}
td,td:first-child{display:flex;justify-content:space-between;gap:1em;text-align:right;
white-space:normal;border:0;padding:2px 0}td.text:not(:first-child){min-width:0}
td:first-child{font-weight:600}td[data-name=""]{justify-content:flex-start}td:empty{display:none}
td small{display:inline;margin-left:.5em}td::before{content:attr(data-name);color:var(--muted);font-weight:400;text-align:left;flex:none}
td.text.note{display:block;text-align:left}}
figcaption{font-size:.92rem;color:var(--muted);margin-top:10px}
li{margin:.3em 0;overflow-wrap:anywhere}ul{margin:0;padding-left:1.2em}
footer{color:var(--muted);font-size:.85rem}

@media print{:root{color-scheme:light;--page:#fff;--card:#fff;--ink:#000;--muted:#444;--edge:#bbb;
--good:#0a5fa5;--warn:#8a4b00;--bad:#a32014;--code:#f2f2f2}
main{max-width:none;padding:0}.card{break-inside:avoid;padding:10px 12px}
.wide{overflow:visible}body{font-size:11pt}}
)css";

}  // namespace

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
      ToString(verdict), words.empty() ? VerdictText(verdict) : EscapeHtml(words), body);
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
    if (made.size() <= kMaxPageBytes) break;
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
