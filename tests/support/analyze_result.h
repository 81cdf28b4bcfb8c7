// Checks of `trammel pa analyze` against its guarantees.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/run_trammel.h"

namespace trammel::test {

/// Runs `trammel pa analyze ARGUMENTS --json` and parses the object. Expects of every answer, good
/// or not: nothing else on standard output, the documented keys and types, nulls unless the verdict
/// is good, and the exit code that belongs to the verdict. Null where there was no object.
[[nodiscard]] nlohmann::json AnalyzeToJson(const std::string& arguments,
                                           const std::filesystem::path& folder,
                                           const RunLimits& limits = {});

/// Expects of a run with --json: exit code 1, not a word on standard output, and a message that
/// says all of `words`.
void ExpectRejected(const std::string& arguments, const std::filesystem::path& folder,
                    const std::vector<std::string>& words);

/// Expects of a run with --json: exit code 2, a verdict without a number, and a reason that says
/// all of `words`.
void ExpectRefused(const std::string& arguments, const std::filesystem::path& folder,
                   const std::vector<std::string>& words);

/// The same of a run without --json: all of `words`, and no value or command to copy.
void ExpectRefusalText(const std::string& arguments, const std::filesystem::path& folder,
                       const std::vector<std::string>& words);

}  // namespace trammel::test
