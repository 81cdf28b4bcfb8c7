// Reads the G-code in a slicer's 3MF archive.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::files {

/// True of a ZIP archive's bytes, the form of a 3MF file.
[[nodiscard]] bool IsArchive(std::string_view bytes);

/// G-code of one plate.
struct GcodePlate {
  std::string name;  ///< of its file, without folder and ending: plate_1 and so on
  std::string gcode;
};

/// Returns the plates by the names of their files: Metadata/plate_1.gcode and so on in a file of
/// OrcaSlicer or Bambu Studio.
/// @param file       for messages.
/// @param max_bytes  largest size of all plates together.
/// Errors (kInput): the archive is damaged; it holds no G-code, as a project before slicing; too
/// large.
[[nodiscard]] Result<std::vector<GcodePlate>> ReadGcodeArchive(std::string_view bytes,
                                                               const std::string& file,
                                                               std::size_t max_bytes);

}  // namespace trammel::files
