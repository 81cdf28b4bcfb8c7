#include "pressure_advance/commands/conditions_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "app/commands.h"
#include "app/output_files.h"
#include "base/json_text.h"
#include "base/measured_json.h"
#include "base/square.h"
#include "document/interval_text.h"
#include "files/whole_file.h"
#include "gcode/bead.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/files/orca_profile.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/plate_layout.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::FlowTable;
using pressure_advance::PatternConditions;
using pressure_advance::PatternConfig;
using Json = nlohmann::ordered_json;

constexpr const char* kOption = "--speeds and --accelerations";

std::string DescribeConditions(const PatternConditions& at) {
  return fmt::format("{:g} mm/s at {:g} mm/s2", at.fast_speed_mm_s, at.acceleration_mm_s2);
}

Result<void> CheckNumbers(const char* option, const std::vector<double>& values) {
  for (const double value : values) {
    if (!(value > 0 && std::isfinite(value))) {
      return Fail(fmt::format("{} {}: it must be a number above 0", option, value));
    }
    if (std::ranges::count(values, value) > 1) {
      return Fail(fmt::format("{} names {:g} twice", option, value));
    }
  }
  return {};
}

Result<void> CheckSpeeds(const AskedConditions& asked, const std::vector<double>& speeds_mm_s,
                         const PatternConfig& pattern) {
  double slow_mm_s = 0;
  for (const auto& segment : pattern.segments) {
    if (segment.speed_mm_s < FastSpeed_mm_s(pattern)) {
      slow_mm_s = std::max(slow_mm_s, segment.speed_mm_s);
    }
  }
  const double bead_mm2 = gcode::BeadArea_mm2(pattern.line_width_mm, pattern.layer_height_mm);
  for (const double speed_mm_s : speeds_mm_s) {
    if (speed_mm_s <= slow_mm_s) {
      return Fail(
          fmt::format("--speeds {:g}: a line's fast stretch must be faster than its slow "
                      "ones, {:g} mm/s",
                      speed_mm_s, slow_mm_s));
    }
    const double flow_mm3_s = speed_mm_s * bead_mm2;
    if (asked.max_flow_mm3_s && flow_mm3_s > *asked.max_flow_mm3_s) {
      return Fail(
          fmt::format("{:g} mm/s take {:.2f} mm3/s, and the hot end melts {:g} (--max-flow): "
                      "at most {:.0f} mm/s",
                      speed_mm_s, flow_mm3_s, *asked.max_flow_mm3_s,
                      std::floor(*asked.max_flow_mm3_s / bead_mm2)),
          ErrorKind::kSafety);
    }
  }
  return {};
}

// Result of a pattern.
struct Row {
  PatternConditions at;
  fs::path folder;
  Measured pressure_advance;
};

Measured AnswerOf(const Result<AnalysisRun>& run) {
  return run ? run->analysis.pressure_advance : Measured::Refused(run.error().message);
}

std::vector<Row> AnalyseAll(const ConditionsRun& run, const std::vector<fs::path>& folders,
                            const measurement::Subject& subject) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    const auto analysed = AnalyseRecording(folders[i]);
    rows.push_back({run.config.pattern.conditions[i], folders[i], AnswerOf(analysed)});
    if (!analysed) continue;
    ResultFile result = ResultOf(analysed->analysis, folders[i].string());
    result.outcome.subject = subject;
    if (auto kept = KeepAnalysis(*analysed, result, KeptIn(folders[i], run.json)); !kept) {
      (void)PrintError(kept.error());
    }
  }
  return rows;
}

Json JsonOf(const std::vector<Row>& rows, const std::optional<FlowTable>& table) {
  Json patterns = Json::array();
  for (const Row& row : rows) {
    patterns.push_back({{"folder", row.folder.string()},
                        {"fast_speed_mm_s", row.at.fast_speed_mm_s},
                        {"acceleration_mm_s2", row.at.acceleration_mm_s2},
                        {"pressure_advance_s", MeasuredJson(row.pressure_advance)}});
  }
  return {{"format", 1},
          {"patterns", std::move(patterns)},
          {"table", table ? TableJson(*table) : Json(nullptr)},
          {"orca_adaptive_model",
           table ? Json(files::AdaptiveModel(AdaptiveRows(*table))) : Json(nullptr)}};
}

void PrintRows(const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    const Measured& answer = row.pressure_advance;
    fmt::print("{:<24} {}\n", DescribeConditions(row.at),
               answer.good()
                   ? report::WithInterval(answer.quantity(), report::kSeconds)
                   : fmt::format("{}: {}", VerdictText(answer.verdict()), answer.reason()));
  }
}

void PrintFlowTable(const FlowTable& table, double filament_diameter_mm, const fs::path& folder) {
  PrintTable(table, filament_diameter_mm);
  const auto adaptive = AdaptiveRows(table);
  if (!adaptive.empty()) {
    fmt::print(
        "OrcaSlicer        its adaptive pressure advance in {:.3g} mm layers, value, flow, "
        "acceleration:\n{}\n",
        fmt::join(LayerHeights_mm(adaptive), ""), files::AdaptiveModel(adaptive));
    fmt::print("into its profile  trammel pa table {}/*/ --orca PROFILE -o NEW_PROFILE\n",
               folder.string());
  }
  fmt::print("nothing applied   trammel pa apply {:.4f}\n", table.single_s.value);
}

Result<int> PrintConditions(const ConditionsRun& run, const std::vector<Row>& rows,
                            const fs::path& folder) {
  std::vector<std::string> good;
  for (const Row& row : rows) {
    if (row.pressure_advance.good()) good.push_back(row.folder.string());
  }
  std::optional<FlowTable> table;
  if (!good.empty()) table = TRY(TableOf(good));
  if (run.json) {
    fmt::print("{}", JsonText(JsonOf(rows, table)));
  } else {
    PrintRows(rows);
    if (table) PrintFlowTable(*table, run.config.pattern.filament_diameter_mm, folder);
  }
  return good.size() == rows.size() ? kExitGood : kExitNotTrusted;
}

}  // namespace

Result<std::vector<PatternConditions>> CombineConditions(const AskedConditions& asked,
                                                         const PatternConfig& pattern) {
  for (const auto& [option, values] : {std::pair{"--speeds", &asked.speeds_mm_s},
                                       {"--accelerations", &asked.accelerations_mm_s2}}) {
    TRY(CheckNumbers(option, *values));
  }
  if (asked.max_flow_mm3_s && !(*asked.max_flow_mm3_s > 0)) {
    return Fail(fmt::format("--max-flow {}: it must be a number above 0", *asked.max_flow_mm3_s));
  }
  const std::vector<double> speeds_mm_s =
      asked.speeds_mm_s.empty() ? std::vector{FastSpeed_mm_s(pattern)} : asked.speeds_mm_s;
  const std::vector<double> accelerations_mm_s2 = asked.accelerations_mm_s2.empty()
                                                      ? std::vector{pattern.acceleration_mm_s2}
                                                      : asked.accelerations_mm_s2;
  const std::size_t count = speeds_mm_s.size() * accelerations_mm_s2.size();
  if (count < procedure::kFewestPatterns || count > procedure::kMaxPatterns) {
    return Fail(fmt::format("{} make {} combination(s); a plate has {} to {}", kOption, count,
                            procedure::kFewestPatterns, procedure::kMaxPatterns));
  }
  TRY(CheckSpeeds(asked, speeds_mm_s, pattern));
  std::vector<PatternConditions> conditions;
  for (const double acceleration_mm_s2 : accelerations_mm_s2) {
    for (const double speed_mm_s : speeds_mm_s) {
      conditions.push_back({speed_mm_s, acceleration_mm_s2});
    }
  }
  return conditions;
}

Result<PatternConfig> LayConditions(const std::vector<PatternConditions>& conditions,
                                    const files::Config& config, const procedure::Reach& reach) {
  auto laid = procedure::PatternsBeside(config.pattern, static_cast<int>(conditions.size()),
                                        config.scan, reach, kOption);
  if (!laid) return laid;
  laid->conditions = conditions;
  TRY(Validate(*laid));
  const auto layout = LayOut(*laid);
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    const auto sweeps = procedure::PlanSweeps(PlanOfPattern(layout, *laid, static_cast<int>(i), ""),
                                              {}, config.scan, reach);
    if (!sweeps) {
      return Fail(fmt::format("{}: {}", DescribeConditions(conditions[i]), sweeps.error().message),
                  sweeps.error().kind);
    }
  }
  return laid;
}

Result<int> RunConditions(const ConditionsRun& run, const procedure::Session& session) {
  const auto folder = TRY(NewFolder::Make(run.out));
  auto request = RequestFor(run.config, folder.path());
  std::vector<NewFolder> parts;
  for (const PatternConditions& at : run.config.pattern.conditions) {
    auto part =
        TRY(NewFolder::Make(folder.path() / fmt::format("{:g}mm_s-{:g}mm_s2", at.fast_speed_mm_s,
                                                        at.acceleration_mm_s2)));
    request.folders.push_back(part.path());
    parts.push_back(std::move(part));
  }
  request.filament = run.filament;
  const MachineTime time = MachineTimeOf(request.pattern, request.settings);
  session.Report(fmt::format("{} patterns; print {:.0f} s and scan {:.0f} s, heating apart",
                             request.folders.size(), time.print.total_s(),
                             time.scan ? time.scan->total_s() : 0));
  const auto spool = SpoolNow(session, run.filament.empty());
  const CalibrationRun ran = CalibrateInto(session, request);
  if (!ran.done) return tl::unexpected(ran.done.error());
  const auto subject = SubjectOf(run.filament, session, run.config, spool);
  const auto rows = AnalyseAll(run, request.folders, subject);
  const auto code = PrintConditions(run, rows, folder.path());
  if (!run.keep_full) CutRecordings(request.folders, session.stop);
  return code;
}

namespace {

using pressure_advance::AdvanceForm;
using pressure_advance::AdvanceModel;
using pressure_advance::FlowPoint;
using pressure_advance::FlowTrend;

constexpr std::size_t kMaxPlanBytes = 4'000'000;

struct Calibration {
  FlowPoint point;
  measurement::Subject subject;
  std::string fingerprint;
};

/// Returns the answer of a recording, with the flows and the acceleration of its plan.
Result<Calibration> CalibrationOf(const fs::path& folder) {
  const auto answer = KeptPressureAdvance(folder);
  if (!answer) return tl::unexpected(answer.error());
  const fs::path file = folder / "pattern.plan.json";
  const auto text = TRY(files::ReadNamedFile(file, kMaxPlanBytes));
  const auto plan = TRY(files::ParsePlan(text, file.string()));
  const auto [slow, fast] = std::ranges::minmax(
      plan.segments, {}, [](const pressure_advance::Segment& s) { return s.speed_mm_s; });
  if (!(plan.layer_height_mm > 0 && plan.layer_height_mm <= plan.line_width_mm)) {
    return Fail(
        fmt::format("{}: a bead {} mm wide and {} mm high has no flow: it must be as wide as "
                    "high at least",
                    file.string(), plan.line_width_mm, plan.layer_height_mm));
  }
  const double area_mm2 = gcode::BeadArea_mm2(plan.line_width_mm, plan.layer_height_mm);
  FlowPoint point;
  point.flow_mm3_s = fast.speed_mm_s * area_mm2;
  point.slow_flow_mm3_s = slow.speed_mm_s * area_mm2;
  point.acceleration_mm_s2 = plan.acceleration_mm_s2;
  point.layer_height_mm = plan.layer_height_mm;
  point.pressure_advance_s = *answer->measured;
  return Calibration{point, answer->result->subject, files::Fingerprint(*answer->result)};
}

/// Checks that both may be rows of one table, as far as known.
Result<void> CheckSameSubject(const measurement::Subject& first, const measurement::Subject& other,
                              const std::string& folder) {
  const auto differ = [](const std::string& a, const std::string& b) {
    return !a.empty() && !b.empty() && a != b;
  };
  if (differ(first.filament, other.filament)) {
    return Fail(
        fmt::format("{}: is of the filament '{}', and an earlier one of '{}': a table is "
                    "of one filament",
                    folder, other.filament, first.filament));
  }
  if (differ(first.nozzle, other.nozzle) || differ(first.printer, other.printer)) {
    return Fail(
        fmt::format("{}: is of nozzle {} mm on {}, and an earlier one of {} mm on {}: a "
                    "table is of one nozzle on one printer",
                    folder, other.nozzle, other.printer, first.nozzle, first.printer));
  }
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    const bool of_the_table =
        text == &measurement::Subject::toolhead || text == &measurement::Subject::nozzle_c;
    if (of_the_table && differ(first.*text, other.*text)) {
      return Fail(fmt::format("{}: is of {} {}, and an earlier one of {}: a table is of one {}",
                              folder, words, other.*text, first.*text, words));
    }
  }
  return {};
}

/// Adopts the texts that are still missing.
void Complete(measurement::Subject& subject, const measurement::Subject& other) {
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    if ((subject.*text).empty()) subject.*text = other.*text;
  }
}

std::string TrendText(const FlowTrend& trend, const std::string& unit) {
  if (!trend.per_unit.good()) return "not known: " + trend.per_unit.reason();
  constexpr int kDecimals = 5;
  report::IntervalStyle style{unit, 1, kDecimals, true};
  return fmt::format("{}{}", report::WithInterval(trend.per_unit.quantity(), style),
                     trend.significant ? "" : ", which is no change that could be seen");
}

// Returns Kalico's name of the model.
const char* ModelOf(AdvanceForm form) { return form == AdvanceForm::kTanh ? "tanh" : "recipr"; }

Json LawJson(const std::optional<AdvanceModel>& law) {
  if (!law) return nullptr;
  return {{"model", ModelOf(law->form)},
          {"linear_s", law->linear_s},
          {"offset_mm3", law->offset_mm3},
          {"knee_mm3_s", law->shape},
          {"knee_interval95_mm3_s", {law->shape95.lo, law->shape95.hi}}};
}

std::string_view WordsOfBend(const pressure_advance::AdvanceModels& laws) {
  if (!laws.bends) return ": one value is as right at all flows, as far as can be seen";
  return laws.exponent.quantity().value < 1 ? ": the faster, the less pressure advance"
                                            : ": the faster, the more pressure advance";
}

void PrintLaws(const FlowTable& table, double filament_diameter_mm) {
  const pressure_advance::AdvanceModels& laws = table.laws;
  const Measured& exponent = laws.exponent;
  if (!exponent.good()) {
    fmt::print("law of flow       not known: {}\n", exponent.reason());
    return;
  }
  fmt::print("law of flow       filament stored as flow to the power of {}{}{}\n",
             report::WithInterval(exponent.quantity(), {"", 1, 2}), WordsOfBend(laws),
             table.laws_acceleration_mm_s2
                 ? fmt::format("; at {:.0f} mm/s2{} alone", *table.laws_acceleration_mm_s2,
                               table.laws_layer_height_mm ? fmt::format(" and {:.3g} mm layers",
                                                                        *table.laws_layer_height_mm)
                                                          : "")
                 : "");
  if (!laws.firmware) {
    if (laws.bends && exponent.quantity().value < 1) {
      fmt::print(
          "non-linear        a third fast speed would tell what firmware that has it wants\n");
    }
    return;
  }
  const AdvanceModel& law = *laws.firmware;
  const double area_mm2 = std::numbers::pi / 4 * Square(filament_diameter_mm);
  fmt::print(
      "non-linear        as firmware that has it (Kalico) is told for {:.2f} mm filament; misses a "
      "row's own by up to {:.4f} s:\n"
      "pressure_advance_model: {}\nlinear_advance: {:.4f}\nnonlinear_offset: {:.4f}\n"
      "linearization_velocity: {:.3f}\n"
      "                  a velocity of {:.3f} to {:.3f} fits as well, with another offset\n",
      filament_diameter_mm, laws.greatest_miss_s, ModelOf(law.form), law.linear_s,
      law.offset_mm3 / area_mm2, law.shape / area_mm2, law.shape95.lo / area_mm2,
      law.shape95.hi / area_mm2);
}

}  // namespace

Result<FlowTable> TableOf(const std::vector<std::string>& recordings,
                          std::optional<double> layer_height_mm) {
  std::vector<FlowPoint> points;
  measurement::Subject subject;
  std::map<std::string, std::string> taken;  // fingerprint, folder
  for (const std::string& recording : recordings) {
    const auto calibration = TRY(CalibrationOf(recording));
    const auto [first, fresh] = taken.emplace(calibration.fingerprint, recording);
    if (!fresh) {
      return Fail(fmt::format("{}: is the same calibration as {}: name each once", recording,
                              first->second));
    }
    TRY(CheckSameSubject(subject, calibration.subject, recording));
    Complete(subject, calibration.subject);
    points.push_back(calibration.point);
  }
  if (layer_height_mm) {
    const auto heights_mm = pressure_advance::LayerHeights_mm(points);
    std::erase_if(
        points, [&](const FlowPoint& point) { return !IsOfLayerHeight(point, *layer_height_mm); });
    if (points.empty()) {
      return Fail(fmt::format("--layer-height {}: the calibrations are of layers of {:.3g} mm",
                              *layer_height_mm, fmt::join(heights_mm, " and ")));
    }
  }
  return pressure_advance::MakeFlowTable(std::move(points));
}

Json TableJson(const FlowTable& table) {
  Json rows = Json::array();
  for (const FlowPoint& row : table.rows) {
    const Interval& interval = row.pressure_advance_s.interval95;
    rows.push_back({{"flow_mm3_s", row.flow_mm3_s},
                    {"acceleration_mm_s2", row.acceleration_mm_s2},
                    {"layer_height_mm", row.layer_height_mm ? Json(*row.layer_height_mm) : Json()},
                    {"calibrations", row.count},
                    {"pressure_advance_s", row.pressure_advance_s.value},
                    {"standard_uncertainty_s", row.pressure_advance_s.standard_uncertainty},
                    {"interval95_s", {interval.lo, interval.hi}}});
  }
  return {{"format", 1},
          {"rows", rows},
          {"single_s", MeasuredJson(Measured::Good(table.single_s))},
          {"greatest_miss_s", table.greatest_miss_s},
          {"change_per_mm3_s", MeasuredJson(table.over_flow.per_unit)},
          {"change_per_doubled_acceleration_s", MeasuredJson(table.over_acceleration.per_unit)},
          {"exponent", MeasuredJson(table.laws.exponent)},
          {"bends", table.laws.bends},
          {"law_acceleration_mm_s2",
           table.laws_acceleration_mm_s2 ? Json(*table.laws_acceleration_mm_s2) : Json(nullptr)},
          {"law_layer_height_mm",
           table.laws_layer_height_mm ? Json(*table.laws_layer_height_mm) : Json(nullptr)},
          {"firmware_law", LawJson(table.laws.firmware)},
          {"notices", table.notices}};
}

void PrintTable(const FlowTable& table, double filament_diameter_mm) {
  fmt::print("  flow       acceleration   layer    pressure advance\n");
  for (const FlowPoint& row : table.rows) {
    fmt::print("{:6.2f} mm3/s {:7.0f} mm/s2   {:<7}  {}{}\n", row.flow_mm3_s,
               row.acceleration_mm_s2,
               row.layer_height_mm ? fmt::format("{:.3g} mm", *row.layer_height_mm) : "?",
               report::WithInterval(row.pressure_advance_s, report::kSeconds),
               row.count > 1 ? fmt::format(", of {} calibrations", row.count) : "");
  }
  fmt::print("one value         {}; it misses a row's own by up to {:.4f} s\n",
             report::WithInterval(table.single_s, report::kSeconds), table.greatest_miss_s);
  fmt::print("over flow         {}\n", TrendText(table.over_flow, "s per mm3/s"));
  fmt::print("over acceleration {}\n", TrendText(table.over_acceleration, "s for each doubling"));
  PrintLaws(table, filament_diameter_mm);
  for (const std::string& notice : table.notices) fmt::print("notice            {}\n", notice);
}

}  // namespace trammel::app
