#include "app/stated_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "app/config/config_file.h"
#include "files/whole_file.h"
#include "session/print_needs.h"
#include "settings/printer.h"

namespace trammel::app {
namespace {

using files::Config;
using machine::PrinterFacts;
using pressure_advance::PatternConfig;

bool Holds(const settings::SettingRange& range, double value) {
  return value >= range.lo && value <= range.hi;
}

// True if the printer reports a number other than the setting's, within the setting's range.
bool Differs(const std::optional<double>& stated, double ours,
             const settings::SettingRange& range) {
  return stated && *stated != ours && Holds(range, *stated);
}

void TakeFilament(const PrinterFacts& facts, Config& config, std::vector<std::string>& taken) {
  PatternConfig& pattern = config.pattern;
  if (config.IsSet("filament.filament_diameter") ||
      !Differs(facts.filament_diameter_mm, pattern.filament_diameter_mm,
               RangeOf(settings::FilamentFields(), "filament_diameter"))) {
    return;
  }
  pattern.filament_diameter_mm = *facts.filament_diameter_mm;
  taken.push_back(fmt::format("filament of {:g} mm", pattern.filament_diameter_mm));
}

void TakeNozzle(const PrinterFacts& facts, Config& config, std::vector<std::string>& taken) {
  PatternConfig& pattern = config.pattern;
  if (config.IsSet("printer.nozzle_diameter") ||
      !Differs(facts.nozzle_diameter_mm, pattern.nozzle_diameter_mm,
               RangeOf(settings::PrinterFields(), "nozzle_diameter"))) {
    return;
  }
  pattern.nozzle_diameter_mm = *facts.nozzle_diameter_mm;
  FollowNozzle(config);
  taken.push_back(fmt::format("nozzle of {:g} mm", pattern.nozzle_diameter_mm));
}

/// Extent along one axis: from 0 if the corner is there, else the nozzle's whole reach.
struct BedAxis {
  double origin_mm = 0;
  double size_mm = 0;
};

BedAxis BedWithin(double minimum_mm, double maximum_mm) {
  const bool centred = -minimum_mm >= maximum_mm / 2;
  const double origin_mm = centred ? minimum_mm : std::max(0.0, minimum_mm);
  return {origin_mm, maximum_mm - origin_mm};
}

void TakeBed(const PrinterFacts& facts, Config& config, std::vector<std::string>& taken) {
  PatternConfig& pattern = config.pattern;
  if (facts.reach.round && !config.IsSet("printer.bed_shape")) {
    pattern.bed_shape = settings::BedShape::kEllipse;
    taken.push_back(fmt::format("bed_shape = \"ellipse\" (kinematics {})", facts.kinematics));
  }
  for (const char* key : {"bed_size_x", "bed_size_y", "bed_origin_x", "bed_origin_y"}) {
    if (config.IsSet(std::string("printer.") + key)) return;
  }
  const auto& low = facts.reach.minimum_mm;
  const auto& high = facts.reach.maximum_mm;
  const bool holds = low[0] <= pattern.bed_origin_x_mm && low[1] <= pattern.bed_origin_y_mm &&
                     high[0] >= pattern.bed_origin_x_mm + pattern.bed_size_x_mm &&
                     high[1] >= pattern.bed_origin_y_mm + pattern.bed_size_y_mm;
  const bool round = pattern.bed_shape == settings::BedShape::kEllipse;
  const BedAxis x = round ? BedAxis{low[0], high[0] - low[0]} : BedWithin(low[0], high[0]);
  const BedAxis y = round ? BedAxis{low[1], high[1] - low[1]} : BedWithin(low[1], high[1]);
  const auto fits = [](double value_mm, const char* key) {
    return Holds(RangeOf(settings::PrinterFields(), key), value_mm);
  };
  if ((holds && !round) || !fits(x.origin_mm, "bed_origin_x") ||
      !fits(y.origin_mm, "bed_origin_y") || !fits(x.size_mm, "bed_size_x") ||
      !fits(y.size_mm, "bed_size_y")) {
    return;
  }
  pattern.bed_origin_x_mm = x.origin_mm;
  pattern.bed_origin_y_mm = y.origin_mm;
  pattern.bed_size_x_mm = x.size_mm;
  pattern.bed_size_y_mm = y.size_mm;
  taken.push_back(
      fmt::format("bed X {:g} ... {:g}, Y {:g} ... {:g} mm, as far as the nozzle "
                  "reaches",
                  x.origin_mm, x.origin_mm + x.size_mm, y.origin_mm, y.origin_mm + y.size_mm));
}

// Handles a bed without a heater, which cannot reach a material's bed temperature.
void TakeBedHeater(const PrinterFacts& facts, Config& config, std::vector<std::string>& taken) {
  if (!facts.no_bed_heater || config.IsSet("filament.bed_temperature")) return;
  config.pattern.bed_temperature_c = 0;
  taken.emplace_back("an unheated bed (no [heater_bed])");
}

void TakeMotors(const PrinterFacts& facts, Config& config, std::vector<std::string>& taken) {
  config.pattern.advance_motors = facts.advance_names();
  if (config.pattern.advance_motors.empty()) return;
  taken.push_back(fmt::format("pressure advance of {}", procedure::AdvanceSections(facts)));
}

}  // namespace

std::vector<std::string> TakeStated(const PrinterFacts& facts, StatedFor purpose, Config& config) {
  std::vector<std::string> taken;
  const PatternConfig before = config.pattern;
  TakeFilament(facts, config, taken);
  TakeNozzle(facts, config, taken);
  TakeBed(facts, config, taken);
  TakeBedHeater(facts, config, taken);
  if (purpose == StatedFor::kPrinter) return taken;
  const PatternConfig& pattern = config.pattern;
  if (pattern.line_width_mm != before.line_width_mm) {
    taken.push_back(fmt::format("lines {:.3g} mm wide and {:.3g} mm high for that nozzle",
                                pattern.line_width_mm, pattern.layer_height_mm));
  }
  TakeMotors(facts, config, taken);
  return taken;
}

namespace {

// Facts of a ready printer, and which were adopted, as text; empty if it is not ready.
struct TakenFacts {
  PrinterFacts facts;
  std::string words;
};

Result<std::optional<TakenFacts>> TakeFrom(const procedure::Session& session, StatedFor purpose,
                                           Config& config) {
  constexpr double kAsk_s = 10;
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  if (state.readiness != machine::PrinterReadiness::kReady) return std::optional<TakenFacts>();
  auto facts = TRY(procedure::ReadFacts(session));
  const auto taken = TakeStated(facts, purpose, config);
  std::string words = fmt::format("{}", fmt::join(taken, "; "));
  if (!taken.empty()) session.Report("as the printer states: " + words);
  return std::optional(TakenFacts{std::move(facts), std::move(words)});
}

}  // namespace

Result<std::optional<PrinterFacts>> TakeStatedBy(const procedure::Session& session,
                                                 StatedFor purpose, Config& config) {
  auto taken = TRY(TakeFrom(session, purpose, config));
  if (!taken) return std::optional<PrinterFacts>();
  return std::optional(std::move(taken->facts));
}

Result<void> FitPattern(const procedure::Session& session, Config& config) {
  if (config.pattern.dialect != gcode::Dialect::kKlipper) {
    return Fail(
        fmt::format("[printer] dialect: {} is not printed through Moonraker, on Klipper; trammel "
                    "pa pattern writes a file for it",
                    ToString(config.pattern.dialect)));
  }
  if (session.printer.LastState().readiness == machine::PrinterReadiness::kStartup) {
    TRY(procedure::FirstFailure(CheckReady(session), ErrorKind::kMachine));
  }
  const auto taken = TRY(TakeFrom(session, StatedFor::kPattern, config));
  auto valid = Validate(config.pattern);
  if (valid) return {};
  const std::string words = taken ? taken->words : "";
  return Fail(fmt::format("with what the printer states of itself{}: {}",
                          words.empty() ? "" : fmt::format(" ({})", words), valid.error().message),
              ErrorKind::kSafety);
}

Result<ConfigText> FindConfig(const std::string& asked_for) {
  constexpr const char* kDefaultFile = "trammel.toml";
  std::error_code ignored;
  if (asked_for.empty() && !std::filesystem::exists(kDefaultFile, ignored)) {
    return ConfigText{"", "defaults (there is no trammel.toml here)"};
  }
  const std::string file = asked_for.empty() ? kDefaultFile : asked_for;
  std::string text = TRY(files::ReadWholeFile(file, files::kMaxConfigBytes));
  return ConfigText{std::move(text), file};
}

}  // namespace trammel::app
