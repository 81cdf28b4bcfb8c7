// From the status objects of Klipper to a PrinterState.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Which objects and fields a PrinterState is made of, in the form of printer.objects.subscribe:
/// object -> list of fields. Of more heaters than any printer has, one more than ReadStatus
/// takes; names that could not stand in G-code are left out.
/// @param available  the answer of printer.objects.list: names of the printer's objects
[[nodiscard]] nlohmann::json WantedObjects(const std::vector<std::string>& available);

/// Puts the changed fields of an update over what is known: of those that were asked for, whatever
/// else the server sends. A value far larger than any printer's counts as null.
/// @param wanted  of WantedObjects
void MergeStatus(nlohmann::json& known, const nlohmann::json& update, const nlohmann::json& wanted);

/// Of Klipper's word for its state; kDisconnected for any other.
[[nodiscard]] PrinterReadiness ReadinessOf(std::string_view state);

/// Reads what is known; fields that are missing, of a wrong type or out of bounds stay at their
/// defaults. readiness and message come from `webhooks` and are kDisconnected without it.
/// @param fault  where not null: the first value that no printer has, by field and value, or "".
///               A state with a fault is not to be used for anything but showing it.
[[nodiscard]] PrinterState ReadStatus(const nlohmann::json& known, std::string* fault = nullptr);

}  // namespace trammel::machine
