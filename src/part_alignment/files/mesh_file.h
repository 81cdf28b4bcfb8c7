// A part's surface as triangles, whichever CAD format it was in.
#pragma once

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

}  // namespace trammel::files
