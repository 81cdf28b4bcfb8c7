#include "app/left_out.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "app/commands.h"

namespace trammel::app {

void AddLeftOutCommand(CLI::App& cli, int& exit_code, const std::string& name) {
  CLI::App* const command =
      cli.add_subcommand(name)->group("")->fallthrough(false)->prefix_command();
  command->set_help_flag();
  const std::string full = cli.get_parent() == nullptr ? name : cli.get_name() + " " + name;
  command->callback([name = full, &exit_code] {
    exit_code = PrintError(
        {ErrorKind::kInput,
         fmt::format(
             "trammel {0} is not part of this build (./run builds pressure advance alone); build "
             "all of "
             "trammel with cmake --preset release && cmake --build --preset release, and use "
             "build/release/src/app/trammel {0} (docs/install.md)",
             name)});
  });
}

}  // namespace trammel::app
