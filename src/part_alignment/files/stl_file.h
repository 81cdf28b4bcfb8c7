// Reads a part's surface as triangles from STL, or from any CAD format that has a reader.
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

/// Unit of lengths in a file that states none.
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

/// Makes the solid of a file's triangles (MakeSolid); errors name the file.
/// @param open  true: the shell may be open.
/// @param read  end of the notice of its size: "read in inch".
[[nodiscard]] Result<MeshFile> MakeMeshFile(const std::filesystem::path& path,
                                            part_alignment::TriangleMesh triangles, bool open,
                                            const std::string& read);

/// Reads a mesh that another file names; arguments as of ReadMeshFile.
using MeshReader = std::function<Result<MeshFile>(
    const std::filesystem::path& path, const std::optional<LengthUnit>& unit, bool open)>;

/// Reads the triangles of a binary or an ASCII STL, in mm, and welds equal corners. The content
/// decides which of the two it is, whatever its first word. Skips normals, attributes and bytes
/// behind the last triangle (StlTrailingBytes), which some programs write.
/// Errors (kInput) name file, place and remedy: neither of the two, cut short, more triangles than
/// it states, more than kMaxTriangles, a number that is invalid or not finite.
[[nodiscard]] Result<part_alignment::TriangleMesh> ParseStl(std::string_view bytes,
                                                            const std::string& file,
                                                            double mm_per_unit);

/// Counts the bytes behind the last triangle of a binary STL: fewer than the triangles, and no
/// whole number of them. 0 for any other file.
[[nodiscard]] std::size_t StlTrailingBytes(std::string_view bytes);

/// Reads a solid from a file (MakeSolid). Refuses files beyond 84 + 50 · kMaxTriangles bytes
/// unread.
/// @param unit  absent: mm, with a notice.
/// @param open  true: the shell may be open.
[[nodiscard]] Result<MeshFile> ReadMeshFile(const std::filesystem::path& path,
                                            const std::optional<LengthUnit>& unit, bool open);

}  // namespace trammel::files
