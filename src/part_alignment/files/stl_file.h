// STL: a part's surface as triangles, from any CAD program.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "part_alignment/files/mesh_file.h"
#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::files {

/// Triangles of a binary or an ASCII STL, in mm, equal corners welded; which of the two it is the
/// content tells, whatever its first word says. Normals and attributes are not read, nor is what
/// some programs write behind the last triangle (StlTrailingBytes).
/// Errors (kInput) name file, place and remedy: neither of the two, cut short, more triangles than
/// it states, more than kMostTriangles, a number that is none or not finite.
[[nodiscard]] Result<part_alignment::TriangleMesh> ParseStl(std::string_view bytes,
                                                            const std::string& file,
                                                            double mm_per_unit);

/// Bytes behind the last triangle of a binary STL, which are less than the triangles and no whole
/// number of them; 0 for any other file.
[[nodiscard]] std::size_t StlTrailingBytes(std::string_view bytes);

/// A solid from a file (MakeSolid). Files beyond 84 + 50 · kMostTriangles bytes are refused unread.
/// @param unit  absent: mm, which a notice says.
/// @param open  whether the shell may be open.
[[nodiscard]] Result<MeshFile> ReadMeshFile(const std::filesystem::path& path,
                                            const std::optional<LengthUnit>& unit, bool open);

}  // namespace trammel::files
