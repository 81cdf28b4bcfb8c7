#include "pressure_advance/procedure/spool_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "files/json_members.h"
#include "files/json_object.h"
#include "machine/moonraker/spoolman.h"
#include "pressure_advance/procedure/active_nozzle.h"

namespace trammel::procedure {
namespace {

using Json = nlohmann::json;
using machine::ExtraField;
using machine::Spoolman;
using machine::SpoolmanEntity;

constexpr double kAsk_s = 20;  // all of its questions together
constexpr double kMost_s = 10;

const ExtraField kOfFilament{"pressure_advance", "Pressure advance", "float", "s"};
const ExtraField kOfSpool{"pressure_advance_matrix", "Pressure advance by nozzle", "text", ""};

// What the spool's field holds: the text of a JSON object. Absent where it is something else.
std::optional<std::string> Matrix(const std::optional<Json>& field) {
  if (!field) return "{}";
  if (!field->is_string()) return std::nullopt;
  std::string text = field->get<std::string>();
  if (text.empty()) return "{}";
  const auto matrix = files::ParseJson(text, kOfSpool.key);
  if (!matrix || !matrix->is_object()) return std::nullopt;
  return text;
}

// Whether a value was kept, as far as is known.
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
  return Spoolman(session.printer, session.Within(kAsk_s)).ActiveSpool();
}

Result<SpoolPlace> FindSpoolPlace(const Session& session) {
  Spoolman spoolman(session.printer, session.Within(kAsk_s));
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
  // Of high flow only where somebody says so.
  place.nozzle = fmt::format("{:g}_standard", std::round(100 * nozzle.diameter_mm) / 100);
  return place;
}

Result<void> KeepOnSpool(const Session& session, const SpoolPlace& place,
                         double pressure_advance_s) {
  if (!(pressure_advance_s >= 0 && pressure_advance_s <= kMost_s)) {  // false for NaN
    return Fail(fmt::format("pressure advance {} s: must lie within 0 ... {}", pressure_advance_s,
                            kMost_s));
  }
  const double value_s = std::round(1e4 * pressure_advance_s) / 1e4;
  // Filament and spool belong together: a stop in between does not part them.
  Spoolman spoolman(session.printer, {kAsk_s, {}});
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
