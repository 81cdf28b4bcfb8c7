#include "tool_offset/report/offset_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "document/html.h"
#include "document/interval_text.h"
#include "document/page.h"
#include "tool_offset/report/offset_style.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

std::string Cell(const Measured& measured) {
  if (!measured.good()) return VerdictWords(measured.verdict());
  const Quantity& quantity = measured.quantity();
  return ValueCell(ValueText(quantity.value, quantity.interval95, kOffsetMillimetres),
                   IntervalText(quantity.interval95, kOffsetMillimetres));
}

void AddRow(const OffsetRow& row, Table& table) {
  const Verdict verdict = row.verdict();
  // A tool with one bad axis has no answer.
  const bool shown = verdict == Verdict::kGood || row.kind != OffsetRowKind::kTool;
  table.Row({EscapeHtml(row.name), shown ? Cell(row.x) : "–", row.y && shown ? Cell(*row.y) : "–",
             VerdictWords(verdict) + (row.remark.empty() ? "" : ", " + row.remark)});
  if (verdict != Verdict::kGood) table.Note(EscapeHtml(row.reason()));
  for (const std::string& notice : row.notices) table.Note(EscapeHtml(notice));
}

std::string Head(const OffsetAnalysis& analysis) {
  const auto& tools = analysis.combined.tools;
  const auto good = std::count_if(tools.begin(), tools.end(), [](const to::CombinedTool& tool) {
    return VerdictOf(tool) == Verdict::kGood;
  });
  const int reference = analysis.plan.settings.reference_tool;
  std::string body;
  if (!tools.empty()) {
    body = fmt::format("<p class=\"reason\">{} of {} tools have an offset against T{}.</p>\n", good,
                       tools.size(), reference);
  }
  Table table({{""}, {"x"}, {"y"}, {"verdict"}});
  for (const OffsetRow& row : OffsetTable(analysis)) AddRow(row, table);
  return HeadCard(
      VerdictOf(analysis),
      body + table.Html() +
          fmt::format("<p class=\"quiet\">Of a tool: where its line lands minus where T{}'s would "
                      "for the same command, along the bed's axes. A tool without a value keeps "
                      "the offset that it has. The method's bias, along u and v of the sheet, is "
                      "taken off.</p>\n",
                      reference));
}

to::OffsetFirmware FirmwareOf(gcode::Dialect dialect) {
  switch (dialect) {
    case gcode::Dialect::kMarlin:
      return to::OffsetFirmware::kMarlin;
    case gcode::Dialect::kRepRapFirmware:
      return to::OffsetFirmware::kRepRapFirmware;
    default:
      return to::OffsetFirmware::kKlipperTool;
  }
}

/// The lines that set the tools' new offsets, and behind them those that save them: from what the
/// printer keeps, where that is known, otherwise from 0.
std::string Next(const OffsetReportInput& input) {
  const OffsetAnalysis& analysis = *input.analysis;
  const to::OffsetFirmware firmware = FirmwareOf(analysis.plan.settings.printer.dialect);
  std::vector<KeptChange> changes = input.kept;
  for (const to::CombinedTool& tool : analysis.combined.tools) {
    if (!input.kept.empty() || VerdictOf(tool) != Verdict::kGood) continue;
    changes.push_back(
        {tool.tool,
         {},
         to::Corrected(firmware, {}, tool.dx_mm.quantity().value, tool.dy_mm.quantity().value)});
  }
  if (changes.empty()) {
    return Card("What to do next",
                "<p>Keep the offsets that are in use. Put right what the reason above names, then "
                "print or scan another sheet.</p>\n");
  }
  std::string lines;
  std::string saves;
  for (const KeptChange& change : changes) {
    for (const std::string& line : to::SetCommands(firmware, change.tool, change.next)) {
      lines += line + "\n";
    }
    for (const std::string& line : to::SaveCommands(firmware, change.tool)) {
      if (saves.find(line + "\n") == std::string::npos) saves += line + "\n";
    }
  }
  const std::string advice = to::SaveAdvice(firmware, 0, {});
  return Card(
      "What to do next",
      fmt::format(
          "<p>{}</p>\n<pre>{}</pre>\n<p class=\"quiet\">{}<code>trammel offset apply</code> "
          "sets them, and shows the lines for other firmwares and for other offsets of "
          "now.</p>\n<p>Then print another sheet and look for zero.</p>\n",
          input.kept.empty() ? "Where the firmware keeps 0 for these tools now:"
                             : "The lines that take the offsets out of what the printer keeps now:",
          EscapeHtml(lines + saves), advice.empty() ? "" : EscapeHtml(advice) + ". "));
}

/// Teeth that were meant to count and do not.
int LeftOut(const to::Structure& structure, const to::StructureReading& reading) {
  return static_cast<int>(std::count_if(
      reading.fingers.begin(), reading.fingers.end(), [&](const to::FingerReading& finger) {
        return !finger.left_out.empty() && finger.finger != structure.incomplete[finger.comb];
      }));
}

/// One line per structure; its picture, where it has one, opens below.
std::string StructureDetails(const to::Structure& structure, const to::StructureReading& reading,
                             const std::string& picture) {
  const bool good = reading.offset_mm.good();
  std::string words = OffsetWords(reading.offset_mm);
  if (good) {
    words += fmt::format(", residuals {:.1f} µm rms", reading.residual_rms_mm * kUmPerMm);
  } else {
    words += ": " + reading.offset_mm.reason();
  }
  if (const int count = LeftOut(structure, reading); count > 0) {
    words += fmt::format(", {} {} left out", count, count == 1 ? "tooth" : "teeth");
  }
  const std::string line = fmt::format("<b>{}</b> {}", EscapeHtml(reading.name), EscapeHtml(words));
  if (picture.empty()) return fmt::format("<p class=\"plain\">{}</p>\n", line);
  return fmt::format("<details{}>\n<summary>{}</summary>\n{}</details>\n",
                     good ? "" : " open=\"open\"", line, picture);
}

/// Scans that a page draws at every step: of more only the numbers are on it.
constexpr std::size_t kMostDrawn = 5;

std::string StructuresCard(const to::SheetPlan& plan, const OffsetScan& scan,
                           const OffsetScanPictures& pictures, bool drawn, std::size_t step) {
  std::string details = fmt::format(
      "<p class=\"quiet\">{}trammel offset analyze --figures FOLDER draws them all.</p>\n",
      drawn ? "Open one to see its teeth on the sheet and what the fit leaves. Pictured "
              "are those that ask most to be looked at; "
            : "This page would be too large with the pictures of all scans; ");
  const std::size_t count = std::min(scan.result.structures.size(), pictures.structures.size());
  for (std::size_t i = 0; i < count; ++i) {
    const to::StructureReading& reading = scan.result.structures[i];
    details += StructureDetails(plan.structures[reading.structure], reading,
                                drawn ? pictures.structures[i].html[step] : std::string());
  }
  return Card("Structures", details);
}

std::string ScanCards(const OffsetReportInput& input, std::size_t index, std::size_t step) {
  const OffsetScan& scan = input.analysis->scans[index];
  const OffsetScanPictures& pictures = input.pictures[index];
  const bool photo = scan.result.photo.has_value();
  const std::string name =
      input.analysis->scans.size() > 1
          ? fmt::format("{} {} (sheet {})", photo ? "Photo" : "Scan", index + 1, scan.sheet)
          : std::string(photo ? "The photo" : "The scan");
  const bool drawn = index < kMostDrawn || step + 1 < kPhotoSteps.size();
  std::string html =
      Card(name, fmt::format("<p class=\"facts\">{}</p>\n{}", EscapeHtml(ScanFacts(scan)),
                             drawn ? pictures.page.html[step] : ""));
  if (drawn) html += Card("", FigureHtml(StructureOffsetsFigure(scan)));
  return html + StructuresCard(input.analysis->plan, scan, pictures, drawn, step);
}

std::string Opening(const OffsetAnalysis& analysis) {
  const bool photos =
      !analysis.scans.empty() &&
      std::all_of(analysis.scans.begin(), analysis.scans.end(),
                  [](const OffsetScan& scan) { return scan.result.photo.has_value(); });
  return PageBegin("Tool offsets", photos ? "Tool offsets from a sheet's photo"
                                          : "Tool offsets from a scanned sheet") +
         fmt::format("<p class=\"facts\">{}, T{} is the reference tool. {}: {}</p>\n",
                     SheetName(analysis.plan), analysis.plan.settings.reference_tool,
                     photos ? "Photos" : "Scans", analysis.scans.size());
}

std::string PageOf(const OffsetReportInput& input, std::size_t step) {
  const OffsetAnalysis& analysis = *input.analysis;
  std::string page = Opening(analysis) + Head(analysis);
  if (!analysis.combined.tools.empty()) page += Next(input);
  std::vector<std::string> refused;
  for (const RefusedScan& scan : analysis.refused) refused.push_back(scan.reason);
  page += ListCard("Scans that could not be read", refused);
  page += ListCard("Worth knowing", NoticesOf(analysis));
  for (const Figure& figure : OffsetValueFigures(analysis)) page += Card("", FigureHtml(figure));
  for (std::size_t i = 0; i < std::min(analysis.scans.size(), input.pictures.size()); ++i) {
    page += ScanCards(input, i, step);
  }
  return page + PageEnd();
}

}  // namespace

std::vector<Figure> OffsetValueFigures(const OffsetAnalysis& analysis) {
  std::vector<Figure> figures;
  for (const auto make : {ToolArrowsFigure, ToolScansFigure}) {
    if (auto figure = make(analysis)) figures.push_back(std::move(*figure));
  }
  return figures;
}

std::string OffsetReport(const OffsetReportInput& input) {
  return FittingPage([&input](std::size_t step) { return PageOf(input, step); });
}

}  // namespace trammel::report
