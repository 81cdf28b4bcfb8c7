// trammel pa table
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "base/json_text.h"
#include "base/measured_json.h"
#include "document/interval_text.h"
#include "files/whole_file.h"
#include "gcode/bead.h"
#include "measurement/history.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/files/orca_profile.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/flow/flow_table.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::FlowPoint;
using pressure_advance::FlowTable;
using pressure_advance::FlowTrend;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostPlanBytes = 4'000'000;
constexpr std::size_t kMostRecordings = 1000;

struct TableArguments {
  std::vector<std::string> recordings;
  bool json = false;
  std::string orca;
  std::string out;
  bool force = false;
};

struct Calibration {
  FlowPoint point;
  measurement::Subject subject;
  std::string fingerprint;
};

/// The answer of a recording, with the flows and the acceleration of its plan.
Result<Calibration> CalibrationOf(const fs::path& folder) {
  const auto answer = KeptPressureAdvance(folder);
  if (!answer) return tl::unexpected(answer.error());
  const fs::path file = folder / "pattern.plan.json";
  const auto text = files::ReadNamedFile(file, kMostPlanBytes);
  if (!text) return tl::unexpected(text.error());
  const auto plan = files::ParsePlan(*text, file.string());
  if (!plan) return tl::unexpected(plan.error());
  const auto [slow, fast] = std::ranges::minmax(
      plan->segments, {}, [](const pressure_advance::Segment& s) { return s.speed_mm_s; });
  if (!(plan->layer_height_mm > 0 && plan->layer_height_mm <= plan->line_width_mm)) {
    return Fail(
        fmt::format("{}: a bead {} mm wide and {} mm high has no flow: it must be as wide as "
                    "high at least",
                    file.string(), plan->line_width_mm, plan->layer_height_mm));
  }
  const double area_mm2 = gcode::BeadArea_mm2(plan->line_width_mm, plan->layer_height_mm);
  FlowPoint point;
  point.flow_mm3_s = fast.speed_mm_s * area_mm2;
  point.slow_flow_mm3_s = slow.speed_mm_s * area_mm2;
  point.acceleration_mm_s2 = plan->acceleration_mm_s2;
  point.pressure_advance_s = answer->pressure_advance_s;
  return Calibration{point, answer->outcome.subject, files::Fingerprint(answer->outcome)};
}

/// Whether both may be rows of one table, as far as they tell.
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

/// Takes over what is not known yet.
void Complete(measurement::Subject& subject, const measurement::Subject& other) {
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    if ((subject.*text).empty()) subject.*text = other.*text;
  }
}

Json JsonOf(const FlowTable& table) {
  Json rows = Json::array();
  for (const FlowPoint& row : table.rows) {
    const Interval& interval = row.pressure_advance_s.interval95;
    rows.push_back({{"flow_mm3_s", row.flow_mm3_s},
                    {"acceleration_mm_s2", row.acceleration_mm_s2},
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
          {"notices", table.notices}};
}

std::string TrendText(const FlowTrend& trend, const std::string& unit) {
  if (!trend.per_unit.good()) return "not known: " + trend.per_unit.reason();
  constexpr int kDecimals = 5;
  report::IntervalStyle style{unit, 1, kDecimals, true};
  return fmt::format("{}{}", report::WithInterval(trend.per_unit.quantity(), style),
                     trend.significant ? "" : ", which is no change that could be seen");
}

void Print(const FlowTable& table) {
  fmt::print("  flow       acceleration   pressure advance\n");
  for (const FlowPoint& row : table.rows) {
    fmt::print("{:6.2f} mm3/s {:7.0f} mm/s2   {}{}\n", row.flow_mm3_s, row.acceleration_mm_s2,
               report::WithInterval(row.pressure_advance_s, report::kSeconds),
               row.count > 1 ? fmt::format(", of {} calibrations", row.count) : "");
  }
  fmt::print("one value         {}; it misses a row's own by up to {:.4f} s\n",
             report::WithInterval(table.single_s, report::kSeconds), table.greatest_miss_s);
  fmt::print("over flow         {}\n", TrendText(table.over_flow, "s per mm3/s"));
  fmt::print("over acceleration {}\n", TrendText(table.over_acceleration, "s for each doubling"));
  for (const std::string& notice : table.notices) fmt::print("notice            {}\n", notice);
}

// The profile, and what to say of it.
Result<std::string> WriteProfile(const TableArguments& arguments, const FlowTable& table) {
  constexpr std::size_t kMostBytes = 4'000'000;
  const auto rows = pressure_advance::AdaptiveRows(table);
  if (rows.empty()) {
    return Fail(
        "OrcaSlicer wants two flows at least for an acceleration, and no acceleration has "
        "them: calibrate with another fast speed, too");
  }
  const auto profile = files::ReadNamedFile(arguments.orca, kMostBytes);
  if (!profile) return tl::unexpected(profile.error());
  const auto made =
      files::WithPressureAdvance(*profile, arguments.orca, table.single_s.value, rows);
  if (!made) return tl::unexpected(made.error());
  auto written = WriteOutputs({{arguments.out, made->text}}, arguments.force);
  if (!written) return tl::unexpected(written.error());
  return fmt::format(
      "{} rows{} and one value, {:.4f} s, in {}: import it in OrcaSlicer", rows.size(),
      rows.size() < table.rows.size()
          ? fmt::format(" of {} (an acceleration with one flow is left out)", table.rows.size())
          : "",
      table.single_s.value, arguments.out);
}

int RunTable(const TableArguments& arguments) {
  if (arguments.orca.empty() != arguments.out.empty()) {
    return PrintError({ErrorKind::kInput, "--orca PROFILE and -o PROFILE go together"});
  }
  if (!arguments.out.empty()) {
    auto free = RefuseToOverwrite({arguments.out}, arguments.force);
    if (!free) return PrintError(free.error());
  }
  std::vector<FlowPoint> points;
  measurement::Subject subject;
  std::map<std::string, std::string> taken;  // fingerprint, folder
  for (const std::string& recording : arguments.recordings) {
    const auto calibration = CalibrationOf(recording);
    if (!calibration) return PrintError(calibration.error());
    const auto [first, fresh] = taken.emplace(calibration->fingerprint, recording);
    if (!fresh) {
      return PrintError(
          {ErrorKind::kInput, fmt::format("{}: is the same calibration as {}: name each once",
                                          recording, first->second)});
    }
    auto same = CheckSameSubject(subject, calibration->subject, recording);
    if (!same) return PrintError(same.error());
    Complete(subject, calibration->subject);
    points.push_back(calibration->point);
  }
  const auto table = pressure_advance::MakeFlowTable(std::move(points));
  if (!table) return PrintError(table.error());
  std::string profile;
  if (!arguments.orca.empty()) {
    auto written = WriteProfile(arguments, *table);
    if (!written) return PrintError(written.error());
    profile = std::move(*written);
  }
  if (arguments.json) {
    fmt::print("{}", JsonText(JsonOf(*table)));
  } else {
    Print(*table);
    if (!profile.empty()) fmt::print("OrcaSlicer        {}\n", profile);
  }
  return kExitGood;
}

}  // namespace

void AddTableCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "table", "pressure advance over flow and acceleration, from several calibrations");
  const auto arguments = std::make_shared<TableArguments>();
  command
      ->add_option("recordings", arguments->recordings,
                   "their folders: one filament, other fast speeds or accelerations")
      ->required()
      ->expected(1, static_cast<int>(kMostRecordings));
  command->add_flag("--json", arguments->json, "print everything as one JSON object");
  command->add_option("--orca", arguments->orca,
                      "a filament profile exported from OrcaSlicer, for its adaptive pressure "
                      "advance");
  command->add_option("-o,--out", arguments->out, "the profile to import there");
  command->add_flag("--force", arguments->force, "overwrite it");
  command->callback([arguments, &exit_code] { exit_code = RunTable(*arguments); });
}

}  // namespace trammel::app
