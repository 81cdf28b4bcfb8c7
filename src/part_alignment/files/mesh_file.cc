#include "part_alignment/files/mesh_file.h"

#include <fmt/format.h>

#include <utility>

#include "part_alignment/mesh/solid_mesh.h"

namespace trammel::files {

std::optional<LengthUnit> LengthUnitOf(std::string_view name) {
  for (const LengthUnit& unit : {LengthUnit{"mm", 1}, LengthUnit{"cm", 10}, LengthUnit{"m", 1000},
                                 LengthUnit{"inch", 25.4}}) {
    if (unit.name == name) return unit;
  }
  return std::nullopt;
}

Result<MeshFile> MakeMeshFile(const std::filesystem::path& path,
                              part_alignment::TriangleMesh triangles, bool open,
                              const std::string& read) {
  auto solid = part_alignment::MakeSolid(std::move(triangles), open);
  if (!solid) {
    return Fail(fmt::format("{}: {}", path.string(), solid.error().message));
  }
  MeshFile made;
  const std::string name = path.filename().string();
  const std::vector<std::string> mended = std::move(solid->notices);
  auto mesh = std::make_shared<part_alignment::MeshDistance>(std::move(*solid));
  Eigen::Vector3d low = mesh->mesh().vertices_mm.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& at : mesh->mesh().vertices_mm) {
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  const Eigen::Vector3d extent = high - low;
  made.notices.push_back(fmt::format("{}: {} triangles, {:.6g} × {:.6g} × {:.6g} mm, {}", name,
                                     mesh->mesh().triangles.size(), extent.x(), extent.y(),
                                     extent.z(), read));
  for (const std::string& notice : mended) {
    made.notices.push_back(fmt::format("{}: {}", name, notice));
  }
  if (mesh->slivers() > 0) {
    made.notices.push_back(
        fmt::format("{}: {} triangles are too narrow to have a normal and take their neighbours'",
                    name, mesh->slivers()));
  }
  made.mesh = std::move(mesh);
  return made;
}

}  // namespace trammel::files
