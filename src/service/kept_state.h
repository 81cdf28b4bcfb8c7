// What a service keeps on disk of a printer: its last run, and the answer that waits for a
// decision.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "service/run_record.h"

namespace trammel::service {

struct KeptState {
  std::optional<RunRecord> run = {};
  std::optional<Proposal> proposal = {};
};

/// Where a printer's state lies (docs/formats.md). @param address  plain, as locks are named by it
[[nodiscard]] std::filesystem::path KeptStatePath(const std::filesystem::path& state_folder,
                                                  std::string_view address);

/// Replaces the file whole. Errors: kInput.
[[nodiscard]] Result<void> WriteKeptState(const std::filesystem::path& path,
                                          const KeptState& state);

/// Nothing of either where there is no such file. A run that had not ended is given back as
/// kUnknown. Errors: kInput where it cannot be read or holds what no service writes.
[[nodiscard]] Result<KeptState> ReadKeptState(const std::filesystem::path& path);

/// The same of a text; `file` names it in errors.
[[nodiscard]] Result<KeptState> ParseKeptState(std::string_view text, const std::string& file);

}  // namespace trammel::service
