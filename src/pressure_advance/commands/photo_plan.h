// What a photo cannot tell of itself: from the plan that trammel pa pattern wrote.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "base/result.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_plan.h"

namespace trammel::app {

/// The lines of one pattern, as they lie side by side on the bed; the first is the one that was
/// printed first, or the outer line nearer to it.
/// @returns values and segments; the sides of the picture are left at their defaults. Errors name
///   `file`: lines that are not parallel or run in both directions; several
///   patterns of which a photo could show either.
[[nodiscard]] Result<PhotoPlan> PhotoPlanOf(const pressure_advance::PatternPlan& plan,
                                            const std::string& file);

/// Makes it the pattern of `pa pattern --photo`: 21 lines that end their fast part sooner than they
/// begin it, two steps from the frame, and the mark.
void SetForPhoto(pressure_advance::PatternConfig& pattern);

/// A plan's largest file, bytes: 100,000 lines, the most that a plan may have, stay below this.
inline constexpr std::size_t kMostPlanFileBytes = std::size_t{32} << 20;

/// Reads a *.plan.json. Errors: there is none, or it cannot be used.
[[nodiscard]] Result<pressure_advance::PatternPlan> ReadPatternPlan(
    const std::filesystem::path& file);

/// PhotoPlanOf of a *.plan.json. Errors: those of both.
[[nodiscard]] Result<PhotoPlan> ReadPhotoPlan(const std::filesystem::path& file);

/// The same from its text.
[[nodiscard]] Result<PhotoPlan> ParsePhotoPlan(const std::string& text, const std::string& file);

/// Whether a file's name is that of a plan.
[[nodiscard]] bool IsPlanName(const std::string& name);

}  // namespace trammel::app
