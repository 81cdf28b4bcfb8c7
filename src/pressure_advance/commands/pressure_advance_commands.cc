#include "pressure_advance/commands/pressure_advance_commands.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "app/serve_command.h"
#include "document/interval_text.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/procedure/calibrate.h"
#include "pressure_advance/procedure/filament_memory.h"
#include "settings/material.h"

namespace trammel::app {

void AddPressureAdvanceCommands(CLI::App& pa, int& exit_code) {
  pa.require_subcommand(1);
  AddSetupCommand(pa, exit_code);
  AddAnalyzeCommand(pa, exit_code);
  AddPhotoCommand(pa, exit_code);
  AddPatternCommand(pa, exit_code);
  AddCalibrateCommands(pa, exit_code);
  AddApplyCommand(pa, exit_code);
  AddTableCommand(pa, exit_code);
  AddExportCommand(pa, exit_code);
  AddValidateCommand(pa, exit_code);
}

namespace {

constexpr const char* kFilament = "filament";
constexpr const char* kMaterial = "material";

/// Returns a filament's key, safe as a button's argument; empty if none is given.
Result<std::string> KeyOf(const service::Arguments& arguments) {
  const auto filament = arguments.find(kFilament);
  if (filament == arguments.end()) return std::string();
  return procedure::FilamentKey(filament->second);
}

std::string GivenAs(const char* name, const service::Arguments& arguments) {
  const auto found = arguments.find(name);
  return found == arguments.end() ? std::string() : found->second;
}

/// Returns the material of a run: as given, else from the filament's name; empty: the settings'.
std::string MaterialFor(const service::Arguments& arguments) {
  if (std::string given = GivenAs(kMaterial, arguments); !given.empty()) return given;
  const settings::Material* const named = settings::MaterialInName(GivenAs(kFilament, arguments));
  return named != nullptr ? std::string(named->name) : std::string();
}

/// Returns the settings of a run. Errors: they cannot be read, lack the print temperatures, or name
/// another material than the filament's name.
Result<files::Config> SettingsFor(const service::PrinterPlace& place,
                                  const service::Arguments& arguments) {
  PrinterOptions options = OptionsAt(place);
  const auto temperature = arguments.find(service::kTemperatureArgument);
  if (temperature != arguments.end()) {
    TRY(CheckTemperatureArgument(temperature->second));
    options.set.push_back(fmt::format("{}={}", service::kTemperatureSetting, temperature->second));
  }
  auto config = LoadSettingsFor(MaterialFor(arguments), temperature != arguments.end(),
                                "call with TEMP=…", std::move(options));
  if (!config) return config;
  TRY(settings::ValidateTemperatures(config->pattern));
  return config;
}

/// @param what  is done to the empty bed
Result<service::Offer> OfferTo(const char* what, const service::PrinterPlace& place,
                               const service::Arguments& arguments) {
  const auto config = TRY(SettingsFor(place, arguments));
  auto key = TRY(KeyOf(arguments));
  service::Offer offer;
  offer.question = fmt::format("Is the bed empty? It is heated, a pattern is {} ({}){}", what,
                               settings::DescribeTemperatures(config.pattern),
                               key.empty() ? "" : ", for filament " + key);
  if (!key.empty()) offer.start[kFilament] = std::move(key);
  if (std::string material = MaterialFor(arguments); !material.empty()) {
    offer.start[kMaterial] = std::move(material);
  }
  if (const auto temperature = arguments.find(service::kTemperatureArgument);
      temperature != arguments.end()) {
    offer.start[service::kTemperatureArgument] = temperature->second;
  }
  return offer;
}

Result<service::Offer> Check(const service::PrinterPlace& place,
                             const service::Arguments& arguments, machine::Printer*) {
  return OfferTo("printed and scanned", place, arguments);
}

Result<service::Offer> CheckPattern(const service::PrinterPlace& place,
                                    const service::Arguments& arguments, machine::Printer*) {
  return OfferTo("printed for a photo", place, arguments);
}

// A photo moves and heats nothing. Its filament need not be given again.
Result<service::Offer> CheckPhoto(const service::PrinterPlace& place,
                                  const service::Arguments& arguments, machine::Printer*) {
  const auto config = TRY(LoadSettings(OptionsAt(place)));
  TRY(KeyOf(arguments));
  service::Offer offer;
  const auto print = TRY(LastNotedPrint(config.scan.address));
  if (print && !print->filament.empty()) offer.start[kFilament] = print->filament;
  return offer;
}

/// Describes the effect of pa apply under the settings.
std::string UseText(const service::PrinterPlace& place, const service::Arguments& arguments) {
  const auto key = KeyOf(arguments);
  const auto config = LoadSettings(OptionsAt(place));
  return fmt::format("Use it until Klipper restarts{}{}",
                     !key || key->empty() ? "" : ", and keep it for filament " + *key,
                     config && config->scan.keep_in_spoolman ? ", and keep it in Spoolman" : "");
}

std::vector<std::string> ApplyText(const std::string& folder, const service::Arguments& arguments) {
  std::vector<std::string> words = {"pa", "apply", folder};
  const auto filament = arguments.find(kFilament);
  if (filament != arguments.end()) words.push_back("--filament=" + filament->second);
  return words;
}

/// Reads the pressure advance in a run's result.json.
Result<service::AnswerSummary> AnswerIn(const std::string& folder) {
  constexpr const char* kQuantity = "pressure_advance";
  const auto outcome = TRY(files::ReadOutcome(folder, measurement::Instrument::kPressureAdvance));
  const measurement::Answer* const answer = outcome.Find(kQuantity);
  if (answer == nullptr) return Fail(fmt::format("{}: holds no {}", folder, kQuantity));
  const Measured& measured = answer->value;
  service::AnswerSummary words{measured.verdict(), {}};
  words.words = measured.good()
                    ? fmt::format("{} = {}", answer->name,
                                  report::WithInterval(measured.quantity(), {.unit = answer->unit}))
                    : fmt::format("{}: {}", VerdictText(measured.verdict()), measured.reason());
  for (const std::string& notice : outcome.notices) {
    if (measured.good() && notice.starts_with(kNoPrintNoted)) words.notice = notice;
  }
  return words;
}

/// Returns a kind with a pressure advance as answer.
service::JobKind Measuring(const char* name, const char* method) {
  service::JobKind kind;
  kind.name = name;
  kind.method = method;
  kind.answer = AnswerIn;
  kind.instrument = measurement::Instrument::kPressureAdvance;
  kind.apply = ApplyText;
  kind.undo = {"pa", "apply", "--undo"};
  kind.use = UseText;
  kind.in_force = [](const machine::PrinterState& state) {
    const auto advance_s = machine::ActiveAdvance_s(state);
    return advance_s ? fmt::format("{:.4f} s", *advance_s) : "";
  };
  return kind;
}

}  // namespace

service::JobKind PressureAdvanceJob() {
  service::JobKind kind = Measuring("pressure_advance", "trammel_offer");
  kind.looks = true;
  kind.arguments = {kFilament, kMaterial, service::kTemperatureArgument};
  kind.check = Check;
  kind.command = {"pa", "calibrate"};
  return kind;
}

service::JobKind PhotoPatternJob() {
  service::JobKind kind;
  kind.name = "photo_pattern";
  kind.method = "trammel_offer_pattern";
  kind.arguments = {kFilament, kMaterial, service::kTemperatureArgument};
  kind.check = CheckPattern;
  kind.command = {"pa", "print", "--photo"};
  kind.done = fmt::format(
      "Pattern printed, everything is off. Let the bed cool, take a photo from straight above, "
      "upload it into the folder {} beside printer.cfg. Measure it?",
      procedure::kUploadFolder);
  kind.start_buttons = procedure::Buttons::kPrint;
  kind.done_buttons = procedure::Buttons::kPhoto;
  return kind;
}

service::JobKind PhotoJob() {
  service::JobKind kind = Measuring("photo", "trammel_photo");
  kind.arguments = {kFilament, "file"};
  kind.check = CheckPhoto;
  kind.command = {"pa", "photo"};
  return kind;
}

}  // namespace trammel::app
