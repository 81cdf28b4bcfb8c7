// trammel-step.so: a solid of a STEP file as triangles, by Open CASCADE. It works in a child, as
// that library may crash or run on without end over a damaged file.
#pragma once

#include <cstdint>
#include <string_view>
#include <type_traits>

#include "base/result.h"
#include "machine/cad/step_file.h"
#include "machine/net/child_process.h"

namespace trammel::machine {

/// What is told of a solid before its triangles.
struct StepHead {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t faces = 0;
  double chord_error_mm = 0;  ///< that was asked of the triangles
};
static_assert(std::is_trivially_copyable_v<StepHead>);

/// Kinds of messages, in this order: a StepHead; the unit's name; notices; pieces of the vertices
/// (three double each, mm), of the triangles (three std::uint32_t each) and of their lifts
/// (StepLift); the end; and in its place what is wrong with the file.
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
  /// Sends the one solid of a file. Errors: what is wrong with the file, in words for its owner.
  Result<void> (*send_solid)(std::string_view text, const StepReadOptions& options,
                             const ChildSender& sender);
};

/// The module's table. Errors (kInput): those of LoadModule.
[[nodiscard]] Result<const StepModule*> FindStepModule();

}  // namespace trammel::machine
