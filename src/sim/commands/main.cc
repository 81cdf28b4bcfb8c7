// trammel-sim: virtual machines, to try and to test trammel without hardware.
#include <CLI/CLI.hpp>

#include "app/help_commands.h"
#include "app/program.h"
#include "sim/commands/commands.h"

namespace {

void AddCommands(CLI::App& program, int& exit_code, const std::vector<std::string>& /*words*/) {
  using namespace trammel::app;
  AddSimScan(program, exit_code);
  AddSimPhoto(program, exit_code);
  AddSimPattern(program, exit_code);
  AddSimPrinter(program, exit_code);
#ifdef TRAMMEL_TOOL_OFFSET
  AddSimSheet(program, exit_code);
#endif
#ifdef TRAMMEL_PART_ALIGNMENT
  AddSimMill(program, exit_code);
  AddSimSpindle(program, exit_code);
#endif
  AddHelpCommands(program);
}

}  // namespace

int main(int argc, char** argv) {
  return trammel::app::RunProgram(
      {"trammel-sim", "virtual machines, and what cameras and scanners see of their work",
       AddCommands},
      argc, argv);
}
