// The ideal part from CAD: STEP or STL, whichever the file is.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "part_alignment/files/mesh_file.h"

namespace trammel::app {

/// Whether a file is named as one of STEP or STL is.
[[nodiscard]] bool NamesCad(const std::filesystem::path& path);

/// Reads either as its first bytes, then its name, say (machine/cad/step_file.h, ReadMeshFile).
/// Errors (kInput) besides: a STEP file that is given a unit, having its own, or may be open.
[[nodiscard]] Result<files::MeshFile> ReadCadFile(const std::filesystem::path& path,
                                                  const std::optional<files::LengthUnit>& unit,
                                                  bool open);

}  // namespace trammel::app
