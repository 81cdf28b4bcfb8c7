#include "tool_offset/report/offset_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "document/html.h"
#include "document/interval_text.h"
#include "document/page.h"
#include "tool_offset/offset/correction.h"
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

void AddTool(Table& table, const OffsetAnalysis& analysis, const to::CombinedTool& tool) {
  const std::string name = fmt::format("T{}", tool.tool);
  const Verdict verdict = VerdictOf(tool);
  if (verdict == Verdict::kGood) {
    table.Row({name, Cell(tool.dx_mm), Cell(tool.dy_mm), tool.coarse ? "good, coarse" : "good"});
  } else {
    table.Row({name, "–", "–", VerdictWords(verdict)});
    table.Note(EscapeHtml(ReasonOf(tool)));
  }
  for (const std::string& notice : NoticesOf(analysis, tool.tool)) table.Note(EscapeHtml(notice));
}

void AddAxes(Table& table, const std::string& name, const to::AxisPair& pair) {
  table.Row({name, Cell(pair.x), Cell(pair.y), ""});
  const std::string& why = pair.x.reason().empty() ? pair.y.reason() : pair.x.reason();
  if (!why.empty()) table.Note(EscapeHtml(why));
}

std::string Head(const OffsetAnalysis& analysis) {
  const std::size_t count = analysis.combined.tools.size();
  const auto good =
      std::count_if(analysis.combined.tools.begin(), analysis.combined.tools.end(),
                    [](const to::CombinedTool& tool) { return VerdictOf(tool) == Verdict::kGood; });
  std::string body;
  if (count > 0) {
    body += fmt::format("<p class=\"reason\">{} of {} tools have an offset against T{}.</p>\n",
                        good, count, analysis.plan.settings.reference_tool);
  }
  Table table({{"tool"}, {"dx"}, {"dy"}, {"verdict"}});
  for (const to::CombinedTool& tool : analysis.combined.tools) AddTool(table, analysis, tool);
  body += count > 0 ? table.Html() : "";
  if (count > 0) {
    body += fmt::format(
        "<p class=\"quiet\">dx and dy are where a tool's line lands minus where T{}'s would for "
        "the same command, along the bed's axes. A tool without a value keeps the offset that it "
        "has.</p>\n",
        analysis.plan.settings.reference_tool);
  }
  return HeadCard(VerdictOf(analysis), body);
}

std::string AxesCard(const OffsetAnalysis& analysis) {
  Table table({{""}, {"x, u"}, {"y, v"}, {""}});
  AddAxes(table, "play of the bed's axes", analysis.combined.backlash_mm);
  AddAxes(table, "the method's own bias, taken off", analysis.combined.control_bias_mm);
  return Card("Play and bias", table.Html() + FigureHtml(AxesFigure(analysis)));
}

struct FirmwareWords {
  to::OffsetFirmware firmware;
  const char* name;
};
constexpr FirmwareWords kFirmwares[] = {
    {to::OffsetFirmware::kKlipperTool, "Klipper with klipper-toolchanger"},
    {to::OffsetFirmware::kKlipperGcodeOffset, "Klipper with macros of its own (IDEX, changers)"},
    {to::OffsetFirmware::kMarlin, "Marlin"},
    {to::OffsetFirmware::kRepRapFirmware, "RepRapFirmware"}};

bool Speaks(to::OffsetFirmware firmware, gcode::Dialect dialect) {
  switch (firmware) {
    case to::OffsetFirmware::kMarlin:
      return dialect == gcode::Dialect::kMarlin;
    case to::OffsetFirmware::kRepRapFirmware:
      return dialect == gcode::Dialect::kRepRapFirmware;
    default:
      return dialect == gcode::Dialect::kKlipper;
  }
}

/// For a firmware that keeps 0 of every tool; and what each is to grow by, where it keeps more.
std::string LinesFor(const OffsetAnalysis& analysis, const FirmwareWords& words) {
  std::string lines;
  std::string saves;  // behind all tools' lines: one M500 is for all of them
  std::string growth;
  std::string advice;
  for (const to::CombinedTool& tool : analysis.combined.tools) {
    if (VerdictOf(tool) != Verdict::kGood) continue;
    const to::KeptOffset next =
        to::Corrected(words.firmware, {}, tool.dx_mm.quantity().value, tool.dy_mm.quantity().value);
    const bool by_macro = words.firmware == to::OffsetFirmware::kKlipperGcodeOffset;
    for (const std::string& line : to::SetCommands(words.firmware, tool.tool, next)) {
      lines += by_macro ? fmt::format("[gcode_macro T{}]  {}\n", tool.tool, line) : line + "\n";
    }
    if (!by_macro) {
      for (const std::string& line : to::SaveCommands(words.firmware, tool.tool)) {
        if (saves.find(line + "\n") == std::string::npos) saves += line + "\n";
      }
      advice = to::SaveAdvice(words.firmware, tool.tool, next);
    }
    growth += fmt::format("{}T{} X {:+.3f}, Y {:+.3f} mm", growth.empty() ? "" : "; ", tool.tool,
                          next.x_mm, next.y_mm);
  }
  return fmt::format(
      "<p>Where the firmware keeps 0 for these tools now:</p>\n<pre>{}</pre>\n"
      "<p class=\"quiet\">{}Where it keeps another offset, add to it: {}. With "
      "<code>--result result.json</code>, <code>trammel offset apply result.json --for {} --now "
      "TOOL:X,Y</code> does the sum.</p>\n",
      EscapeHtml(lines + saves), advice.empty() ? "" : EscapeHtml(advice) + ". ",
      EscapeHtml(growth), to::ToString(words.firmware));
}

/// The lines to paste, for the sheet's own firmware first; the others open on a click.
std::string Next(const OffsetAnalysis& analysis) {
  const auto& tools = analysis.combined.tools;
  if (std::none_of(tools.begin(), tools.end(), [](const to::CombinedTool& tool) {
        return VerdictOf(tool) == Verdict::kGood;
      })) {
    return Card("What to do next",
                "<p>Keep the offsets that are in use. Put right what the reason above names, then "
                "print or scan "
                "another sheet.</p>\n");
  }
  std::string body;
  std::string others;
  for (const FirmwareWords& words : kFirmwares) {
    const std::string lines = LinesFor(analysis, words);
    if (Speaks(words.firmware, analysis.plan.settings.printer.dialect)) {
      body += fmt::format("<p><b>{}</b></p>\n{}", words.name, lines);
    } else {
      others += fmt::format("<details>\n<summary>{}</summary>\n{}</details>\n", words.name, lines);
    }
  }
  body += others;
  body += "<p>Then print another sheet and look for zero.</p>\n";
  return Card("What to do next", body);
}

/// The lines that take the offsets out of those that the printer keeps now.
std::string NextKept(const std::vector<KeptChange>& changes) {
  std::string lines;
  std::string saves;
  for (const KeptChange& change : changes) {
    for (const std::string& line :
         to::SetCommands(to::OffsetFirmware::kKlipperTool, change.tool, change.next)) {
      lines += line + "\n";
    }
    for (const std::string& line :
         to::SaveCommands(to::OffsetFirmware::kKlipperTool, change.tool)) {
      if (saves.find(line + "\n") == std::string::npos) saves += line + "\n";
    }
  }
  const std::string advice = to::SaveAdvice(to::OffsetFirmware::kKlipperTool, 0, {});
  return Card("What to do next",
              fmt::format("<p>The lines that take the offsets out of what the printer keeps now; "
                          "<code>trammel offset apply</code> on this folder sets them with "
                          "<code>--apply</code>:</p>\n<pre>{}</pre>\n<p class=\"quiet\">{}.</p>\n"
                          "<p>Then print another sheet and look for zero.</p>\n",
                          EscapeHtml(lines + saves), EscapeHtml(advice)));
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

std::string ScanFacts(const OffsetScan& scan) {
  if (scan.result.photo) {
    const tool_offset::PhotoOnPage& photo = *scan.result.photo;
    return fmt::format(
        "<p class=\"facts\">{}{}: a photo, {:.1f} px/mm, {:.0f}° aslant from {:.0f} mm above, "
        "blurred by {:.1f} px, teeth scatter by {:.1f} µm</p>\n",
        EscapeHtml(scan.source), scan.page > 1 ? fmt::format(", page {}", scan.page) : "",
        photo.px_per_mm, photo.pose.tilt_rad * 180 / std::numbers::pi, photo.pose.height_mm,
        photo.blur_px, scan.result.finger_scatter_mm * kUmPerMm);
  }
  return fmt::format(
      "<p class=\"facts\">{}{}: {:.1f} × {:.1f} dpi, teeth scatter by {:.1f} µm</p>\n",
      EscapeHtml(scan.source), scan.page > 1 ? fmt::format(", page {}", scan.page) : "",
      scan.result.page_dpi_x, scan.result.page_dpi_y, scan.result.finger_scatter_mm * kUmPerMm);
}

std::string StructuresCard(const to::SheetPlan& plan, const OffsetScan& scan,
                           const OffsetScanPictures& pictures, bool drawn, std::size_t step) {
  std::string details = fmt::format(
      "<p class=\"quiet\">{}trammel offset analyze --figures FOLDER draws them all.</p>\n",
      drawn
          ? "Open one to see its teeth on the sheet, its signal, and what the fit leaves. Pictured "
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
  const bool has_page = drawn && !pictures.page.empty();
  std::string html =
      Card(name, ScanFacts(scan) + (has_page ? pictures.page.front().html[step] : ""));
  if (drawn) {
    for (std::size_t i = 1; i < pictures.page.size(); ++i) {
      html += Card("", pictures.page[i].html[step]);
    }
    html += Card("", FigureHtml(StructureOffsetsFigure(scan)));
  }
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
                     analysis.plan.original ? "A sheet of the original generator"
                                            : fmt::format("Sheet {}", analysis.plan.sheet_id),
                     analysis.plan.settings.reference_tool, photos ? "Photos" : "Scans",
                     analysis.scans.size());
}

/// Tools, scans, self-test, pick-ups: those that there are.
std::vector<Figure> ValueFigures(const OffsetAnalysis& analysis) {
  std::vector<Figure> figures;
  for (const auto make : {ToolArrowsFigure, ToolScansFigure, SelfTestFigure, PickUpsFigure}) {
    if (auto figure = make(analysis)) figures.push_back(std::move(*figure));
  }
  return figures;
}

std::string PageOf(const OffsetReportInput& input, std::size_t step) {
  const OffsetAnalysis& analysis = *input.analysis;
  std::string page = Opening(analysis) + Head(analysis);
  if (!input.kept.empty()) {
    page += NextKept(input.kept);
  } else if (!analysis.combined.tools.empty()) {
    page += Next(analysis);
  }
  page += ListCard("Scans that could not be read", input.failed);
  page += ListCard("Worth knowing", NoticesOf(analysis));
  std::vector<Figure> figures = ValueFigures(analysis);
  if (auto kept = KeptArrowsFigure(input.kept)) {
    figures.insert(figures.begin() + (figures.empty() ? 0 : 1), std::move(*kept));
  }
  for (const Figure& figure : figures) page += Card("", FigureHtml(figure));
  page += AxesCard(analysis);
  for (std::size_t i = 0; i < std::min(analysis.scans.size(), input.pictures.size()); ++i) {
    page += ScanCards(input, i, step);
  }
  return page + PageEnd();
}

}  // namespace

std::vector<DrawnFigure> OffsetValueFigures(const OffsetAnalysis& analysis) {
  std::vector<DrawnFigure> figures;
  for (const Figure& figure : ValueFigures(analysis)) figures.push_back(Drawn(figure));
  figures.push_back(Drawn(AxesFigure(analysis)));
  return figures;
}

std::string OffsetReport(const OffsetReportInput& input) {
  return FittingPage([&input](std::size_t step) { return PageOf(input, step); });
}

}  // namespace trammel::report
