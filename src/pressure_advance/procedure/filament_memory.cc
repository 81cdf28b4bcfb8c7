#include "pressure_advance/procedure/filament_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "pressure_advance/procedure/active_nozzle.h"

namespace trammel::procedure {
namespace {

using Json = nlohmann::json;
using Values = std::map<std::string, std::map<std::string, double>>;  // filament, nozzle

constexpr double kAsk_s = 10;
constexpr double kMost_s = 10;
constexpr std::size_t kMostFilaments = 1000;  // that are written: one line of G-code has them all

bool IsKeyPart(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; }

bool IsFilament(const std::string& key) {
  return !key.empty() && std::all_of(key.begin(), key.end(), IsKeyPart);
}

bool IsNozzle(const std::string& key) {
  return !key.empty() && std::all_of(key.begin(), key.end(),
                                     [](char c) { return IsKeyPart(c) || c == '/' || c == '.'; });
}

// What a variable holds; absent where it is not ours.
std::optional<Values> ValuesOf(const Json& variable) {
  if (!variable.is_object()) return std::nullopt;
  Values values;
  for (const auto& [filament, nozzles] : variable.items()) {
    if (!IsFilament(filament) || !nozzles.is_object()) return std::nullopt;
    for (const auto& [nozzle, value] : nozzles.items()) {
      if (!IsNozzle(nozzle) || !value.is_number()) return std::nullopt;
      const double value_s = value.get<double>();
      if (!(value_s >= 0 && value_s <= kMost_s)) return std::nullopt;
      values[filament][nozzle] = value_s;
    }
  }
  return values;
}

std::string Literal(const Values& values) {
  std::string text = "{";
  for (const auto& [filament, nozzles] : values) {
    text += fmt::format("{}'{}':{{", text.size() > 1 ? "," : "", filament);
    const char* between = "";
    for (const auto& [nozzle, value_s] : nozzles) {
      text += fmt::format("{}'{}':{}", between, nozzle, value_s);  // with all its digits
      between = ",";
    }
    text += "}";
  }
  return text + "}";
}

Result<Json> Variables(const Session& session) {
  auto told =
      TRY(session.printer.Query({{"save_variables", {"variables"}}}, session.Within(kAsk_s)));
  const auto variables = told["save_variables"].find("variables");
  if (variables == told["save_variables"].end() || !variables->is_object()) {
    return Fail(
        "the printer keeps no variables: add to printer.cfg a section [save_variables] with "
        "filename: ~/printer_data/config/variables.cfg, and restart Klipper");
  }
  return *variables;
}

Result<void> SaveVariable(const Session& session, const char* name, const Values& values) {
  return session.printer.Run(
      fmt::format("SAVE_VARIABLE VARIABLE={} VALUE=\"{}\"", name, Literal(values)),
      session.Within(kAsk_s));
}

// TRAMMEL_NEW_NOZZLE notes which values are of the nozzle before; this one is not any more.
Result<void> ForgetOldNozzle(const Session& session, const Json& variables,
                             const std::string& filament, const std::string& nozzle) {
  const auto noted = variables.find("trammel_pa_before");
  auto values = noted == variables.end() ? std::nullopt : ValuesOf(*noted);
  if (!values || values->count(filament) == 0 || (*values)[filament].erase(nozzle) == 0) return {};
  if ((*values)[filament].empty()) values->erase(filament);
  return SaveVariable(session, "trammel_pa_before", *values);
}

}  // namespace

Result<std::string> FilamentKey(std::string_view name) {
  constexpr std::size_t kMostBytes = 100;
  const std::size_t from = std::min(name.find_first_not_of(' '), name.size());
  name = name.substr(from, name.find_last_not_of(' ') + 1 - from);
  if (name.empty()) return Fail("the filament's name is empty; say which one it is");
  if (name.size() > kMostBytes) {
    return Fail(fmt::format("the filament's name has {} bytes; give one of at most {}", name.size(),
                            kMostBytes));
  }
  std::string key;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool continues = byte >= 0x80 && byte < 0xC0;  // a character of several bytes
    if (byte < ' ' || byte == 0x7F) {
      return Fail("the filament's name holds a control character; give it without");
    }
    if (c >= 'A' && c <= 'Z') {
      key += static_cast<char>(c - 'A' + 'a');
    } else if (IsKeyPart(c)) {
      key += c;
    } else if (c == ' ' || c == '-') {
      key += '_';
    } else {
      key += fmt::format("{}{:02x}", continues ? "" : "__", byte);
    }
  }
  return key;
}

Result<FilamentPlace> KeepForFilament(const Session& session, std::string_view name,
                                      double pressure_advance_s) {
  const auto key = TRY(FilamentKey(name));
  if (!(pressure_advance_s >= 0 && pressure_advance_s <= kMost_s)) {  // false for NaN
    return Fail(fmt::format("pressure advance {} s: must lie within 0 ... {}", pressure_advance_s,
                            kMost_s));
  }
  const auto variables = TRY(Variables(session));
  const auto active = TRY(AskActiveNozzle(session));
  const std::string nozzle = fmt::format("{}/{:.2f}", active.extruder, active.diameter_mm);
  const auto ours = variables.find("trammel_pa");
  auto values = ours == variables.end() ? Values{} : ValuesOf(*ours);
  if (!values) {
    return Fail(
        "trammel_pa of the printer's variables holds something that trammel did not write; look "
        "at the file that [save_variables] names, and delete that line");
  }
  if (values->size() >= kMostFilaments && values->count(key) == 0) {
    return Fail(
        fmt::format("{} filaments have a pressure advance there already: take those out of "
                    "trammel_pa that you have no more, in the file that [save_variables] names",
                    values->size()));
  }
  (*values)[key][nozzle] = std::round(1e4 * pressure_advance_s) / 1e4;
  TRY(SaveVariable(session, "trammel_pa", *values));
  TRY(ForgetOldNozzle(session, variables, key, nozzle));
  const auto after = TRY(Variables(session));
  const auto kept = after.contains("trammel_pa") ? ValuesOf(after["trammel_pa"]) : std::nullopt;
  constexpr double kRounding_s = 0.0001;
  if (!kept || kept->count(key) == 0 || kept->at(key).count(nozzle) == 0 ||
      std::abs(kept->at(key).at(nozzle) - pressure_advance_s) > kRounding_s) {
    return Fail(fmt::format("the printer was told to keep a pressure advance of {:.4f} s for {} "
                            "and does not tell it again",
                            pressure_advance_s, key),
                ErrorKind::kMachine);
  }
  return FilamentPlace{key, nozzle};
}

}  // namespace trammel::procedure
