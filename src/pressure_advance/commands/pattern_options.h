// Parses pressure advances and segments on the command line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/config/config_file.h"
#include "base/result.h"
#include "pressure_advance/commands/conditions_run.h"
#include "pressure_advance/commands/photo_analysis.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "pressure_advance/profile/line_profile.h"
#include "session/session.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace trammel::app {

/// Parses `0,0.01,0.02`, `START:END:STEP` or `START:END:COUNT`, both ends included. The third part
/// is a step if it fits between the ends, else a count: 0:0.1:0.005 has 21 values, 0:0.06:10 has
/// ten.
/// @returns At least one value, in s, rounded to 1e-9 s. Errors: not numbers, negative, above 10
///          s, reversed, a step that does not divide the range, more than 1000 values.
[[nodiscard]] Result<std::vector<double>> ParsePressureAdvances(std::string_view text);

/// Parses `FRACTION:SPEED,FRACTION:SPEED,…`, for example 0.1:10,0.6:100,0.3:10.
/// @returns Segments with fractions that sum to 1 (to 1e-3) and speeds within 0.1 … 2000
///          mm/s, or an error that names the part and the bound.
[[nodiscard]] Result<std::vector<pressure_advance::Segment>> ParseSegments(std::string_view text);

// Several patterns on one plate, as requested on the command line.

struct AskedPlate {
  std::optional<int> repeat;   ///< patterns alike; absent: one
  AskedConditions conditions;  ///< if patterns differ
  bool photo = false;          ///< is taken of it: no laser has to reach it
};

/// --repeat, --speeds, --accelerations and --max-flow.
/// @param of_one_answer  options that patterns under several conditions cannot go with
void AddPlateOptions(CLI::App& command, AskedPlate& asked,
                     const std::vector<CLI::Option*>& of_one_answer);

/// Arranges the requested patterns beside one another. Errors: those of PatternsBeside,
/// CombineConditions and LayConditions.
[[nodiscard]] Result<void> LayOnPlate(const AskedPlate& asked, const procedure::Reach& reach,
                                      files::Config& config);

/// Does the same within a printer's reach, before anything moves there. Errors: also those of
/// CheckReady.
[[nodiscard]] Result<void> LayOnPlateOf(const AskedPlate& asked, const procedure::Session& session,
                                        files::Config& config);

// Facts that a photo does not show: from the plan of trammel pa pattern.

/// Returns the lines of one pattern in their order on the bed, beginning with the line that was
/// printed first, or the outer line nearer to it.
/// @returns values and segments; the sides of the picture have their defaults. Errors name
///   `file`: lines that are not parallel or run in both directions; several
///   patterns that a photo cannot distinguish.
[[nodiscard]] Result<PhotoPlan> PhotoPlanOf(const pressure_advance::PatternPlan& plan,
                                            const std::string& file);

/// Sets the pattern of `pa pattern --photo`: 21 lines with a fast part nearer to the start than to
/// the end, two steps from the frame, and the mark.
void SetForPhoto(pressure_advance::PatternConfig& pattern);

/// Maximum size of a plan's file, bytes: 100,000 lines, a plan's maximum, remain below this.
inline constexpr std::size_t kMaxPlanFileBytes = std::size_t{32} << 20;

/// Reads a *.plan.json. Errors: it is missing or invalid.
[[nodiscard]] Result<pressure_advance::PatternPlan> ReadPatternPlan(
    const std::filesystem::path& file);

/// Reads a *.plan.json and calls PhotoPlanOf. Errors: those of both.
[[nodiscard]] Result<PhotoPlan> ReadPhotoPlan(const std::filesystem::path& file);

/// Does the same from text.
[[nodiscard]] Result<PhotoPlan> ParsePhotoPlan(const std::string& text, const std::string& file);

[[nodiscard]] bool IsPlanName(const std::string& name);

}  // namespace trammel::app
