// Writes scanned pages with the resolution that they state.
#pragma once

#include <filesystem>

#include "base/page.h"
#include "base/result.h"

namespace trammel::machine {

/// Whether WritePage can name the file so: it ends as one of its formats, and nothing is there yet.
[[nodiscard]] Result<void> CheckPagePath(const std::filesystem::path& path);

/// As TIFF or PNG, by the file's ending; both without loss.
/// Errors (kInput): another ending, a file that exists already or cannot be written; they name it.
[[nodiscard]] Result<void> WritePage(const Page& page, const std::filesystem::path& path);

}  // namespace trammel::machine
