// Conversion of Klipper's status objects to a PrinterState.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Returns the objects and fields of a PrinterState in the form of printer.objects.subscribe:
/// object -> list of fields. With more heaters than any printer has: one more than ReadStatus
/// accepts. Names that are invalid in G-code are omitted.
/// @param available  the answer of printer.objects.list: names of the printer's objects
[[nodiscard]] nlohmann::json WantedObjects(const std::vector<std::string>& available);

/// Merges an update's changed fields into the known status: only requested fields. A value far
/// larger than any printer's counts as null.
/// @param wanted  of WantedObjects
void MergeStatus(nlohmann::json& known, const nlohmann::json& update, const nlohmann::json& wanted);

/// Converts Klipper's name of its state; kDisconnected for any other.
[[nodiscard]] PrinterReadiness ReadinessOf(std::string_view state);

/// Reads the known status; fields that are missing, of a wrong type or out of bounds have their
/// defaults. readiness and message come from `webhooks`; kDisconnected without it.
/// @param fault  if not null: the first impossible value, by field and value, or "".
///               A state with a fault may only be displayed.
[[nodiscard]] PrinterState ReadStatus(const nlohmann::json& known, std::string* fault = nullptr);

}  // namespace trammel::machine
