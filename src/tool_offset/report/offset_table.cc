#include "tool_offset/report/offset_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <set>

#include "document/interval_text.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

void AddOnce(const std::string& text, std::vector<std::string>& texts) {
  if (!text.empty() && std::find(texts.begin(), texts.end(), text) == texts.end()) {
    texts.push_back(text);
  }
}

Verdict Worse(Verdict a, Verdict b) {
  for (const Verdict worst : {Verdict::kRefused, Verdict::kCannotTell}) {
    if (a == worst || b == worst) return worst;
  }
  return Verdict::kGood;
}

/// Returns the reasons of both axes, once if both have the same.
std::string Joined(const Measured& x, const Measured& y) {
  if (x.reason().empty() || x.reason() == y.reason()) return y.reason();
  return y.reason().empty() ? x.reason() : x.reason() + "; " + y.reason();
}

std::string Mm(const Measured& measured) {
  if (!measured.good()) return fmt::format("unknown ({})", measured.reason());
  return WithInterval(measured.quantity(), kOffsetMillimetres);
}

std::string RowText(const OffsetRow& row) {
  const std::string remark = row.remark.empty() ? "" : "   " + row.remark;
  std::string text;
  if (row.kind == OffsetRowKind::kTool && row.verdict() != Verdict::kGood) {
    text = fmt::format("{:<12} {}: {}\n", row.name, ToString(row.verdict()), row.reason());
  } else if (!row.y) {
    text = fmt::format("{:<12} {}\n", row.name, Mm(row.x));
  } else {
    const bool offset = row.kind == OffsetRowKind::kTool || row.kind == OffsetRowKind::kPickUp;
    const char* const d = offset ? "d" : "";
    text = fmt::format("{:<12} {}x {}{}\n{:<12} {}y {}\n", row.name, d, Mm(row.x), remark, "", d,
                       Mm(*row.y));
  }
  for (const std::string& notice : row.notices) {
    text += fmt::format("{:<12} notice: {}\n", "", notice);
  }
  return text;
}

}  // namespace

Verdict VerdictOf(const OffsetAnalysis& analysis) {
  Verdict verdict = analysis.scans.empty() ? Verdict::kRefused : Verdict::kGood;
  for (const to::CombinedTool& tool : analysis.combined.tools) {
    verdict = Worse(verdict, VerdictOf(tool));
  }
  for (const OffsetScan& scan : analysis.scans) {
    for (const auto& reading : scan.result.self_tests) {
      verdict = Worse(verdict, reading.recovered_mm.verdict());
    }
  }
  return verdict;
}

std::string ReasonOf(const OffsetAnalysis& analysis) {
  std::vector<std::string> reasons;
  for (const to::CombinedTool& tool : analysis.combined.tools) AddOnce(ReasonOf(tool), reasons);
  for (const OffsetScan& scan : analysis.scans) {
    for (const auto& reading : scan.result.self_tests) {
      AddOnce(reading.recovered_mm.reason(), reasons);
    }
  }
  if (analysis.scans.empty()) {
    for (const RefusedScan& scan : analysis.refused) AddOnce(scan.reason, reasons);
  }
  return fmt::format("{}", fmt::join(reasons, "; "));
}

Verdict VerdictOf(const to::CombinedTool& tool) {
  return Worse(tool.dx_mm.verdict(), tool.dy_mm.verdict());
}

std::string ReasonOf(const to::CombinedTool& tool) { return Joined(tool.dx_mm, tool.dy_mm); }

std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis, int tool) {
  std::vector<std::string> notices;
  for (const OffsetScan& scan : analysis.scans) {
    for (const to::ToolReading& reading : scan.result.tools) {
      if (reading.tool == tool) AddOnce(reading.notice, notices);
    }
  }
  return notices;
}

std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis) {
  std::vector<std::string> notices;
  for (const OffsetScan& scan : analysis.scans) {
    for (const std::string& notice : scan.result.notices) AddOnce(notice, notices);
  }
  return notices;
}

Verdict OffsetRow::verdict() const { return y ? Worse(x.verdict(), y->verdict()) : x.verdict(); }

std::string OffsetRow::reason() const { return y ? Joined(x, *y) : x.reason(); }

std::vector<OffsetRow> OffsetTable(const OffsetAnalysis& analysis) {
  using enum OffsetRowKind;
  std::vector<OffsetRow> rows;
  for (const to::CombinedTool& tool : analysis.combined.tools) {
    rows.push_back({kTool, fmt::format("T{}", tool.tool), tool.dx_mm, tool.dy_mm,
                    tool.coarse ? "coarse" : "", NoticesOf(analysis, tool.tool)});
  }
  for (const OffsetScan& scan : analysis.scans) {
    for (const to::SelfTestReading& reading : scan.result.self_tests) {
      rows.push_back({kSelfTest,
                      fmt::format("{}, {:+.2f} mm", reading.name, reading.programmed_mm),
                      reading.recovered_mm,
                      {},
                      "",
                      {}});
    }
    for (const to::PickUpReading& reading : scan.result.pick_ups) {
      rows.push_back({kPickUp,
                      fmt::format("T{} pick-up {}", reading.tool, reading.pick_up),
                      reading.dx_mm,
                      reading.dy_mm,
                      "",
                      {}});
    }
  }
  const to::CombinedResult& combined = analysis.combined;
  rows.push_back({kBacklash, "backlash", combined.backlash_mm.x, combined.backlash_mm.y, "", {}});
  rows.push_back(
      {kBias, "method bias", combined.control_bias_mm.x, combined.control_bias_mm.y, "", {}});
  return rows;
}

std::string ScanFacts(const OffsetScan& scan) {
  const std::string page = scan.page > 1 ? fmt::format(", page {}", scan.page) : "";
  const std::string scatter =
      fmt::format("lines scatter by {:.1f} µm", scan.result.finger_scatter_mm * kUmPerMm);
  if (!scan.result.photo) {
    return fmt::format("scan {}{}: {:.1f} x {:.1f} dpi, {}", scan.source, page,
                       scan.result.page_dpi_x, scan.result.page_dpi_y, scatter);
  }
  const to::PhotoOnPage& photo = *scan.result.photo;
  return fmt::format(
      "photo {}{}: {:.1f} px/mm, {:.0f} degrees aslant from {:.0f} mm above, blurred by {:.1f} px, "
      "{}",
      scan.source, page, photo.px_per_mm, photo.pose.tilt_rad * 180 / std::numbers::pi,
      photo.pose.height_mm, photo.blur_px, scatter);
}

std::string SheetName(const to::SheetPlan& plan) {
  return plan.original ? "sheet of the original generator" : fmt::format("sheet {}", plan.sheet_id);
}

std::string OffsetText(const OffsetAnalysis& analysis, const std::string& report) {
  std::set<int> sheets;
  for (const OffsetScan& scan : analysis.scans) sheets.insert(scan.sheet);
  std::string text = fmt::format("pattern      {}, T{} is the reference; scans: {}, sheets: {}\n",
                                 SheetName(analysis.plan), analysis.plan.settings.reference_tool,
                                 analysis.scans.size(), sheets.size());
  for (const OffsetRow& row : OffsetTable(analysis)) text += RowText(row);
  text += fmt::format(
      "sign         dx and dy are where a tool's lines land minus where T{}'s would, along the "
      "bed's axes\n",
      analysis.plan.settings.reference_tool);
  for (const OffsetScan& scan : analysis.scans) text += ScanFacts(scan) + "\n";
  for (const std::string& notice : NoticesOf(analysis)) {
    text += fmt::format("notice       {}\n", notice);
  }
  if (!report.empty()) text += fmt::format("report       {}\n", report);
  return text;
}

std::string OffsetText(const Measured& measured) {
  return measured.good() ? WithInterval(measured.quantity(), kOffsetMillimetres)
                         : VerdictText(measured.verdict());
}

}  // namespace trammel::report
