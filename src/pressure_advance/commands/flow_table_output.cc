#include "pressure_advance/commands/flow_table_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "base/measured_json.h"
#include "base/square.h"
#include "document/interval_text.h"
#include "files/whole_file.h"
#include "gcode/bead.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/files/plan_file.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::AdvanceForm;
using pressure_advance::AdvanceLaw;
using pressure_advance::FlowPoint;
using pressure_advance::FlowTable;
using pressure_advance::FlowTrend;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostPlanBytes = 4'000'000;

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
  const auto text = TRY(files::ReadNamedFile(file, kMostPlanBytes));
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
  point.pressure_advance_s = *answer->measured;
  return Calibration{point, answer->result->subject, files::Fingerprint(*answer->result)};
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

std::string TrendText(const FlowTrend& trend, const std::string& unit) {
  if (!trend.per_unit.good()) return "not known: " + trend.per_unit.reason();
  constexpr int kDecimals = 5;
  report::IntervalStyle style{unit, 1, kDecimals, true};
  return fmt::format("{}{}", report::WithInterval(trend.per_unit.quantity(), style),
                     trend.significant ? "" : ", which is no change that could be seen");
}

// Kalico's word.
const char* ModelOf(AdvanceForm form) { return form == AdvanceForm::kTanh ? "tanh" : "recipr"; }

Json LawJson(const std::optional<AdvanceLaw>& law) {
  if (!law) return nullptr;
  return {{"model", ModelOf(law->form)},
          {"linear_s", law->linear_s},
          {"offset_mm3", law->offset_mm3},
          {"knee_mm3_s", law->shape},
          {"knee_interval95_mm3_s", {law->shape95.lo, law->shape95.hi}}};
}

std::string_view WordsOfBend(const pressure_advance::AdvanceLaws& laws) {
  if (!laws.bends) return ": one value is as right at all flows, as far as can be seen";
  return laws.exponent.quantity().value < 1 ? ": the faster, the less pressure advance"
                                            : ": the faster, the more pressure advance";
}

void PrintLaws(const FlowTable& table, double filament_diameter_mm) {
  const pressure_advance::AdvanceLaws& laws = table.laws;
  const Measured& exponent = laws.exponent;
  if (!exponent.good()) {
    fmt::print("law of flow       not known: {}\n", exponent.reason());
    return;
  }
  fmt::print("law of flow       filament stored as flow to the power of {}{}{}\n",
             report::WithInterval(exponent.quantity(), {"", 1, 2}), WordsOfBend(laws),
             table.laws_acceleration_mm_s2
                 ? fmt::format("; at {:.0f} mm/s2 alone", *table.laws_acceleration_mm_s2)
                 : "");
  if (!laws.firmware) {
    if (laws.bends && exponent.quantity().value < 1) {
      fmt::print(
          "non-linear        a third fast speed would tell what firmware that has it wants\n");
    }
    return;
  }
  const AdvanceLaw& law = *laws.firmware;
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

Result<FlowTable> TableOf(const std::vector<std::string>& recordings) {
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
  return pressure_advance::MakeFlowTable(std::move(points));
}

Json TableJson(const FlowTable& table) {
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
          {"exponent", MeasuredJson(table.laws.exponent)},
          {"bends", table.laws.bends},
          {"law_acceleration_mm_s2",
           table.laws_acceleration_mm_s2 ? Json(*table.laws_acceleration_mm_s2) : Json(nullptr)},
          {"firmware_law", LawJson(table.laws.firmware)},
          {"notices", table.notices}};
}

void PrintTable(const FlowTable& table, double filament_diameter_mm) {
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
  PrintLaws(table, filament_diameter_mm);
  for (const std::string& notice : table.notices) fmt::print("notice            {}\n", notice);
}

}  // namespace trammel::app
