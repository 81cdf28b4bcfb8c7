// result.json: what an instrument found, beside the data that it found it in (docs/formats.md).
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"
#include "files/new_file.h"
#include "measurement/outcome.h"

namespace trammel::files {

inline constexpr std::string_view kResultFile = "result.json";

/// Beside the folders of recordings: a line of each result, never cut.
inline constexpr std::string_view kHistoryFile = "history.jsonl";

/// The largest result that is read.
inline constexpr std::size_t kMaxResultBytes = 64u << 20;  // with every finger of every sheet

/// The result as JSON, format 1, without details.
[[nodiscard]] nlohmann::ordered_json JsonOf(const measurement::Outcome& outcome);

/// The same as a text. `details` are the instrument's own, under that key; null: none.
[[nodiscard]] std::string ToJson(const measurement::Outcome& outcome,
                                 const nlohmann::ordered_json& details = nullptr);

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

/// One line of history.jsonl: ToJson without details, with `folder`, where the recording is.
[[nodiscard]] std::string HistoryLine(const measurement::Outcome& outcome,
                                      const std::filesystem::path& folder);

/// Reads such a line: the result, and the folder. Errors: those of ParseOutcome.
[[nodiscard]] Result<std::pair<measurement::Outcome, std::string>> ParseHistoryLine(
    std::string_view line, const std::string& where);

}  // namespace trammel::files
