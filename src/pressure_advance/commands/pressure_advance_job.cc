#include "pressure_advance/commands/pressure_advance_job.h"

#include <fmt/format.h>

#include <utility>

#include "app/serve_command.h"
#include "pressure_advance/commands/analysis_output.h"
#include "pressure_advance/procedure/filament_memory.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

constexpr const char* kFilament = "filament";
// The nozzle's temperature of this run in degC, in place of the settings'.
constexpr const char* kTemperature = "temp";
constexpr const char* kTemperatureKey = "filament.nozzle_temperature";

// A plain number: it becomes part of a setting, and of a button's G-code.
Result<void> CheckTemperature(const std::string& text) {
  constexpr std::size_t kLongest = 6;
  const bool plain = !text.empty() && text.size() <= kLongest &&
                     text.find_first_not_of("0123456789.") == std::string::npos;
  if (plain) return {};
  return Fail("TEMP must be the nozzle's temperature in degC, such as 240 or 235.5");
}

Result<service::Offer> Check(const service::PrinterPlace& place,
                             const service::Arguments& arguments) {
  PrinterOptions options = OptionsAt(place);
  if (const auto material = arguments.find("material"); material != arguments.end()) {
    options.material = material->second;
  }
  const auto temperature = arguments.find(kTemperature);
  if (temperature != arguments.end()) {
    if (auto plain = CheckTemperature(temperature->second); !plain) {
      return tl::unexpected(plain.error());
    }
    options.set.push_back(fmt::format("{}={}", kTemperatureKey, temperature->second));
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
    offer.start[kFilament] = std::move(*key);
  }
  if (temperature != arguments.end()) {
    offer.start[kTemperature] = temperature->second;
  }
  offer.question = fmt::format(
      "Is the bed empty? It is heated, a pattern is printed and scanned ({}){}",
      settings::DescribeTemperatures(config->pattern),
      offer.start.contains(kFilament) ? ", for filament " + offer.start[kFilament] : "");
  return offer;
}

std::string UseWords(const service::Arguments& arguments) {
  const auto filament = arguments.find(kFilament);
  const auto key = filament == arguments.end() ? Result<std::string>(std::string())
                                               : procedure::FilamentKey(filament->second);
  return fmt::format("Use it until Klipper restarts{}",
                     !key || key->empty() ? "" : ", and keep it for filament " + *key);
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
  kind.arguments = {kFilament, "material", kTemperature};
  kind.settings = {{kTemperature, kTemperatureKey}};
  kind.check = Check;
  kind.words = {"pa", "calibrate"};
  kind.apply = ApplyWords;
  kind.use = UseWords;
  kind.in_force = [](const machine::PrinterState& state) {
    return state.pressure_advance_s ? fmt::format("{:.4f} s", *state.pressure_advance_s) : "";
  };
  kind.quantity = "pressure_advance";
  kind.picture = kResultPicture;
  kind.offer_method = "trammel_offer";
  kind.start_method = "trammel_pressure_advance";
  return kind;
}

}  // namespace trammel::app
