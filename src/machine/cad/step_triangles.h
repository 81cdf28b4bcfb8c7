// Triangulates a solid of Open CASCADE.
#pragma once

#include <TopoDS_Shape.hxx>

#include "machine/cad/step_file.h"

namespace trammel::machine {

/// Computes triangles and their lifts; faces share the vertices of their common edges. Sets neither
/// unit nor notices, except the notice of triangles that had to be coarser.
/// Errors (kInput): a face that cannot be tessellated, surfaces and edges that do not meet.
[[nodiscard]] Result<StepSolid> TrianglesOf(const TopoDS_Shape& solid,
                                            const StepReadOptions& options);

}  // namespace trammel::machine
