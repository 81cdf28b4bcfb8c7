// The command line: a table of the groups of commands.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/config_command.h"
#include "app/console.h"
#include "app/help_commands.h"
#include "app/history_command.h"
#include "app/left_out.h"
#include "app/mistyped.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/serve_command.h"
#include "app/shop/sim_commands.h"
#ifdef TRAMMEL_PART_ALIGNMENT
#include "part_alignment/commands/align_commands.h"
#endif
#ifdef TRAMMEL_STUDY
#include "app/study/study_command.h"
#endif
#ifdef TRAMMEL_PRESSURE_ADVANCE
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/commands/pressure_advance_job.h"
#endif
#ifdef TRAMMEL_TAP
#include "tap/commands/tap_commands.h"
#endif
#ifdef TRAMMEL_TOOL_OFFSET
#include "tool_offset/commands/offset_commands.h"
#endif

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

// What the instruments of this build have to offer to trammel serve.
trammel::service::Offerings Offers() {
  trammel::service::Offerings offered;
#ifdef TRAMMEL_PRESSURE_ADVANCE
  offered.jobs.push_back(trammel::app::PressureAdvanceJob());
#endif
#ifdef TRAMMEL_TAP
  offered.attendants.push_back({"taps", {"tap", "watch", "--answer"}});
#endif
  return offered;
}

// Hangs a command, or a group of them, below the program.
using AddCommands = void (*)(CLI::App& cli, int& exit_code);

// In the order of the help; an instrument may be left out of a build (TRAMMEL_INSTRUMENTS).
constexpr AddCommands kCommands[] = {
#ifdef TRAMMEL_PRESSURE_ADVANCE
    trammel::app::AddPressureAdvanceCommands,
#ifdef TRAMMEL_STUDY
    trammel::app::AddPressureAdvanceStudy,
#else
    [](CLI::App& cli, int& exit_code) {
      trammel::app::AddLeftOutCommand(*cli.get_subcommand("pa"), exit_code, "study");
    },
#endif
#else
    [](CLI::App& cli, int& exit_code) { trammel::app::AddLeftOutCommand(cli, exit_code, "pa"); },
#endif
#ifdef TRAMMEL_TAP
    trammel::app::AddTapCommands,
#else
    [](CLI::App& cli, int& exit_code) { trammel::app::AddLeftOutCommand(cli, exit_code, "tap"); },
#endif
#ifdef TRAMMEL_TOOL_OFFSET
    trammel::app::AddOffsetCommands,
#else
    [](CLI::App& cli, int& exit_code) {
      trammel::app::AddLeftOutCommand(cli, exit_code, "offset");
    },
#endif
#ifdef TRAMMEL_PART_ALIGNMENT
    trammel::app::AddAlignCommands,
#else
    [](CLI::App& cli, int& exit_code) { trammel::app::AddLeftOutCommand(cli, exit_code, "align"); },
#endif
    [](CLI::App& cli, int& exit_code) { trammel::app::AddServeCommand(cli, exit_code, Offers); },
    trammel::app::AddHistoryCommand,
    trammel::app::AddConfigCommand,
#ifdef TRAMMEL_PRESSURE_ADVANCE
    trammel::app::AddDoctorCommand,
#endif
    trammel::app::AddSimCommand,
    trammel::app::AddHelpCommands,
};

}  // namespace

int main(int argc, char** argv) {
  trammel::app::GuardConsole();
  CLI::App cli{"trammel: machines that measure what they make and correct themselves"};
  cli.name("trammel");
  cli.require_subcommand(1);
  cli.set_version_flag("--version", std::string(trammel::app::ProgramVersion()),
                       "says which trammel this is");
  // Taken below every command, too.
  cli.fallthrough();
  cli.footer("--quiet and --color WHEN: trammel --help");
  cli.add_flag_callback("-q,--quiet", trammel::app::SayErrorsOnly,
                        "errors and the answer, no progress and no remarks");
  std::string colour = "auto";
  cli.add_option("--color", colour, "verdicts in colour: on terminals, always or never")
      ->check(CLI::IsMember(std::vector<std::string>{"auto", "always", "never"}))
      ->capture_default_str();
  cli.add_option_function<std::string>(
         "--progress",
         [](const std::string& form) {
           if (form == "json") trammel::app::TellProgressAsJson();
         },
         "progress on standard error: text, or json, a line of it each, for programs")
      ->check(CLI::IsMember(std::vector<std::string>{"text", "json"}))
      ->default_str("text");
  int exit_code = trammel::app::kExitGood;
  cli.parse_complete_callback([&colour] {
    using trammel::app::Colour;
    trammel::app::ColourVerdicts(colour == "always"  ? Colour::kAlways
                                 : colour == "never" ? Colour::kNever
                                                     : Colour::kAuto);
  });
  for (const auto& add : kCommands) add(cli, exit_code);

  int code = trammel::app::ExitCodeOf([&] {
    try {
      cli.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      exit_code = Answer(cli, error, {argv + 1, argv + argc});
    }
    return static_cast<trammel::app::ExitCode>(exit_code);
  });
  if (const auto said = trammel::app::FinishConsole(); !said) {
    const int lost = trammel::app::PrintError(said.error());
    if (code == trammel::app::kExitGood) code = lost;
  }
  return code;
}
