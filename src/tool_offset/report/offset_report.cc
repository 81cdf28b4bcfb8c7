#include "tool_offset/report/offset_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

#include "document/interval_text.h"
#include "document/json_number.h"
#include "document/page.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

std::string Cell(const Measured& measured) {
  if (!measured.good()) return VerdictText(measured.verdict());
  const Quantity& quantity = measured.quantity();
  return ValueCell(ValueText(quantity.value, quantity.interval95, kOffsetMillimetres),
                   IntervalText(quantity.interval95, kOffsetMillimetres));
}

void AddRow(const OffsetRow& row, Table& table) {
  const Verdict verdict = row.verdict();
  // A tool with one bad axis has no result.
  const bool shown = verdict == Verdict::kGood || row.kind != OffsetRowKind::kTool;
  table.Row({EscapeHtml(row.name), shown ? Cell(row.x) : "–", row.y && shown ? Cell(*row.y) : "–",
             VerdictText(verdict) + (row.remark.empty() ? "" : ", " + row.remark)});
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

/// Returns the lines that set the tools' new offsets, then those that save them: relative to the
/// printer's stored offsets if known, otherwise to 0.
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

/// Counts skipped teeth that were meant to count.
int LeftOut(const to::Structure& structure, const to::StructureReading& reading) {
  return static_cast<int>(std::count_if(
      reading.fingers.begin(), reading.fingers.end(), [&](const to::FingerReading& finger) {
        return !finger.left_out.empty() && finger.finger != structure.incomplete[finger.comb];
      }));
}

/// One line per structure.
std::string StructureLine(const to::Structure& structure, const to::StructureReading& reading) {
  std::string words = OffsetText(reading.offset_mm);
  if (reading.offset_mm.good()) {
    words += fmt::format(", residuals {:.1f} µm rms", reading.residual_rms_mm * kUmPerMm);
  } else {
    words += ": " + reading.offset_mm.reason();
  }
  if (const int count = LeftOut(structure, reading); count > 0) {
    words += fmt::format(", {} {} left out", count, count == 1 ? "tooth" : "teeth");
  }
  return fmt::format("<p class=\"plain\"><b>{}</b> {}</p>\n", EscapeHtml(reading.name),
                     EscapeHtml(words));
}

/// Maximum number of scans drawn at every step: of more the page has only the numbers.
constexpr std::size_t kMaxDrawn = 5;

std::string ScanCards(const OffsetReportInput& input, std::size_t index, std::size_t step) {
  const OffsetScan& scan = input.analysis->scans[index];
  const bool photo = scan.result.photo.has_value();
  const std::string name =
      input.analysis->scans.size() > 1
          ? fmt::format("{} {} (sheet {})", photo ? "Photo" : "Scan", index + 1, scan.sheet)
          : std::string(photo ? "The photo" : "The scan");
  const bool drawn = index < kMaxDrawn || step + 1 < kPhotoSteps.size();
  std::string html =
      Card(name, fmt::format("<p class=\"facts\">{}</p>\n{}", EscapeHtml(ScanFacts(scan)),
                             drawn ? input.pictures[index].html[step] : ""));
  if (drawn) html += Card("", FigureHtml(StructureOffsetsFigure(scan)));
  std::string lines;
  for (const to::StructureReading& reading : scan.result.structures) {
    lines += StructureLine(input.analysis->plan.structures[reading.structure], reading);
  }
  return html + Card("Structures", lines);
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

namespace {

using Json = nlohmann::ordered_json;
using tool_offset::AxisPair;
using tool_offset::CombinedTool;
using tool_offset::FingerReading;
using tool_offset::SheetResult;
using tool_offset::StructureReading;
using tool_offset::ToolReading;

constexpr int kFormat = 1;

Json Value(const Measured& measured) {
  return measured.good() ? Number(measured.quantity().value) : Json(nullptr);
}
Json Uncertainty(const Measured& measured) {
  return measured.good() ? Number(measured.quantity().standard_uncertainty) : Json(nullptr);
}
Json Interval95(const Measured& measured) {
  if (!measured.good()) return nullptr;
  const Interval& interval = measured.quantity().interval95;
  return Json::array({Number(interval.lo), Number(interval.hi)});
}

Json Values(const AxisPair& pair) { return {{"x", Value(pair.x)}, {"y", Value(pair.y)}}; }
Json Uncertainties(const AxisPair& pair) {
  return {{"x", Uncertainty(pair.x)}, {"y", Uncertainty(pair.y)}};
}
Json Intervals(const AxisPair& pair) {
  return {{"x", Interval95(pair.x)}, {"y", Interval95(pair.y)}};
}

Json Tool(const OffsetAnalysis& analysis, const CombinedTool& tool) {
  const bool good = VerdictOf(tool) == Verdict::kGood;
  const auto if_good = [&](Json json) { return good ? std::move(json) : Json(nullptr); };
  return {
      {"tool", tool.tool},
      {"verdict", ToString(VerdictOf(tool))},
      {"reason", ReasonOf(tool)},
      {"dx_mm", if_good(Value(tool.dx_mm))},
      {"dy_mm", if_good(Value(tool.dy_mm))},
      {"standard_uncertainty_mm",
       if_good({{"dx", Uncertainty(tool.dx_mm)}, {"dy", Uncertainty(tool.dy_mm)}})},
      {"interval95_mm", if_good({{"dx", Interval95(tool.dx_mm)}, {"dy", Interval95(tool.dy_mm)}})},
      {"coarse", tool.coarse},
      {"sheets", tool.sheets},
      {"scan_scatter_mm",
       {{"x", Number(tool.scan_scatter_mm.u_mm)}, {"y", Number(tool.scan_scatter_mm.v_mm)}}},
      {"notices", NoticesOf(analysis, tool.tool)}};
}

Json Structure(const StructureReading& structure) {
  Json residuals = Json::array();
  for (const FingerReading& finger : structure.fingers) {
    Json entry = {{"comb", finger.comb}, {"finger", finger.finger}};
    entry["residual_mm"] = finger.left_out.empty() ? Number(finger.residual_mm) : Json(nullptr);
    if (!finger.left_out.empty()) entry["left_out"] = finger.left_out;
    residuals.push_back(std::move(entry));
  }
  return {{"name", structure.name},
          {"verdict", ToString(structure.offset_mm.verdict())},
          {"reason", structure.offset_mm.reason()},
          {"offset_mm", Value(structure.offset_mm)},
          {"expected_mm", structure.expected_mm ? Number(*structure.expected_mm) : Json(nullptr)},
          {"standard_uncertainty_mm", Uncertainty(structure.offset_mm)},
          {"residual_rms_mm", Number(structure.residual_rms_mm)},
          {"teeth_used", structure.teeth_used},
          {"channels", structure.channel},
          {"residuals", std::move(residuals)}};
}

/// Describes a photo's camera; null for a scan.
Json Photo(const SheetResult& result) {
  if (!result.photo) return nullptr;
  constexpr double kDegrees = 180 / std::numbers::pi;
  const tool_offset::PhotoOnPage& photo = *result.photo;
  return {{"px_per_mm", Number(photo.px_per_mm)},
          {"blur_px", Number(photo.blur_px)},
          {"tilt_deg", Number(photo.pose.tilt_rad * kDegrees)},
          {"height_mm", Number(photo.pose.height_mm)},
          {"focal_px", Number(photo.pose.focal_px)},
          {"focal_stated", photo.pose.focal_stated},
          {"assumed_height_mm", Number(photo.spread.height_mm)},
          {"assumed_colour_px", Number(photo.spread.colour_px)},
          {"rms_mm", Number(photo.rms_mm)}};
}

Json Scan(const OffsetScan& scan) {
  const SheetResult& result = scan.result;
  Json structures = Json::array();
  for (const StructureReading& structure : result.structures) {
    structures.push_back(Structure(structure));
  }
  constexpr double kDegrees = 180 / std::numbers::pi;
  return {{"source", scan.source},
          {"page", scan.page},
          {"sheet", scan.sheet},
          {"angle_deg", Number(result.sheet.angle_rad * kDegrees)},
          {"dpi", {{"x", Number(result.page_dpi_x)}, {"y", Number(result.page_dpi_y)}}},
          {"photo", Photo(result)},
          {"finger_scatter_mm", Number(result.finger_scatter_mm)},
          {"chi_square_per_freedom", Number(result.chi_square_per_freedom)},
          {"notices", result.notices},
          {"structures", std::move(structures)}};
}

// Lists each scan separately: repeats on one sheet show the tool's coupling.
Json PickUps(const OffsetAnalysis& analysis) {
  Json list = Json::array();
  for (const OffsetScan& scan : analysis.scans) {
    for (const tool_offset::PickUpReading& reading : scan.result.pick_ups) {
      list.push_back({{"tool", reading.tool},
                      {"pick_up", reading.pick_up},
                      {"source", scan.source},
                      {"dx_mm", Value(reading.dx_mm)},
                      {"dy_mm", Value(reading.dy_mm)},
                      {"interval95_mm",
                       {{"dx", Interval95(reading.dx_mm)}, {"dy", Interval95(reading.dy_mm)}}}});
    }
  }
  return list;
}

Json SelfTests(const OffsetAnalysis& analysis) {
  Json list = Json::array();
  for (const OffsetScan& scan : analysis.scans) {
    for (const tool_offset::SelfTestReading& reading : scan.result.self_tests) {
      list.push_back({{"name", reading.name},
                      {"source", scan.source},
                      {"verdict", ToString(reading.recovered_mm.verdict())},
                      {"reason", reading.recovered_mm.reason()},
                      {"programmed_mm", Number(reading.programmed_mm)},
                      {"recovered_mm", Value(reading.recovered_mm)},
                      {"standard_uncertainty_mm", Uncertainty(reading.recovered_mm)},
                      {"interval95_mm", Interval95(reading.recovered_mm)}});
    }
  }
  return list;
}

Json Scale(const AxisPair& px_per_mm) {
  Json scale = {{"unit", "px/mm"}};
  scale["x"] = Value(px_per_mm.x);
  scale["y"] = Value(px_per_mm.y);
  const bool both = px_per_mm.x.good() && px_per_mm.y.good();
  scale["x_over_y"] =
      both ? Number(px_per_mm.x.quantity().value / px_per_mm.y.quantity().value) : Json(nullptr);
  return scale;
}

Json RefusedScans(const OffsetAnalysis& analysis) {
  Json list = Json::array();
  for (const RefusedScan& scan : analysis.refused) {
    list.push_back({{"source", scan.source}, {"reason", scan.reason}});
  }
  return list;
}

}  // namespace

Json JsonOf(const OffsetAnalysis& analysis, const std::string& report) {
  const tool_offset::CombinedResult& combined = analysis.combined;
  Json json = Json::object();
  json["format"] = kFormat;
  json["verdict"] = ToString(VerdictOf(analysis));
  json["reason"] = ReasonOf(analysis);
  json["sheet_id"] = analysis.plan.original ? Json(nullptr) : Json(analysis.plan.sheet_id);
  json["reference_tool"] = analysis.plan.settings.reference_tool;
  json["tools"] = Json::array();
  for (const CombinedTool& tool : combined.tools) json["tools"].push_back(Tool(analysis, tool));
  json["backlash_mm"] = Values(combined.backlash_mm);
  json["backlash_standard_uncertainty_mm"] = Uncertainties(combined.backlash_mm);
  json["backlash_interval95_mm"] = Intervals(combined.backlash_mm);
  json["scale"] = Scale(combined.px_per_mm);
  json["control_bias_mm"] = Values(combined.control_bias_mm);
  json["control_bias_standard_uncertainty_mm"] = Uncertainties(combined.control_bias_mm);
  json["pick_ups"] = PickUps(analysis);
  json["self_tests"] = SelfTests(analysis);
  json["notices"] = NoticesOf(analysis);
  json["scans"] = Json::array();
  for (const OffsetScan& scan : analysis.scans) json["scans"].push_back(Scan(scan));
  json["refused_scans"] = RefusedScans(analysis);
  json["report"] = report.empty() ? Json(nullptr) : Json(report);
  return json;
}

Json RefusalJson(const OffsetAnalysis& analysis) {
  const std::string reason = ReasonOf(analysis);
  OffsetAnalysis refused{analysis.plan, {}, {}, analysis.refused};
  const Measured nothing = Measured::Refused(reason);
  for (const int tool : analysis.plan.settings.tools) {
    if (tool == analysis.plan.settings.reference_tool) continue;
    refused.combined.tools.push_back({tool, nothing, nothing, false, 0, {}});
  }
  const AxisPair none{nothing, nothing};
  refused.combined.backlash_mm = refused.combined.control_bias_mm = none;
  refused.combined.px_per_mm = none;
  return JsonOf(refused);
}

}  // namespace trammel::report
