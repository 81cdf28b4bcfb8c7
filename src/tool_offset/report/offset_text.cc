#include "tool_offset/report/offset_text.h"

#include <fmt/format.h>

#include <numbers>
#include <set>

#include "document/interval_text.h"

namespace trammel::report {
namespace {

using tool_offset::AxisPair;
using tool_offset::CombinedTool;

std::string Mm(const Measured& measured) {
  if (!measured.good()) return fmt::format("unknown ({})", measured.reason());
  return WithInterval(measured.quantity(), kOffsetMillimetres);
}

std::string ToolLine(const OffsetAnalysis& analysis, const CombinedTool& tool) {
  std::string text;
  if (VerdictOf(tool) == Verdict::kGood) {
    text = fmt::format("  T{:<4} dx {}{}\n        dy {}\n", tool.tool, Mm(tool.dx_mm),
                       tool.coarse ? "   coarse" : "", Mm(tool.dy_mm));
  } else {
    text = fmt::format("  T{:<4} {}: {}\n", tool.tool, ToString(VerdictOf(tool)), ReasonOf(tool));
  }
  for (const std::string& notice : NoticesOf(analysis, tool.tool)) {
    text += fmt::format("        notice: {}\n", notice);
  }
  return text;
}

std::string ScanLine(const OffsetScan& scan) {
  const double scatter_um = scan.result.finger_scatter_mm * kUmPerMm;
  if (!scan.result.photo) {
    return fmt::format("scan         {}: {:.1f} x {:.1f} dpi, lines scatter by {:.1f} µm\n",
                       scan.source, scan.result.page_dpi_x, scan.result.page_dpi_y, scatter_um);
  }
  const tool_offset::PhotoOnPage& photo = *scan.result.photo;
  constexpr double kDegrees = 180 / std::numbers::pi;
  return fmt::format(
      "photo        {}: {:.1f} px/mm, {:.0f} degrees aslant from {:.0f} mm above, blurred by "
      "{:.1f} px, lines scatter by {:.1f} µm\n",
      scan.source, photo.px_per_mm, photo.pose.tilt_rad * kDegrees, photo.pose.height_mm,
      photo.blur_px, scatter_um);
}

std::string PairLine(const char* label, const AxisPair& pair) {
  return fmt::format("{}x {}\n             y {}\n", label, Mm(pair.x), Mm(pair.y));
}

std::string SelfTests(const OffsetAnalysis& analysis) {
  std::string text;
  for (const OffsetScan& scan : analysis.scans) {
    for (const tool_offset::SelfTestReading& reading : scan.result.self_tests) {
      text += fmt::format("self-test    {}: {:+.4f} mm programmed, {} recovered\n", reading.name,
                          reading.programmed_mm, Mm(reading.recovered_mm));
    }
    for (const tool_offset::PickUpReading& reading : scan.result.pick_ups) {
      text += fmt::format("picked up    T{} for the {}. time: dx {}, dy {}\n", reading.tool,
                          reading.pick_up + 1, Mm(reading.dx_mm), Mm(reading.dy_mm));
    }
  }
  return text;
}

std::string Next(const OffsetAnalysis& analysis) {
  bool coarse = false;
  bool bad = false;
  for (const CombinedTool& tool : analysis.combined.tools) {
    coarse = coarse || tool.coarse;
    bad = bad || VerdictOf(tool) != Verdict::kGood;
  }
  std::string text;
  if (!analysis.combined.tools.empty()) {
    text = fmt::format(
        "next         dx and dy are where a tool's lines land minus where T{}'s would: with "
        "--result FILE,\n"
        "             trammel offset apply FILE shows the commands that take them out.\n"
        "             Then print another sheet and look for zero.\n",
        analysis.plan.settings.reference_tool);
  }
  if (coarse) text += "             Coarse values first: they are good enough to print again.\n";
  if (bad) text += "             Tools without a value keep the offset that they have.\n";
  return text;
}

}  // namespace

std::string OffsetAnswer(const OffsetAnalysis& analysis, const std::string& report) {
  std::set<int> sheets;
  for (const OffsetScan& scan : analysis.scans) sheets.insert(scan.sheet);
  const std::string sheet = analysis.plan.original ? "of the original generator"
                                                   : fmt::format("{}", analysis.plan.sheet_id);
  std::string text =
      fmt::format("pattern      {}, T{} is the reference; scans: {}, sheets: {}\n", sheet,
                  analysis.plan.settings.reference_tool, analysis.scans.size(), sheets.size());
  for (const CombinedTool& tool : analysis.combined.tools) text += ToolLine(analysis, tool);
  text += SelfTests(analysis);
  text += PairLine("backlash     ", analysis.combined.backlash_mm);
  text += PairLine("method bias  ", analysis.combined.control_bias_mm);
  for (const OffsetScan& scan : analysis.scans) {
    text += ScanLine(scan);
  }
  for (const std::string& notice : NoticesOf(analysis)) {
    text += fmt::format("notice       {}\n", notice);
  }
  if (!report.empty()) text += fmt::format("report       {}\n", report);
  return text;
}

std::string OffsetText(const OffsetAnalysis& analysis, const std::string& report) {
  return OffsetAnswer(analysis, report) + Next(analysis);
}

}  // namespace trammel::report
