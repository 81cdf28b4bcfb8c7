// Reads the G-code in a slicer's 3MF archive.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::files {

/// True of a ZIP archive's bytes, the form of a 3MF file.
[[nodiscard]] bool IsArchive(std::string_view bytes);

/// Returns the G-code of each plate, by the names of its files: Metadata/plate_1.gcode and so on in
/// a file of OrcaSlicer or Bambu Studio.
/// @param file       for messages.
/// @param max_bytes  largest size of all plates together.
/// Errors (kInput): the archive is damaged; it holds no G-code, as a project before slicing; too
/// large.
[[nodiscard]] Result<std::vector<std::string>> ReadGcodeArchive(std::string_view bytes,
                                                                const std::string& file,
                                                                std::size_t max_bytes);

}  // namespace trammel::files
