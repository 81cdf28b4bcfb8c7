// A subject's texts as keys of a JSON object: of results, of snoozes, of --json.
#pragma once

#include <nlohmann/json.hpp>

#include "files/json_object.h"
#include "measurement/outcome.h"

namespace trammel::files {

/// Adds the texts that are not empty.
void AddSubject(nlohmann::ordered_json& json, const measurement::Subject& subject);

/// The texts, empty where they are missing. One that is no text, or longer than 1000 bytes, is a
/// fault of the object.
[[nodiscard]] measurement::Subject ReadSubjectTexts(JsonObject& object);

}  // namespace trammel::files
