#include "pressure_advance/commands/pressure_advance_job.h"

#include <fmt/format.h>

#include <utility>

#include "app/job_arguments.h"
#include "app/serve_command.h"
#include "pressure_advance/commands/analysis_output.h"
#include "pressure_advance/commands/noted_print.h"
#include "pressure_advance/procedure/filament_memory.h"
#include "pressure_advance/procedure/pattern_photo.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

constexpr const char* kFilament = "filament";
constexpr const char* kMaterial = "material";

/// A filament's key, which a button can hand on; empty where none is named.
Result<std::string> KeyOf(const service::Arguments& arguments) {
  const auto filament = arguments.find(kFilament);
  if (filament == arguments.end()) return std::string();
  return procedure::FilamentKey(filament->second);
}

std::string GivenAs(const char* name, const service::Arguments& arguments) {
  const auto found = arguments.find(name);
  return found == arguments.end() ? std::string() : found->second;
}

/// The material of a run: as it is given, else as the filament's name has it; empty: the settings'.
std::string MaterialFor(const service::Arguments& arguments) {
  if (std::string given = GivenAs(kMaterial, arguments); !given.empty()) return given;
  const settings::Material* const named = settings::MaterialInName(GivenAs(kFilament, arguments));
  return named != nullptr ? std::string(named->name) : std::string();
}

/// The settings of a run. Errors: they cannot be read, do not say how hot it prints, or say it of
/// another material than the filament's name.
Result<files::Config> SettingsFor(const service::PrinterPlace& place,
                                  const service::Arguments& arguments) {
  PrinterOptions options = OptionsAt(place);
  const auto temperature = arguments.find(kTemperatureArgument);
  if (temperature != arguments.end()) {
    if (auto plain = CheckTemperatureArgument(temperature->second); !plain) {
      return tl::unexpected(plain.error());
    }
    options.set.push_back(fmt::format("{}={}", kTemperatureSetting, temperature->second));
  }
  auto config = LoadSettingsFor(MaterialFor(arguments), temperature != arguments.end(),
                                "call with TEMP=…", std::move(options));
  if (!config) return config;
  if (auto told = settings::ValidateTemperatures(config->pattern); !told) {
    return tl::unexpected(told.error());
  }
  return config;
}

/// @param what  is done to the empty bed
Result<service::Offer> OfferTo(const char* what, const service::PrinterPlace& place,
                               const service::Arguments& arguments) {
  const auto config = SettingsFor(place, arguments);
  if (!config) return tl::unexpected(config.error());
  auto key = KeyOf(arguments);
  if (!key) return tl::unexpected(key.error());
  service::Offer offer;
  offer.question = fmt::format("Is the bed empty? It is heated, a pattern is {} ({}){}", what,
                               settings::DescribeTemperatures(config->pattern),
                               key->empty() ? "" : ", for filament " + *key);
  if (!key->empty()) offer.start[kFilament] = std::move(*key);
  if (std::string material = MaterialFor(arguments); !material.empty()) {
    offer.start[kMaterial] = std::move(material);
  }
  if (const auto temperature = arguments.find(kTemperatureArgument);
      temperature != arguments.end()) {
    offer.start[kTemperatureArgument] = temperature->second;
  }
  return offer;
}

Result<service::Offer> Check(const service::PrinterPlace& place,
                             const service::Arguments& arguments) {
  return OfferTo("printed and scanned", place, arguments);
}

Result<service::Offer> CheckPattern(const service::PrinterPlace& place,
                                    const service::Arguments& arguments) {
  return OfferTo("printed for a photo", place, arguments);
}

// A photo moves and heats nothing. Nobody has to say again for which filament it was printed.
Result<service::Offer> CheckPhoto(const service::PrinterPlace& place,
                                  const service::Arguments& arguments) {
  const auto config = LoadSettings(OptionsAt(place));
  if (!config) return tl::unexpected(config.error());
  const auto key = KeyOf(arguments);
  if (!key) return tl::unexpected(key.error());
  service::Offer offer;
  const auto print = LastNotedPrint(config->scan.address);
  if (!print) return tl::unexpected(print.error());
  if (*print && !(*print)->filament.empty()) offer.start[kFilament] = (*print)->filament;
  return offer;
}

std::string UseWords(const service::Arguments& arguments) {
  const auto key = KeyOf(arguments);
  return fmt::format("Use it until Klipper restarts{}",
                     !key || key->empty() ? "" : ", and keep it for filament " + *key);
}

/// What the settings have pa apply write besides.
std::string UseAlso(const service::PrinterPlace& place) {
  const auto config = LoadSettings(OptionsAt(place));
  return config && config->scan.keep_in_spoolman ? "keep it in Spoolman" : "";
}

std::vector<std::string> ApplyWords(const std::string& folder,
                                    const service::Arguments& arguments) {
  std::vector<std::string> words = {"pa", "apply", folder};
  const auto filament = arguments.find(kFilament);
  if (filament != arguments.end()) words.push_back("--filament=" + filament->second);
  return words;
}

}  // namespace

namespace {

/// What has a pressure advance for its answer.
service::JobKind Measuring(const char* name) {
  service::JobKind kind;
  kind.name = name;
  kind.apply = ApplyWords;
  kind.use = UseWords;
  kind.use_also = UseAlso;
  kind.in_force = [](const machine::PrinterState& state) {
    const auto advance_s = machine::ActiveAdvance_s(state);
    return advance_s ? fmt::format("{:.4f} s", *advance_s) : "";
  };
  kind.quantity = "pressure_advance";
  kind.picture = kResultPicture;
  return kind;
}

}  // namespace

service::JobKind PressureAdvanceJob() {
  service::JobKind kind = Measuring("pressure_advance");
  kind.arguments = {kFilament, kMaterial, kTemperatureArgument};
  kind.settings = {{kTemperatureArgument, kTemperatureSetting}};
  kind.check = Check;
  kind.words = {"pa", "calibrate"};
  kind.offer_method = "trammel_offer";
  return kind;
}

service::JobKind PhotoPatternJob() {
  service::JobKind kind;
  kind.name = "photo_pattern";
  kind.arguments = {kFilament, kMaterial, kTemperatureArgument};
  kind.settings = {{kTemperatureArgument, kTemperatureSetting}};
  kind.check = CheckPattern;
  kind.words = {"pa", "print", "--photo"};
  kind.looks = false;
  kind.done = fmt::format(
      "Pattern printed, everything is off. Let the bed cool, take a photo from straight above, "
      "upload it into the folder {} beside printer.cfg. Measure it?",
      procedure::kUploadFolder);
  kind.start_buttons = procedure::Buttons::kPrint;
  kind.done_buttons = procedure::Buttons::kPhoto;
  kind.offer_method = "trammel_offer_pattern";
  return kind;
}

service::JobKind PhotoJob() {
  service::JobKind kind = Measuring("photo");
  kind.arguments = {kFilament, "file"};
  kind.check = CheckPhoto;
  kind.notice = kNoPrintNoted;
  kind.words = {"pa", "photo"};
  kind.copies = {"photo"};
  kind.start_method = "trammel_photo";
  return kind;
}

}  // namespace trammel::app
