// Reads STEP: a part's solid from any CAD program, with its unit (ISO 10303-21; AP203, 214, 242).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

struct StepReadOptions {
  double chord_error_mm = 0.02;         ///< limit for the triangles, > 0
  std::size_t max_triangles = 120'000;  ///< coarser ones are made of a part that would take more
  /// Time limit of Open CASCADE, for any file. A plate with 800 bores took 45 s on a slow
  /// processor.
  int max_s = 60;
};

/// Height of the part's own surface above a triangle.
struct StepLift {
  /// Lift at the middle of the edge from corner k to the next, positive outside, mm.
  std::array<float, 3> middle_mm{};
  /// Distance of the surface from the quadratic one through corners and middles, where checked, mm.
  float left_mm = 0;
};
static_assert(std::is_trivially_copyable_v<StepLift>);

/// Solid as triangles, counter-clockwise seen from outside, with vertices on its surfaces.
struct StepSolid {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<StepLift> lifts;  ///< one for each triangle
  std::string unit;             ///< file's length unit: "mm", "inch", "m"
  std::size_t faces = 0;
  double chord_error_mm = 0;  ///< requested for the triangles
  std::vector<std::string> notices;
};

/// Maximum file size; larger files are rejected unread.
inline constexpr std::size_t kMaxStepBytes = 100'000'000;

/// True if the first bytes are those of a STEP file: comments may precede its first words.
[[nodiscard]] bool LooksLikeStep(std::string_view start);

/// Reads the single solid of a file, in mm whatever its unit, by the module trammel-step.so, in a
/// separate process with limited memory and time.
/// Errors (kInput), which name the file, the fault and the remedy: no STEP file, a truncated one;
/// no length unit; no solid, several, an open shell, faces that do not meet; whatever the reader
/// rejects or crashes on; a missing module or library.
[[nodiscard]] Result<StepSolid> ReadStepFile(const std::filesystem::path& path,
                                             const StepReadOptions& options = {});

}  // namespace trammel::machine
