#include "tool_offset/report/offset_json.h"

#include <nlohmann/json.hpp>
#include <numbers>

#include "document/json_number.h"

namespace trammel::report {
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

/// How a photo was taken; null of a scan.
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

// Of every scan by itself: what recurs on one sheet says how well the tool couples.
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
