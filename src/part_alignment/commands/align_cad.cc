#include "part_alignment/commands/align_cad.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include "machine/cad/step_file.h"
#include "machine/net/file_bytes.h"
#include "part_alignment/files/stl_file.h"

namespace trammel::app {
namespace {

std::string Ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool NamesStep(const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 5> kEndings = {".step", ".stp", ".p21", ".stpz", ".stepz"};
  return std::find(kEndings.begin(), kEndings.end(), Ending(path)) != kEndings.end();
}

bool IsStep(const std::filesystem::path& path) {
  constexpr std::size_t kLooked = 4096;
  const auto start = machine::ReadFileStart(path, kLooked);
  return NamesStep(path) ||
         (start &&
          machine::LooksLikeStep({reinterpret_cast<const char*>(start->data()), start->size()}));
}

}  // namespace

bool NamesCad(const std::filesystem::path& path) {
  return NamesStep(path) || Ending(path) == ".stl";
}

Result<files::MeshFile> ReadCadFile(const std::filesystem::path& path,
                                    const std::optional<files::LengthUnit>& unit, bool open) {
  if (!IsStep(path)) return files::ReadMeshFile(path, unit, open);
  if (unit) {
    return Fail(fmt::format("{}: a STEP file states its unit itself; leave out {}", path.string(),
                            unit->name));
  }
  if (open) {
    return Fail(fmt::format("{}: an open shell is taken from an STL alone; leave out \"open\"",
                            path.string()));
  }
  auto solid = TRY(machine::ReadStepFile(path));
  part_alignment::TriangleMesh mesh;
  mesh.vertices_mm = std::move(solid.vertices_mm);
  mesh.triangles = std::move(solid.triangles);
  mesh.lifts.reserve(solid.lifts.size());
  for (const machine::StepLift& lift : solid.lifts) {
    mesh.lifts.push_back({lift.middle_mm, lift.left_mm});
  }
  auto made =
      files::MakeMeshFile(path, std::move(mesh), false,
                          fmt::format("of {} faces; its unit is {}", solid.faces, solid.unit));
  if (!made) return made;
  for (const std::string& notice : solid.notices) {
    made->notices.push_back(fmt::format("{}: {}", path.filename().string(), notice));
  }
  return made;
}

}  // namespace trammel::app
