// Several patterns on one plate, as the command line asks for them.
#pragma once

#include <optional>
#include <vector>

#include "app/config/config_file.h"
#include "base/result.h"
#include "pressure_advance/commands/conditions_run.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "session/session.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace trammel::app {

struct AskedPlate {
  std::optional<int> repeat;   ///< patterns alike; absent: one
  AskedConditions conditions;  ///< of patterns that differ
  bool photo = false;          ///< is taken of it: no laser has to reach it
};

/// --repeat, --speeds, --accelerations and --max-flow.
/// @param of_one_answer  options that patterns under several conditions cannot go with
void AddPlateOptions(CLI::App& command, AskedPlate& asked,
                     const std::vector<CLI::Option*>& of_one_answer);

/// Puts the patterns that are asked for beside one another. Errors: those of PatternsBeside,
/// CombineConditions and LayConditions.
[[nodiscard]] Result<void> LayOnPlate(const AskedPlate& asked, const procedure::Reach& reach,
                                      files::Config& config);

/// The same within a printer's reach, before anything moves there. Errors: those of CheckReady,
/// too.
[[nodiscard]] Result<void> LayOnPlateOf(const AskedPlate& asked, const procedure::Session& session,
                                        files::Config& config);

}  // namespace trammel::app
