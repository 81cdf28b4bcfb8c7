#include "app/program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <sstream>

#include "app/commands.h"
#include "app/console.h"
#include "app/help_commands.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/slow_work.h"

namespace trammel::app {
namespace {

// Prints help, or the fault in the words of the command.
int Answer(const CLI::App& cli, const CLI::ParseError& error,
           const std::vector<std::string>& words) {
  std::ostringstream output;
  std::ostringstream errors;
  const int code = cli.exit(error, output, errors);
  fmt::print("{}", output.str());
  if (code == 0) return kExitGood;
  fmt::print(stderr, "{}", UsageError(cli, error, words));
  return kExitUsage;
}

}  // namespace

int RunProgram(const Program& program, int argc, char** argv) {
  GuardConsole();
  KeepPicturesMemory();
  CLI::App cli{program.name + ": " + program.text};
  cli.name(program.name);
  cli.formatter(PlainHelp());
  cli.require_subcommand(1);
  cli.set_version_flag("--version", std::string(ProgramVersion()),
                       fmt::format("says which {} this is", program.name));
  // Accepted after every command, too.
  cli.fallthrough();
  cli.footer(fmt::format("--quiet and --color WHEN: {} --help", program.name));
  cli.add_flag_callback("-q,--quiet", PrintErrorsOnly,
                        "errors and the answer, no progress and no remarks");
  std::string colour = "auto";
  cli.add_option("--color", colour, "verdicts in colour: on terminals, always or never")
      ->check(CLI::IsMember(std::vector<std::string>{"auto", "always", "never"}))
      ->capture_default_str();
  cli.add_option_function<std::string>(
         "--progress",
         [](const std::string& form) {
           if (form == "json") ShowProgressAsJson();
         },
         "progress on standard error: text, or json, a line of it each, for programs")
      ->check(CLI::IsMember(std::vector<std::string>{"text", "json"}))
      ->default_str("text");
  int exit_code = kExitGood;
  cli.parse_complete_callback([&colour] {
    ColourVerdicts(colour == "always"  ? Colour::kAlways
                   : colour == "never" ? Colour::kNever
                                       : Colour::kAuto);
  });
  const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  program.add_commands(cli, exit_code, words);
  if (words.empty() && program.guide != nullptr) {
    fmt::print("{}", program.guide());
    return FinishConsole() ? kExitGood : kExitUsage;
  }

  int code = ExitCodeOf([&] {
    try {
      cli.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      exit_code = Answer(cli, error, words);
    }
    return static_cast<ExitCode>(exit_code);
  });
  if (const auto said = FinishConsole(); !said) {
    const int lost = PrintError(said.error());
    if (code == kExitGood) code = lost;
  }
  return code;
}

}  // namespace trammel::app
