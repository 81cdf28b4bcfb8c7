// A part's surface as triangles: whatever is read gives finite distances or an error.
#include "part_alignment/files/stl_file.h"

#include <cmath>
#include <utility>

#include "fuzz.h"
#include "part_alignment/mesh/facet_error.h"
#include "part_alignment/mesh/solid_mesh.h"

TRAMMEL_FUZZ_TARGET(stl_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  auto mesh = files::ParseStl(fuzz::Text(data, size), "part.stl", 1);
  if (!fuzz::Good(mesh)) return 0;
  for (const bool open : {false, true}) {
    auto solid = part_alignment::MakeSolid(*mesh, open);
    if (!fuzz::Good(solid)) continue;
    const part_alignment::MeshDistance distance(std::move(*solid));
    for (const Eigen::Vector3d& at :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-1e5, 7, 0)}) {
      const auto found = distance.At(at);
      fuzz::Require(std::isfinite(found.mm) && found.outward.allFinite(), "distances are finite");
      const auto error = part_alignment::FacetErrorOf(distance, found.triangle);
      fuzz::Require(std::isfinite(error.either_mm()), "a facet's error is finite");
    }
  }
  return 0;
}
