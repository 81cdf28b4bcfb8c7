// trammel-step.so: converts a STEP file's solid to triangles, by Open CASCADE. It runs in a child
// process, since that library may crash or loop endlessly on a damaged file.
#pragma once

#include <cstdint>
#include <string_view>
#include <type_traits>

#include "base/result.h"
#include "machine/cad/step_file.h"
#include "machine/net/child_process.h"

namespace trammel::machine {

/// Header of a solid, before its triangles.
struct StepHead {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t faces = 0;
  double chord_error_mm = 0;  ///< requested for the triangles
};
static_assert(std::is_trivially_copyable_v<StepHead>);

/// Kinds of messages, in this order: a StepHead; the unit's name; notices; pieces of the vertices
/// (three double each, mm), of the triangles (three std::uint32_t each) and of their lifts
/// (StepLift); the end, or in its place the fault of the file.
enum StepMessage : std::uint32_t {
  kStepHead = 1,
  kStepUnit,
  kStepNotice,
  kStepVertices,
  kStepTriangles,
  kStepLifts,
  kStepEnds,
  kStepFault,
};

struct StepModule {
  /// Sends the single solid of a file. Errors: the file's fault, in words for its owner.
  Result<void> (*send_solid)(std::string_view text, const StepReadOptions& options,
                             const ChildSender& sender);
};

/// Returns the module's function table. Errors (kInput): those of LoadModule.
[[nodiscard]] Result<const StepModule*> FindStepModule();

}  // namespace trammel::machine
