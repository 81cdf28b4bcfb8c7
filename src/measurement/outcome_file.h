// result.json: what an instrument found, beside the data that it found it in
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

/// The largest result that is read.
inline constexpr std::size_t kMaxResultBytes = 64u << 20;  // with every finger of every sheet

/// The result as JSON, format 1, without details.
[[nodiscard]] nlohmann::ordered_json JsonOf(const measurement::Outcome& outcome);

/// The same as a text. `details` are the instrument's own, under that key; null: none.
[[nodiscard]] std::string ToJson(const measurement::Outcome& outcome,
                                 const nlohmann::ordered_json& details = nullptr);

/// Tells results apart: 64-bit FNV-1a of all that result.json says but the details, in hexadecimal.
[[nodiscard]] std::string Fingerprint(const measurement::Outcome& outcome);

/// Adds a subject's texts that are not empty, by their keys.
void AddSubject(nlohmann::ordered_json& json, const measurement::Subject& subject);

/// Reads a result. Errors (kInput) name the file, the key, the value and the bound; a value without
/// its uncertainty, or beside a verdict that is not good, is one, so are an interval that no such
/// uncertainty gives, two answers of one name and a verdict that is not the worst of the answers'.
/// Details are passed over.
[[nodiscard]] Result<measurement::Outcome> ParseOutcome(std::string_view text,
                                                        const std::string& file);

/// The result in a file, or in a folder's result.json. Errors: those of ParseOutcome; not readable,
/// larger than kMaxResultBytes.
[[nodiscard]] Result<measurement::Outcome> ReadOutcome(const std::filesystem::path& path);

/// The same of one instrument. Errors: another's, which is named, too.
[[nodiscard]] Result<measurement::Outcome> ReadOutcome(const std::filesystem::path& path,
                                                       measurement::Instrument instrument);

/// Writes a folder's result.json. A result of an earlier analysis of the same recording is
/// replaced; nothing else is.
[[nodiscard]] Result<void> KeepOutcome(const std::filesystem::path& folder,
                                       const measurement::Outcome& outcome,
                                       const nlohmann::ordered_json& details = nullptr);

}  // namespace trammel::files
