// The command line. Each command group registers itself in its own file, app/*_command.cc.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "app/align_commands.h"
#include "app/align_metrology_commands.h"
#include "app/align_targets_command.h"
#include "app/commands.h"
#include "app/console.h"
#include "app/mistyped.h"

namespace {

// Help, or what is wrong with the words of the command.
int Answer(const CLI::App& cli, const CLI::ParseError& error,
           const std::vector<std::string>& words) {
  std::ostringstream output;
  std::ostringstream errors;
  const int code = cli.exit(error, output, errors);
  const auto mistyped = code == 0 ? std::nullopt : trammel::app::Mistyped(cli, words);
  fmt::print("{}", output.str());
  fmt::print(stderr, "{}", mistyped ? *mistyped + "\n" : errors.str());
  return code == 0 ? trammel::app::kExitGood : trammel::app::kExitUsage;
}

}  // namespace

int main(int argc, char** argv) {
  trammel::app::GuardConsole();
  CLI::App cli{"trammel: machines that measure what they make and correct themselves"};
  cli.require_subcommand(1);
  cli.set_version_flag("--version", "trammel " TRAMMEL_VERSION, "says which trammel this is");
  int exit_code = trammel::app::kExitGood;
  CLI::App* pa = cli.add_subcommand("pa", "pressure advance")->require_subcommand(1);
  trammel::app::AddConfigCommand(cli, exit_code);
  trammel::app::AddAnalyzeCommand(*pa, exit_code);
  trammel::app::AddPatternCommand(*pa, exit_code);
  trammel::app::AddCalibrateCommands(*pa, exit_code);
  trammel::app::AddApplyCommand(*pa, exit_code);
  trammel::app::AddValidateCommand(*pa, exit_code);
  trammel::app::AddListenCommand(*pa, exit_code);
  CLI::App* tap =
      cli.add_subcommand("tap", "contact height from a load cell")->require_subcommand(1);
  trammel::app::AddTapAnalyzeCommand(*tap, exit_code);
  trammel::app::AddTapPlotCommand(*tap, exit_code);
  trammel::app::AddTapTuneCommand(*tap, exit_code);
  trammel::app::AddTapWatchCommand(*tap, exit_code);
  CLI::App* offset = cli.add_subcommand("offset", "XY offsets of tools, and backlash, from a scan")
                         ->require_subcommand(1);
  trammel::app::AddOffsetPatternCommand(*offset, exit_code);
  trammel::app::AddOffsetApplyCommand(*offset, exit_code);
  trammel::app::AddOffsetScanCommand(*offset, exit_code);
  trammel::app::AddOffsetAnalyzeCommand(*offset, exit_code);
  CLI::App* align = cli.add_subcommand("align", "where a part is, from a camera in the spindle")
                        ->require_subcommand(1);
  trammel::app::AddAlignBudgetCommand(*align, exit_code);
  trammel::app::AddAlignCalibrateCommand(*align, exit_code);
  trammel::app::AddAlignCameraCommand(*align, exit_code);
  trammel::app::AddAlignFitCommand(*align, exit_code);
  trammel::app::AddAlignStudyCommand(*align, exit_code);
  trammel::app::AddAlignTargetsCommand(*align, exit_code);
  trammel::app::AddAlignCorrectCommand(*align, exit_code);
  trammel::app::AddAlignMeasureCommand(*align, exit_code);
  trammel::app::AddAlignPlanCommand(*align, exit_code);
  trammel::app::AddAlignSolveCommand(*align, exit_code);
  trammel::app::AddDoctorCommand(cli, exit_code);
  trammel::app::AddSimCommand(cli, exit_code);

  int code = trammel::app::ExitCodeOf([&] {
    try {
      cli.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      exit_code = Answer(cli, error, {argv + 1, argv + argc});
    }
    return static_cast<trammel::app::ExitCode>(exit_code);
  });
  if (const auto said = trammel::app::FinishConsole(); !said) {
    const int lost = trammel::app::Report(said.error());
    if (code == trammel::app::kExitGood) code = lost;
  }
  return code;
}
