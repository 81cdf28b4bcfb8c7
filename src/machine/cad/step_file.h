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
  double chord_error_mm = 0.02;          ///< of the triangles, > 0
  std::size_t most_triangles = 120'000;  ///< coarser ones are made of a part that would take more
  /// Open CASCADE is ended then, whatever the file. A plate with 800 bores took 45 s of a slow
  /// processor.
  int most_s = 60;
};

/// How far the part's own surface stands out of a triangle.
struct StepLift {
  /// Over the middle of the edge from corner k to the next, above 0 outside, mm.
  std::array<float, 3> middle_mm{};
  /// By how much the quadratic surface through corners and middles misses it, as far as was looked.
  float left_mm = 0;
};
static_assert(std::is_trivially_copyable_v<StepLift>);

/// A solid as triangles, counter-clockwise seen from outside, whose vertices lie on its surfaces.
struct StepSolid {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<StepLift> lifts;  ///< one for each triangle
  std::string unit;             ///< of the file: "mm", "inch", "m"
  std::size_t faces = 0;
  double chord_error_mm = 0;  ///< that the triangles were made for
  std::vector<std::string> notices;
};

/// Larger files are refused unread.
inline constexpr std::size_t kMostStepBytes = 100'000'000;

/// Whether a file that begins with these bytes is STEP: comments may stand before its first words.
[[nodiscard]] bool LooksLikeStep(std::string_view start);

/// The one solid of a file, in mm whatever its unit, by the module trammel-step.so, in a process of
/// its own whose memory and time are limited.
/// Errors (kInput), which name the file, what is wrong and the remedy: no STEP file, one that is
/// cut short; no length unit; no solid, several, a shell that is open, faces that do
/// not meet; whatever the reader rejects or dies of; the module or its libraries are missing.
[[nodiscard]] Result<StepSolid> ReadStepFile(const std::filesystem::path& path,
                                             const StepReadOptions& options = {});

}  // namespace trammel::machine
