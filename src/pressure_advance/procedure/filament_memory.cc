#include "pressure_advance/procedure/filament_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "files/json_object.h"
#include "machine/moonraker/spoolman.h"
#include "pressure_advance/procedure/apply_pressure_advance.h"

namespace trammel::procedure {
namespace {

using Json = nlohmann::json;
using Values = std::map<std::string, std::map<std::string, double>>;  // filament, nozzle

constexpr double kAsk_s = 10;
constexpr double kMax_s = 10;
constexpr std::size_t kMaxFilaments = 1000;  // written: all are in one line of G-code

bool IsKeyPart(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; }

bool IsFilament(const std::string& key) {
  return !key.empty() && std::all_of(key.begin(), key.end(), IsKeyPart);
}

bool IsNozzle(const std::string& key) {
  return !key.empty() && std::all_of(key.begin(), key.end(),
                                     [](char c) { return IsKeyPart(c) || c == '/' || c == '.'; });
}

// Reads a variable; absent if it is not ours.
std::optional<Values> ValuesOf(const Json& variable) {
  if (!variable.is_object()) return std::nullopt;
  Values values;
  for (const auto& [filament, nozzles] : variable.items()) {
    if (!IsFilament(filament) || !nozzles.is_object()) return std::nullopt;
    for (const auto& [nozzle, value] : nozzles.items()) {
      if (!IsNozzle(nozzle) || !value.is_number()) return std::nullopt;
      const double value_s = value.get<double>();
      if (!(value_s >= 0 && value_s <= kMax_s)) return std::nullopt;
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
      text += fmt::format("{}'{}':{}", between, nozzle, value_s);  // full precision
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

// TRAMMEL_NEW_NOZZLE marks the values of the old nozzle; removes the mark from this one.
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
  constexpr std::size_t kMaxBytes = 100;
  const std::size_t from = std::min(name.find_first_not_of(' '), name.size());
  name = name.substr(from, name.find_last_not_of(' ') + 1 - from);
  if (name.empty()) return Fail("the filament's name is empty; say which one it is");
  if (name.size() > kMaxBytes) {
    return Fail(fmt::format("the filament's name has {} bytes; give one of at most {}", name.size(),
                            kMaxBytes));
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
  if (!(pressure_advance_s >= 0 && pressure_advance_s <= kMax_s)) {  // false for NaN
    return Fail(
        fmt::format("pressure advance {} s: must lie within 0 ... {}", pressure_advance_s, kMax_s));
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
  if (values->size() >= kMaxFilaments && values->count(key) == 0) {
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

namespace {

using machine::ExtraField;
using machine::Spoolman;
using machine::SpoolmanEntity;

constexpr double kAskSpoolman_s = 20;  // all of its questions together

const ExtraField kOfFilament{"pressure_advance", "Pressure advance", "float", "s"};
const ExtraField kOfSpool{"pressure_advance_matrix", "Pressure advance by nozzle", "text", ""};

// Returns the JSON object in the spool's field, as text. Absent if it contains something else.
std::optional<std::string> Matrix(const std::optional<Json>& field) {
  if (!field) return "{}";
  if (!field->is_string()) return std::nullopt;
  std::string text = field->get<std::string>();
  if (text.empty()) return "{}";
  const auto matrix = files::ParseJson(text, kOfSpool.key);
  if (!matrix || !matrix->is_object()) return std::nullopt;
  return text;
}

// Describes whether a value was stored, as far as known.
std::string Kept(const char* of, std::optional<bool> written) {
  if (!written) return fmt::format("whether the {}'s value was kept is not known", of);
  return *written ? fmt::format("the {}'s value was sent and does not read back as it was", of)
                  : fmt::format("the {}'s value is not kept", of);
}

Result<std::string> ReadMatrix(Spoolman& spoolman, int spool_id) {
  const auto field = TRY(spoolman.Extra(SpoolmanEntity::kSpool, spool_id, kOfSpool.key));
  auto matrix = Matrix(field);
  if (matrix) return *matrix;
  return Fail(
      fmt::format("'{}' of spool {} holds something that is no list of values by nozzle: it stays "
                  "as it is; empty it in Spoolman, or leave Spoolman out",
                  kOfSpool.key, spool_id));
}

}  // namespace

Result<std::optional<machine::Spool>> SpoolOnPrinter(const Session& session) {
  return Spoolman(session.printer, session.Within(kAskSpoolman_s)).ActiveSpool();
}

Result<SpoolPlace> FindSpoolPlace(const Session& session) {
  Spoolman spoolman(session.printer, session.Within(kAskSpoolman_s));
  const auto known = TRY(spoolman.Known());
  if (!known) {
    return Fail(
        "the printer's Moonraker knows of no Spoolman: add [spoolman] with server: "
        "http://ADDRESS:7912 to moonraker.conf, or leave --spoolman out");
  }
  const auto spool = TRY(spoolman.ActiveSpool());
  if (!spool) {
    return Fail(
        "Spoolman knows of no spool on this printer: choose the one that is loaded in Mainsail or "
        "Fluidd, or leave --spoolman out");
  }
  SpoolPlace place;
  place.spool_id = spool->id;
  place.filament_id = spool->filament_id;
  place.filament = spool->filament;
  place.archived = spool->archived;
  const auto of_filament = TRY(spoolman.HasField(SpoolmanEntity::kFilament, kOfFilament));
  const auto of_spool = TRY(spoolman.HasField(SpoolmanEntity::kSpool, kOfSpool));
  place.new_fields = !of_filament || !of_spool;
  const auto before =
      TRY(spoolman.Extra(SpoolmanEntity::kFilament, place.filament_id, kOfFilament.key));
  if (before && before->is_number()) place.before_s = before->get<double>();
  const auto matrix = TRY(ReadMatrix(spoolman, place.spool_id));
  if (matrix != "{}") place.matrix_before = machine::FieldText(Json::parse(matrix));
  const auto nozzle = TRY(AskActiveNozzle(session));
  // High flow only on explicit request.
  place.nozzle = fmt::format("{:g}_standard", std::round(100 * nozzle.diameter_mm) / 100);
  return place;
}

Result<void> KeepOnSpool(const Session& session, const SpoolPlace& place,
                         double pressure_advance_s) {
  if (!(pressure_advance_s >= 0 && pressure_advance_s <= kMax_s)) {  // false for NaN
    return Fail(
        fmt::format("pressure advance {} s: must lie within 0 ... {}", pressure_advance_s, kMax_s));
  }
  const double value_s = std::round(1e4 * pressure_advance_s) / 1e4;
  // Filament and spool belong together: a stop does not separate them.
  Spoolman spoolman(session.printer, {kAskSpoolman_s, {}});
  for (const auto& [entity, field] : {std::pair{SpoolmanEntity::kFilament, &kOfFilament},
                                      std::pair{SpoolmanEntity::kSpool, &kOfSpool}}) {
    const auto there = TRY(spoolman.HasField(entity, *field));
    if (there) continue;
    TRY(spoolman.AddField(entity, *field));
  }
  auto matrix = TRY(ReadMatrix(spoolman, place.spool_id));
  files::JsonMembers values(matrix, {});  // those of others keep their digits
  values.Set(place.nozzle, value_s);
  std::optional<bool> written;
  auto filament = spoolman.SetExtra(SpoolmanEntity::kFilament, place.filament_id, kOfFilament.key,
                                    value_s, written);
  if (!filament) {
    return Fail(fmt::format("{}, and the spool's was not sent: {}", Kept("filament", written),
                            filament.error().message),
                filament.error().kind);
  }
  auto spool = spoolman.SetExtra(SpoolmanEntity::kSpool, place.spool_id, kOfSpool.key,
                                 values.text(), written);
  if (spool) return {};
  return Fail(fmt::format("the filament's value is kept; {}: {}", Kept("spool", written),
                          spool.error().message),
              spool.error().kind);
}

}  // namespace trammel::procedure
