// remark.json: what an owner wrote about a result, beside it (docs/reference/formats.md).
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace trammel::files {

inline constexpr const char* kRemarkFile = "remark.json";

/// Maximum size of a note, a page of text.
inline constexpr std::size_t kMaxNoteBytes = 500;

struct Remark {
  std::string note = {};  ///< UTF-8, at most kMaxNoteBytes; may have several lines
  bool pinned = false;    ///< its recording is not removed to make room

  bool operator==(const Remark&) const = default;
};

/// Reads the remark in a recording's folder; an empty one if there is none that can be read.
[[nodiscard]] Remark ReadRemark(const std::filesystem::path& folder);

/// Replaces it; an empty one removes the file. Errors (kInput): a note that is too long or no
/// UTF-8; not written.
[[nodiscard]] Result<void> WriteRemark(const std::filesystem::path& folder, const Remark& remark);

}  // namespace trammel::files
