// The command line: a table of the groups of commands.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "app/commands.h"
#include "app/config_command.h"
#include "app/console.h"
#include "app/help_commands.h"
#include "app/history_command.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/serve_command.h"
#include "app/shop/sim_commands.h"
#include "app/slow_work.h"
#ifdef TRAMMEL_PART_ALIGNMENT
#include "part_alignment/commands/align_commands.h"
#endif
#ifdef TRAMMEL_PRESSURE_ADVANCE
#include "pressure_advance/commands/pressure_advance_commands.h"
#endif
#ifdef TRAMMEL_TAP
#include "tap/commands/tap_commands.h"
#endif
#ifdef TRAMMEL_TOOL_OFFSET
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/commands/offset_job.h"
#endif

namespace {

// Help, or what is wrong with the words of the command.
int Answer(const CLI::App& cli, const CLI::ParseError& error,
           const std::vector<std::string>& words) {
  std::ostringstream output;
  std::ostringstream errors;
  const int code = cli.exit(error, output, errors);
  fmt::print("{}", output.str());
  if (code == 0) return trammel::app::kExitGood;
  fmt::print(stderr, "{}", trammel::app::UsageError(cli, error, words));
  return trammel::app::kExitUsage;
}

// What the instruments of this build have to offer to trammel serve.
trammel::service::Offerings Offers() {
  trammel::service::Offerings offered;
#ifdef TRAMMEL_PRESSURE_ADVANCE
  offered.jobs.push_back(trammel::app::PressureAdvanceJob());
  offered.jobs.push_back(trammel::app::PhotoPatternJob());
  offered.jobs.push_back(trammel::app::PhotoJob());
#endif
#ifdef TRAMMEL_TOOL_OFFSET
  offered.jobs.push_back(trammel::app::OffsetSheetJob());
  offered.jobs.push_back(trammel::app::OffsetScanJob());
#endif
#ifdef TRAMMEL_TAP
  offered.attendants.push_back({"taps", {"tap", "watch", "--answer"}});
#endif
  return offered;
}

// A command of the first level: most are groups.
struct Command {
  const char* name;
  const char* text;
  void (*fill)(CLI::App& command, int& exit_code);  // none: left out (TRAMMEL_INSTRUMENTS)
};

// In the order of the help.
constexpr Command kCommands[] = {
    {"pa", "pressure advance",
#ifdef TRAMMEL_PRESSURE_ADVANCE
     trammel::app::AddPressureAdvanceCommands
#else
     nullptr
#endif
    },
    {"tap", "contact height from a load cell",
#ifdef TRAMMEL_TAP
     trammel::app::AddTapCommands
#else
     nullptr
#endif
    },
    {"offset", "XY offsets of tools, and backlash, from a scan",
#ifdef TRAMMEL_TOOL_OFFSET
     trammel::app::AddOffsetCommands
#else
     nullptr
#endif
    },
    {"align", "where a part is, from a camera in the spindle",
#ifdef TRAMMEL_PART_ALIGNMENT
     trammel::app::AddAlignCommands
#else
     nullptr
#endif
    },
    {"serve",
     "wait beside Klipper for front ends and macros, and run what they ask for (docs/serve.md)",
     [](CLI::App& serve, int& exit_code) {
       trammel::app::AddServeOptions(serve, exit_code, Offers);
     }},
    {"history", "what recordings gave, and what was applied of it",
     trammel::app::AddHistoryCommands},
    {"config", "trammel.toml", trammel::app::AddConfigCommands},
    {"doctor", "check the whole set-up and say what to fix",
#ifdef TRAMMEL_PRESSURE_ADVANCE
     trammel::app::AddDoctorCommand
#else
     nullptr
#endif
    },
    {"sim", "virtual machines and what eyes see of their work", trammel::app::AddSimCommands},
};

// Hangs all commands below the program and fills those that the words name: all options of all of
// them take as long as the rest of the start. What describes the whole program names none of them.
void AddCommands(CLI::App& cli, int& exit_code, const std::vector<std::string>& words) {
  const auto named = [&words](std::string_view word) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  const bool whole = named("completion") || named("manual");
  for (const Command& command : kCommands) {
    if (command.fill == nullptr) {
      trammel::app::AddLeftOutCommand(cli, exit_code, command.name);
      continue;
    }
    CLI::App* added = cli.add_subcommand(command.name, command.text);
    if (whole || named(command.name)) command.fill(*added, exit_code);
  }
  trammel::app::AddHelpCommands(cli);
}

}  // namespace

int main(int argc, char** argv) {
  trammel::app::GuardConsole();
  trammel::app::KeepPicturesMemory();
  CLI::App cli{"trammel: machines that measure what they make and correct themselves"};
  cli.name("trammel");
  cli.formatter(trammel::app::PlainHelp());
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
  const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  AddCommands(cli, exit_code, words);
  if (words.empty()) {
    fmt::print("{}", trammel::app::Guide([](std::string_view name) {
                 return std::ranges::any_of(kCommands, [name](const Command& command) {
                   return command.name == name && command.fill != nullptr;
                 });
               }));
    return trammel::app::FinishConsole() ? trammel::app::kExitGood : trammel::app::kExitUsage;
  }

  int code = trammel::app::ExitCodeOf([&] {
    try {
      cli.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      exit_code = Answer(cli, error, words);
    }
    return static_cast<trammel::app::ExitCode>(exit_code);
  });
  if (const auto said = trammel::app::FinishConsole(); !said) {
    const int lost = trammel::app::PrintError(said.error());
    if (code == trammel::app::kExitGood) code = lost;
  }
  return code;
}
