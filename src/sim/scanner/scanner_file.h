// Files as scanning programs write them, with their resolution right, wrong or missing.
#pragma once

#include <filesystem>
#include <optional>

#include "base/random.h"
#include "base/result.h"
#include "sim/scanner/scanner_page.h"

namespace trammel::sim {

struct PageFileOptions {
  std::optional<double> dpi;  ///< what the file says, whatever is true; absent: says nothing
  int jpeg_quality = 90;      ///< 1 … 100
};

/// Scans into a new file; its name says what kind: .png (written row by row), .jpg or .jpeg (8 bit
/// only). What could not be finished is removed. Errors (kInput): another name, 16 bit JPEG, a file
/// that cannot be written.
[[nodiscard]] Result<void> WriteScan(const SheetScan& scan, const Random& random,
                                     const PageFileOptions& options,
                                     const std::filesystem::path& path);

}  // namespace trammel::sim
