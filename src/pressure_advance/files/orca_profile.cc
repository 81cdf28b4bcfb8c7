#include "pressure_advance/files/orca_profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/file_kind.h"
#include "files/json_object.h"

namespace trammel::files {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxExtruders = 16;

bool IsList(const Json& value) {
  if (!value.is_array() || value.empty() || value.size() > kMaxExtruders) return false;
  for (const Json& entry : value) {
    if (!entry.is_string()) return false;
  }
  return true;
}

// Any other value may mean on.
bool IsOff(const Json& value) {
  if (value.is_array()) return std::all_of(value.begin(), value.end(), IsOff);
  return value == "0" || value == "" || value == 0 || value == false || value.is_null();
}

// Returns as many entries as the profile has for that key, at least one.
Json Entries(const Json& profile, const char* key, const std::string& entry) {
  const std::size_t size = profile.contains(key) ? profile[key].size() : 1;
  return std::vector<std::string>(size, entry);
}

Result<void> CheckRows(std::span<const pressure_advance::FlowPoint> rows) {
  for (const pressure_advance::FlowPoint& row : rows) {
    const auto flows = std::ranges::count_if(rows, [&](const auto& other) {
      return std::lround(other.acceleration_mm_s2) == std::lround(row.acceleration_mm_s2);
    });
    if (flows < 2) {
      return Fail(
          fmt::format("{:.0f} mm/s2 has one flow, {:.2f} mm3/s: OrcaSlicer drops an "
                      "acceleration without a second one",
                      row.acceleration_mm_s2, row.flow_mm3_s));
    }
    constexpr double kMax_s = 2;
    const double value_s = row.pressure_advance_s.value;
    if (!(value_s >= 0 && value_s <= kMax_s)) {
      return Fail(fmt::format("pressure advance {} s at {:.2f} mm3/s: OrcaSlicer takes 0 ... {}",
                              value_s, row.flow_mm3_s, kMax_s));
    }
  }
  return {};
}

}  // namespace

std::string AdaptiveModel(std::span<const pressure_advance::FlowPoint> rows) {
  std::string model;
  for (const pressure_advance::FlowPoint& row : rows) {
    model += fmt::format("{}{:.4f},{:.2f},{:.0f}", model.empty() ? "" : "\n",
                         row.pressure_advance_s.value, row.flow_mm3_s, row.acceleration_mm_s2);
  }
  return model;
}

Result<OrcaProfile> WithPressureAdvance(std::string_view profile, const std::string& file,
                                        double pressure_advance_s,
                                        std::span<const pressure_advance::FlowPoint> rows) {
  TRY(CheckRows(rows));
  constexpr double kMax_s = 2;
  if (!(pressure_advance_s >= 0 && pressure_advance_s <= kMax_s)) {  // false for NaN
    return Fail(fmt::format("pressure advance {} s: OrcaSlicer takes 0 ... {}", pressure_advance_s,
                            kMax_s));
  }
  if (const auto kind = KindByContent(profile); kind && kind->is_archive) {
    return Fail(
        fmt::format("{}: is {} as OrcaSlicer's bundles are: unpack it and give the "
                    "filament's .json",
                    file, kind->name));
  }
  TRY(ParseJson(profile, file));
  const Json json = Json::parse(profile, nullptr, false);
  const bool of_filament = json.is_object() && json.contains("filament_settings_id") &&
                           (!json.contains("type") || json["type"] == "filament");
  if (!of_filament) {
    return Fail(
        fmt::format("{}: is no filament profile of OrcaSlicer (it has no "
                    "filament_settings_id); export your filament there and give that file",
                    file));
  }
  for (const char* key : {"enable_pressure_advance", "pressure_advance"}) {
    if (json.contains(key) && !IsList(json[key])) {
      return Fail(fmt::format("{}: {} must be a list of 1 ... {} texts; export the profile anew",
                              file, key, kMaxExtruders));
    }
  }
  OrcaProfile made;
  JsonMembers members(profile, {.indent = 4});
  const Json values = Entries(json, "pressure_advance", fmt::format("{:.4f}", pressure_advance_s));
  members.Set("pressure_advance", values);
  const bool fewer = !json.contains("enable_pressure_advance") ||
                     json["enable_pressure_advance"].size() < values.size();
  members.Set("enable_pressure_advance",
              Entries(json, fewer ? "pressure_advance" : "enable_pressure_advance", "1"));
  const char* adaptive = "adaptive_pressure_advance";
  if (!rows.empty()) {
    const char* model = "adaptive_pressure_advance_model";
    for (const char* key : {adaptive, model}) {
      if (json.contains(key) && !IsList(json[key])) {
        return Fail(fmt::format("{}: {} must be a list of 1 ... {} texts; export the profile anew",
                                file, key, kMaxExtruders));
      }
    }
    members.Set(adaptive, Entries(json, adaptive, "1"));
    members.Set(model, Entries(json, model, AdaptiveModel(rows)));
  } else if (json.contains(adaptive) && !IsOff(json[adaptive])) {
    const std::size_t size = json[adaptive].is_array() ? json[adaptive].size() : 1;
    members.Set(adaptive,
                std::vector<std::string>(std::clamp<std::size_t>(size, 1, kMaxExtruders), "0"));
    made.notices.emplace_back(
        "adaptive pressure advance is switched off: it would override the value");
  }
  made.text = members.text();
  if (!made.text.ends_with('\n')) made.text += '\n';
  return made;
}

}  // namespace trammel::files
