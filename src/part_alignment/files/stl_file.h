// A part's surface as triangles from STL, or from any CAD format that a reader knows.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "part_alignment/mesh/mesh_distance.h"
#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::files {

/// Of lengths in a file that states none.
struct LengthUnit {
  std::string_view name;
  double mm = 1;
};
inline constexpr std::string_view kLengthUnitNames[] = {"mm", "cm", "m", "inch"};
/// @param name  one of kLengthUnitNames
[[nodiscard]] std::optional<LengthUnit> LengthUnitOf(std::string_view name);

struct MeshFile {
  std::shared_ptr<const part_alignment::MeshDistance> mesh;
  std::vector<std::string> notices;  ///< unit and size, and what was mended; each names the file
};

/// The solid of the triangles of a file (MakeSolid), whose errors name it.
/// @param open  whether the shell may be open.
/// @param read  ends the notice of its size: "read in inch".
[[nodiscard]] Result<MeshFile> MakeMeshFile(const std::filesystem::path& path,
                                            part_alignment::TriangleMesh triangles, bool open,
                                            const std::string& read);

/// Reads a mesh that another file names; arguments as of ReadMeshFile.
using MeshReader = std::function<Result<MeshFile>(
    const std::filesystem::path& path, const std::optional<LengthUnit>& unit, bool open)>;

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
