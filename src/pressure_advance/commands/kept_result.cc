#include "pressure_advance/commands/kept_result.h"

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <utility>

#include "app/provenance.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/filament_memory.h"
#include "pressure_advance/report/analysis_json.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

constexpr std::string_view kQuantity = "pressure_advance";
constexpr double kMax_s = 10;  // limit of pa apply

}  // namespace

ResultFile ResultOf(const pressure_advance::Analysis& analysis, std::string source) {
  ResultFile result{{ProvenanceOf(measurement::Instrument::kPressureAdvance, {std::move(source)}),
                     {{std::string(kQuantity), "s", analysis.pressure_advance}},
                     analysis.notices},
                    report::JsonOf(analysis)};
  // Others would make the verdict theirs.
  if (analysis.flow && analysis.flow->ratio.good()) {
    result.outcome.answers.push_back({"flow_ratio", "", analysis.flow->ratio});
  }
  return result;
}

measurement::Subject SubjectIn(const std::filesystem::path& folder) {
  const auto kept = files::ReadOutcome(folder, measurement::Instrument::kPressureAdvance);
  return kept ? kept->subject : measurement::Subject{};
}

Result<ChosenValue> KeptPressureAdvance(const std::filesystem::path& path) {
  auto outcome = TRY(files::ReadOutcome(path, measurement::Instrument::kPressureAdvance));
  const measurement::Answer* const answer = outcome.Find(kQuantity);
  if (answer == nullptr || answer->unit != "s") {
    return Fail(fmt::format("{}: holds no {} in s", path.string(), kQuantity));
  }
  if (!answer->value.good()) {
    return Fail(fmt::format("{}: it gives no value, because the verdict is {}: {}", path.string(),
                            VerdictText(answer->value.verdict()), answer->value.reason()),
                ErrorKind::kMeasurement);
  }
  const Quantity quantity = answer->value.quantity();
  const Interval& interval95 = quantity.interval95;
  if (quantity.value < 0 || interval95.lo < -kMax_s || interval95.hi > kMax_s) {
    return Fail(fmt::format(
        "{}: {} is {} s, 95 %: {} to {} s; it must lie within 0 ... {} s, and its interval within "
        "+-{} s",
        path.string(), kQuantity, quantity.value, interval95.lo, interval95.hi, kMax_s, kMax_s));
  }
  return ChosenValue{quantity.value, quantity, std::move(outcome)};
}

Result<void> CheckFilamentOption(const std::string& name) {
  if (name.empty()) return {};
  const auto key = procedure::FilamentKey(name);
  if (key) return {};
  return Fail("--filament: " + key.error().message, key.error().kind);
}

bool MayBeSameFilament(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) return true;
  const auto key = procedure::FilamentKey(a);
  const auto other = procedure::FilamentKey(b);
  return !key || !other || key->find(*other) != std::string::npos ||
         other->find(*key) != std::string::npos;
}

std::optional<machine::Spool> SpoolNow(const procedure::Session& session, bool wanted) {
  auto spool = procedure::SpoolOnPrinter(session);
  if (spool) return std::move(*spool);
  if (wanted) {
    fmt::print(stderr, "  the result is listed without a filament: {}\n", spool.error().message);
  }
  return std::nullopt;
}

measurement::Subject SubjectOf(const std::string& filament, const procedure::Session& session,
                               const files::Config& config,
                               const std::optional<machine::Spool>& spool) {
  constexpr double kAsk_s = 10;
  const auto degrees = [](std::optional<double> set_c) {
    return set_c ? fmt::format("{:g}", *set_c) : std::string();
  };
  measurement::Subject subject;
  subject.printer = procedure::PrinterName(config.scan.address);
  subject.nozzle = fmt::format("{:.2f}", config.pattern.nozzle_diameter_mm);
  subject.filament = filament;
  subject.nozzle_c = degrees(settings::NozzleTemperature_c(config.pattern));
  subject.bed_c = degrees(settings::BedTemperature_c(config.pattern));
  if (const auto state = session.printer.State(session.Within(kAsk_s))) {
    subject.toolhead = state->active_extruder;
  }
  if (spool) {
    subject.spool = std::to_string(spool->id);
    if (subject.filament.empty()) subject.filament = spool->filament;
  }
  return subject;
}

using pressure_advance::PatternConfig;

procedure::Reach BedOf(const PatternConfig& pattern) {
  constexpr double kHigh_mm = 1000;
  return {{pattern.bed_origin_x_mm, pattern.bed_origin_y_mm, 0},
          {pattern.bed_origin_x_mm + pattern.bed_size_x_mm,
           pattern.bed_origin_y_mm + pattern.bed_size_y_mm, kHigh_mm},
          pattern.bed_shape == settings::BedShape::kEllipse};
}

MachineTime MachineTimeOf(const PatternConfig& pattern, const settings::ScanSettings& settings) {
  const procedure::Reach bed = BedOf(pattern);
  const PatternConfig printed = procedure::ParkedForScan(pattern, settings, bed);
  const auto layout = LayOut(printed);
  MachineTime time;
  time.print = Summarise(layout, printed).time;
  if (const auto sweeps = procedure::PlanSweeps(MakePlan(layout, printed, ""), {}, settings, bed)) {
    time.scan = TimeOf(*sweeps, printed, printed.acceleration_mm_s2, ParkPoint(printed));
  }
  return time;
}

std::string Describe(const pressure_advance::PatternTime& time) {
  return fmt::format("{:.1f} s: lines {:.1f}, frame {:.1f}, between them {:.1f}, to and fro {:.1f}",
                     time.total_s(), time.lines_s, time.frame_s, time.between_s, time.to_and_fro_s);
}

std::string Describe(const procedure::ScanTime& time) {
  return fmt::format("{:.1f} s: sweeps {:.1f}, turns {:.1f}, standing {:.1f}, travels {:.1f}",
                     time.total_s(), time.sweeping_s, time.turning_s, time.standing_s,
                     time.travelling_s);
}

}  // namespace trammel::app
