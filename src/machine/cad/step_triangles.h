// Triangles of a solid of Open CASCADE.
#pragma once

#include <TopoDS_Shape.hxx>

#include "machine/cad/step_file.h"

namespace trammel::machine {

/// Triangles and their lifts; faces share the vertices of their common edges. Neither unit nor
/// notices, but that of triangles which had to be coarser.
/// Errors (kInput): a face that cannot be tessellated, surfaces and edges that do not meet.
[[nodiscard]] Result<StepSolid> TrianglesOf(const TopoDS_Shape& solid,
                                            const StepReadOptions& options);

}  // namespace trammel::machine
