#include "pressure_advance/commands/conditions_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "app/commands.h"
#include "app/new_folder.h"
#include "base/json_text.h"
#include "base/measured_json.h"
#include "document/interval_text.h"
#include "gcode/bead.h"
#include "pressure_advance/commands/analysis_output.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/flow_table_output.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/machine_time.h"
#include "pressure_advance/commands/measured_subject.h"
#include "pressure_advance/files/orca_profile.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/procedure/plate_layout.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::FlowTable;
using pressure_advance::PatternConditions;
using pressure_advance::PatternConfig;
using Json = nlohmann::ordered_json;

constexpr const char* kOption = "--speeds and --accelerations";

std::string Words(const PatternConditions& at) {
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

// What a pattern gave.
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

void SayRows(const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    const Measured& answer = row.pressure_advance;
    fmt::print("{:<24} {}\n", Words(row.at),
               answer.good()
                   ? report::WithInterval(answer.quantity(), report::kSeconds)
                   : fmt::format("{}: {}", VerdictWords(answer.verdict()), answer.reason()));
  }
}

void SayTable(const FlowTable& table, double filament_diameter_mm, const fs::path& folder) {
  PrintTable(table, filament_diameter_mm);
  const auto adaptive = AdaptiveRows(table);
  if (!adaptive.empty()) {
    fmt::print("OrcaSlicer        its adaptive pressure advance, value, flow, acceleration:\n{}\n",
               files::AdaptiveModel(adaptive));
    fmt::print("into its profile  trammel pa table {}/*/ --orca PROFILE -o NEW_PROFILE\n",
               folder.string());
  }
  fmt::print("nothing applied   trammel pa apply {:.4f}\n", table.single_s.value);
}

int Say(const ConditionsRun& run, const std::vector<Row>& rows, const fs::path& folder) {
  std::vector<std::string> good;
  for (const Row& row : rows) {
    if (row.pressure_advance.good()) good.push_back(row.folder.string());
  }
  std::optional<FlowTable> table;
  if (!good.empty()) {
    auto made = TableOf(good);
    if (!made) return PrintError(made.error());
    table = std::move(*made);
  }
  if (run.json) {
    fmt::print("{}", JsonText(JsonOf(rows, table)));
  } else {
    SayRows(rows);
    if (table) SayTable(*table, run.config.pattern.filament_diameter_mm, folder);
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
  if (count < procedure::kFewestPatterns || count > procedure::kMostPatterns) {
    return Fail(fmt::format("{} make {} combination(s); a plate has {} to {}", kOption, count,
                            procedure::kFewestPatterns, procedure::kMostPatterns));
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
      return Fail(fmt::format("{}: {}", Words(conditions[i]), sweeps.error().message),
                  sweeps.error().kind);
    }
  }
  return laid;
}

int RunConditions(const ConditionsRun& run, const procedure::Session& session) {
  const auto folder = NewFolder::Make(run.out);
  if (!folder) return PrintError(folder.error());
  auto request = RequestFor(run.config, folder->path());
  std::vector<NewFolder> parts;
  for (const PatternConditions& at : run.config.pattern.conditions) {
    auto part =
        NewFolder::Make(folder->path() / fmt::format("{:g}mm_s-{:g}mm_s2", at.fast_speed_mm_s,
                                                     at.acceleration_mm_s2));
    if (!part) return PrintError(part.error());
    request.folders.push_back(part->path());
    parts.push_back(std::move(*part));
  }
  request.filament = run.filament;
  const MachineTime time = MachineTimeOf(request.pattern, request.settings);
  session.Say(fmt::format("{} patterns; print {:.0f} s and scan {:.0f} s, heating apart",
                          request.folders.size(), time.print.total_s(),
                          time.scan ? time.scan->total_s() : 0));
  const auto spool = SpoolNow(session, run.filament.empty());
  const CalibrationRun ran = CalibrateInto(session, request);
  if (!ran.done) return PrintError(ran.done.error());
  const auto subject = SubjectOf(run.filament, session, run.config, spool);
  const auto rows = AnalyseAll(run, request.folders, subject);
  const int code = Say(run, rows, folder->path());
  if (!run.keep_full) CutRecordings(request.folders, session.stop);
  return code;
}

}  // namespace trammel::app
