// trammel pa listen: trammel serve, with nothing but pressure advance to offer.
#include <CLI/CLI.hpp>
#include <memory>

#include "app/serve_command.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/commands/pressure_advance_job.h"

namespace trammel::app {

void AddListenCommand(CLI::App& parent, int& exit_code) {
  const auto keep_full = std::make_shared<bool>(false);
  CLI::App* command = parent.add_subcommand(
      "listen", "trammel serve with pressure advance alone: for services that were set up so");
  AddServeOptions(*command, exit_code, [keep_full] {
    service::JobKind job = PressureAdvanceJob();
    if (*keep_full) job.words.emplace_back("--keep-full");
    return service::Offerings{{std::move(job)}, {}};
  });
  AddKeepFullOption(*command, *keep_full);
}

}  // namespace trammel::app
