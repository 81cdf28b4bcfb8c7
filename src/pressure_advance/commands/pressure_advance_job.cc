#include "pressure_advance/commands/pressure_advance_job.h"

#include <fmt/format.h>

#include <utility>

#include "app/serve_command.h"
#include "pressure_advance/procedure/filament_memory.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

constexpr const char* kFilament = "filament";

Result<service::Offer> Check(const service::PrinterPlace& place,
                             const service::Arguments& arguments) {
  PrinterOptions options = OptionsAt(place);
  if (const auto material = arguments.find("material"); material != arguments.end()) {
    options.material = material->second;
  }
  const auto config = LoadSettings(options);
  if (!config) return tl::unexpected(config.error());
  if (auto told = settings::ValidateTemperatures(config->pattern); !told) {
    return tl::unexpected(told.error());
  }
  service::Offer offer;
  if (const auto filament = arguments.find(kFilament); filament != arguments.end()) {
    auto key = procedure::FilamentKey(filament->second);
    if (!key) return tl::unexpected(key.error());
    offer.filament = std::move(*key);
  }
  offer.question =
      fmt::format("Is the bed empty? It is heated, a pattern is printed and scanned ({}){}",
                  settings::DescribeTemperatures(config->pattern),
                  offer.filament.empty() ? "" : ", for filament " + offer.filament);
  return offer;
}

std::vector<std::string> ApplyWords(const std::string& folder,
                                    const service::Arguments& arguments) {
  std::vector<std::string> words = {"pa", "apply", folder};
  const auto filament = arguments.find(kFilament);
  if (filament != arguments.end()) words.push_back("--filament=" + filament->second);
  return words;
}

}  // namespace

service::JobKind PressureAdvanceJob() {
  service::JobKind kind;
  kind.name = "pressure_advance";
  kind.arguments = {kFilament, "material"};
  kind.check = Check;
  kind.words = {"pa", "calibrate"};
  kind.apply = ApplyWords;
  kind.in_force = [](const machine::PrinterState& state) {
    return state.pressure_advance_s ? fmt::format("{:.4f} s", *state.pressure_advance_s) : "";
  };
  kind.quantity = "pressure_advance";
  kind.offer_method = "trammel_offer";
  kind.start_method = "trammel_pressure_advance";
  return kind;
}

}  // namespace trammel::app
