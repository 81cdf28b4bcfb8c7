// From the status objects of Klipper to a PrinterState.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "machine/printer_state.h"

namespace trammel::machine {

/// Which objects and fields a PrinterState is made of, in the form of printer.objects.subscribe:
/// object -> list of fields, or null for all.
/// @param available  the answer of printer.objects.list: names of the printer's objects
[[nodiscard]] nlohmann::json WantedObjects(const std::vector<std::string>& available);

/// Puts the changed fields of an update over what is known. Anything that is not an object of
/// objects is ignored.
void MergeStatus(nlohmann::json& known, const nlohmann::json& update);

/// Reads what is known; fields that are missing or of a wrong type stay at their defaults.
/// readiness and message come from `webhooks` and are kDisconnected without it.
[[nodiscard]] PrinterState ReadStatus(const nlohmann::json& known, double eventtime_s);

}  // namespace trammel::machine
