#include "pressure_advance/commands/measured_subject.h"

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <utility>

#include "pressure_advance/procedure/filament_memory.h"
#include "pressure_advance/procedure/spool_memory.h"
#include "session/dead_run.h"
#include "session/run_journal.h"
#include "settings/material.h"

namespace trammel::app {

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

}  // namespace trammel::app
