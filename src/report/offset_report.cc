#include "report/offset_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/html.h"
#include "report/offset_style.h"
#include "report/report_style.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

std::string Card(const std::string& heading, const std::string& body,
                 const std::string& extra = "") {
  const std::string title =
      heading.empty() ? "" : fmt::format("<h2>{}</h2>\n", EscapeHtml(heading));
  return fmt::format("<section class=\"card{}\">\n{}{}</section>\n", extra, title, body);
}

std::string Picture(const DrawnFigure& figure) {
  return fmt::format(
      "<figure><div class=\"wide\"><img src=\"data:image/{};base64,{}\" alt=\"{}\" "
      "width=\"{:.0f}\" height=\"{:.0f}\"/></div><figcaption>{}</figcaption></figure>\n",
      figure.svg ? "svg+xml" : "png", Base64(figure.bytes), EscapeHtml(figure.name),
      figure.width_px, figure.height_px, EscapeHtml(figure.caption));
}

Verdict Worst(const OffsetAnalysis& analysis) {
  Verdict worst = Verdict::kGood;
  const auto add = [&](Verdict verdict) {
    if (verdict == Verdict::kRefused || worst == Verdict::kGood) worst = verdict;
  };
  for (const to::CombinedTool& tool : analysis.combined.tools) add(VerdictOf(tool));
  for (const OffsetScan& scan : analysis.scans) {
    for (const to::SelfTestReading& reading : scan.result.self_tests) {
      add(reading.recovered_mm.verdict());
    }
  }
  return worst;
}

std::string ToolRow(const OffsetAnalysis& analysis, const to::CombinedTool& tool) {
  const Verdict verdict = VerdictOf(tool);
  const bool good = verdict == Verdict::kGood;
  std::string row;
  if (good) {
    row = fmt::format("<tr><td>T{}</td><td>{}</td><td>{}</td><td>good{}</td></tr>\n", tool.tool,
                      OffsetWords(tool.dx_mm), OffsetWords(tool.dy_mm),
                      tool.coarse ? ", coarse" : "");
  } else {
    row = fmt::format("<tr><td>T{}</td><td class=\"text\" colspan=\"2\">{}</td><td>{}</td></tr>\n",
                      tool.tool, EscapeHtml(ReasonOf(tool)), VerdictWords(verdict));
  }
  for (const std::string& notice : NoticesOf(analysis, tool.tool)) {
    row +=
        fmt::format("<tr class=\"unused\"><td></td><td class=\"text\" colspan=\"3\">{}</td></tr>\n",
                    EscapeHtml(notice));
  }
  return row;
}

std::string AxisRow(const std::string& name, const to::AxisPair& pair) {
  const std::string& x = pair.x.reason();
  const std::string& y = pair.y.reason();
  std::string row = fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td></td></tr>\n", name,
                                OffsetWords(pair.x), OffsetWords(pair.y));
  if (const std::string& why = x.empty() ? y : x; !why.empty()) {
    row +=
        fmt::format("<tr class=\"unused\"><td></td><td class=\"text\" colspan=\"3\">{}</td></tr>\n",
                    EscapeHtml(why));
  }
  return row;
}

std::string Head(const OffsetAnalysis& analysis) {
  const Verdict worst = Worst(analysis);
  const std::size_t count = analysis.combined.tools.size();
  const auto good =
      std::count_if(analysis.combined.tools.begin(), analysis.combined.tools.end(),
                    [](const to::CombinedTool& tool) { return VerdictOf(tool) == Verdict::kGood; });
  std::string body = fmt::format("<p class=\"verdict\">{}</p>\n", VerdictWords(worst));
  if (count > 0) {
    body += fmt::format(
        "<p>{} of {} tools have an offset. Behind ± stands half of the 95 % "
        "interval.</p>\n",
        good, count);
  }
  body +=
      "<div class=\"wide\"><table>\n<tr><th></th><th>dx, x</th><th>dy, y</th><th></th>"
      "</tr>\n";
  for (const to::CombinedTool& tool : analysis.combined.tools) body += ToolRow(analysis, tool);
  body += AxisRow("play", analysis.combined.backlash_mm);
  body += AxisRow("bias along u, v", analysis.combined.control_bias_mm);
  body += "</table></div>\n";
  if (count > 0) {
    body += fmt::format(
        "<p class=\"quiet\">dx and dy are where a tool's line lands minus where T{}'s would for "
        "the same command, along the bed's axes. <code>trammel offset apply</code> shows the "
        "commands that take them out. A tool without a value keeps the offset that it has.</p>\n",
        analysis.plan.settings.reference_tool);
  }
  return Card("", body, fmt::format(" head {}", ToString(worst)));
}

std::string List(const std::vector<std::string>& lines) {
  std::string body = "<ul>\n";
  for (const std::string& line : lines) body += fmt::format("<li>{}</li>\n", EscapeHtml(line));
  return body + "</ul>\n";
}

int LeftOut(const to::StructureReading& reading) {
  return static_cast<int>(
      std::count_if(reading.fingers.begin(), reading.fingers.end(),
                    [](const to::FingerReading& finger) { return !finger.left_out.empty(); }));
}

/// One line per structure; its picture opens below.
std::string StructureDetails(const to::StructureReading& reading, const DrawnFigure& figure) {
  const bool good = reading.offset_mm.good();
  std::string words = OffsetWords(reading.offset_mm);
  if (good) {
    words += fmt::format(", residuals {:.1f} µm rms", reading.residual_rms_mm * kUmPerMillimetre);
  } else {
    words += ": " + reading.offset_mm.reason();
  }
  if (const int count = LeftOut(reading); count > 0) {
    words += fmt::format(", {} {} left out", count, count == 1 ? "tooth" : "teeth");
  }
  return fmt::format("<details{}>\n<summary><b>{}</b> {}</summary>\n{}</details>\n",
                     good ? "" : " open=\"open\"", EscapeHtml(reading.name), EscapeHtml(words),
                     Picture(figure));
}

std::string ScanCards(const OffsetReportInput& input, std::size_t index) {
  const OffsetScan& scan = input.analysis->scans[index];
  const OffsetScanPictures& pictures = input.pictures[index];
  std::string facts =
      fmt::format("<p class=\"facts\">{}{}: {:.1f} × {:.1f} dpi, teeth scatter by {:.1f} µm</p>\n",
                  EscapeHtml(scan.source), scan.page > 1 ? fmt::format(", page {}", scan.page) : "",
                  scan.result.page_dpi_x, scan.result.page_dpi_y,
                  scan.result.finger_scatter_mm * kUmPerMillimetre);
  const std::string name = input.analysis->scans.size() > 1
                               ? fmt::format("Scan {} (sheet {})", index + 1, scan.sheet)
                               : std::string("The scan");
  std::string html;
  for (const DrawnFigure& figure : pictures.page) {
    const bool first = &figure == pictures.page.data();
    html += Card(first ? name : "", (first ? facts : "") + Picture(figure));
  }
  html += Card("", Picture(Encode(StructureOffsetsFigure(scan))));
  std::string details =
      "<p class=\"quiet\">Open one to see its teeth on the scan, its signal, and what the fit "
      "leaves.</p>\n";
  const std::size_t count = std::min(scan.result.structures.size(), pictures.structures.size());
  for (std::size_t i = 0; i < count; ++i) {
    details += StructureDetails(scan.result.structures[i], pictures.structures[i]);
  }
  return html + Card("Structures", details);
}

std::string Opening(const OffsetAnalysis& analysis) {
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'\"/>\n<title>Tool offsets</title>\n<style>";
  page += kReportStyle;
  page +=
      "details{border-top:1px solid var(--edge);padding:8px 0}summary{cursor:pointer;"
      "overflow-wrap:anywhere}details figure{margin-top:10px}";
  page += fmt::format(
      "</style>\n</head>\n<body>\n<main>\n<h1>Tool offsets from a scanned sheet</h1>\n"
      "<p class=\"facts\">Sheet {}, T{} is the reference tool. Scans: {}</p>\n",
      analysis.plan.sheet_id, analysis.plan.settings.reference_tool, analysis.scans.size());
  return page;
}

}  // namespace

std::vector<DrawnFigure> OffsetValueFigures(const OffsetAnalysis& analysis) {
  std::vector<DrawnFigure> figures;
  for (const auto make : {ToolOffsetsFigure, SelfTestFigure, PickUpsFigure}) {
    if (const auto figure = make(analysis)) figures.push_back(Encode(*figure));
  }
  figures.push_back(Encode(AxesFigure(analysis)));
  return figures;
}

std::string OffsetReport(const OffsetReportInput& input) {
  const OffsetAnalysis& analysis = *input.analysis;
  std::string page = Opening(analysis) + Head(analysis);
  if (!input.failed.empty()) page += Card("Scans that could not be read", List(input.failed));
  if (const auto notices = NoticesOf(analysis); !notices.empty()) {
    page += Card("Notices", List(notices));
  }
  for (const DrawnFigure& figure : OffsetValueFigures(analysis)) page += Card("", Picture(figure));
  for (std::size_t i = 0; i < std::min(analysis.scans.size(), input.pictures.size()); ++i) {
    page += ScanCards(input, i);
  }
  page +=
      "<footer>Made by trammel. This page stands alone: nothing is loaded from "
      "elsewhere.</footer>\n</main>\n</body>\n</html>\n";
  return page;
}

}  // namespace trammel::report
