// result.json: an instrument's result, beside the data that it comes from
// (docs/reference/formats.md).
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.h"
#include "files/new_file.h"
#include "measurement/outcome.h"

namespace trammel::files {

inline constexpr std::string_view kResultFile = "result.json";

/// Maximum size of a result file.
inline constexpr std::size_t kMaxResultBytes = 64u << 20;  // enough for every finger of every sheet

/// Returns the result as JSON, format 1, without details.
[[nodiscard]] nlohmann::ordered_json JsonOf(const measurement::Outcome& outcome);

/// Returns the same as text. `details` are the instrument's own, under that key; null: none.
[[nodiscard]] std::string ToJson(const measurement::Outcome& outcome,
                                 const nlohmann::ordered_json& details = nullptr);

/// Identifies a result: 64-bit FNV-1a of all content of result.json except the details, in
/// hexadecimal.
[[nodiscard]] std::string Fingerprint(const measurement::Outcome& outcome);

/// Adds a subject's non-empty texts, by their keys.
void AddSubject(nlohmann::ordered_json& json, const measurement::Subject& subject);

/// Parses a result. Errors (kInput) state the file, the key, the value and the bound. Errors are
/// also: a value without its uncertainty or with a verdict other than good; an interval that
/// contradicts the uncertainty; two answers of one name; a verdict that is not the worst of the
/// answers'. Skips details.
[[nodiscard]] Result<measurement::Outcome> ParseOutcome(std::string_view text,
                                                        const std::string& file);

/// Reads the result in a file, or in a folder's result.json. Errors: those of ParseOutcome; not
/// readable, larger than kMaxResultBytes.
[[nodiscard]] Result<measurement::Outcome> ReadOutcome(const std::filesystem::path& path);

/// Does the same for one instrument. Errors also: another's result, which is named.
[[nodiscard]] Result<measurement::Outcome> ReadOutcome(const std::filesystem::path& path,
                                                       measurement::Instrument instrument);

/// Writes a folder's result.json. Replaces only an earlier result of the same recording.
[[nodiscard]] Result<void> KeepOutcome(const std::filesystem::path& folder,
                                       const measurement::Outcome& outcome,
                                       const nlohmann::ordered_json& details = nullptr);

}  // namespace trammel::files
