// Command line: a table of the groups of commands.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "app/config_command.h"
#include "app/help_commands.h"
#include "app/history_command.h"
#include "app/program.h"
#include "app/serve_command.h"
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

// Collects what the instruments of this build offer to trammel serve.
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
#ifdef TRAMMEL_PART_ALIGNMENT
  offered.surveys = true;
#endif
  return offered;
}

// Command of the first level; most are groups.
struct Command {
  const char* name;
  const char* text;
  void (*fill)(CLI::App& command, int& exit_code);  // none: left out (TRAMMEL_INSTRUMENTS)
};

// Ordered as in the help.
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
     "wait beside Klipper for front ends and macros, and run what they ask for "
     "(docs/howto/serve.md)",
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
};

// Adds all commands and fills only those that the words name, since all options of all commands
// would double the start-up time. Descriptions of the whole program name none of them.
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

std::string GuideOfThisBuild() {
  return trammel::app::Guide([](std::string_view name) {
    return std::ranges::any_of(kCommands, [name](const Command& command) {
      return command.name == name && command.fill != nullptr;
    });
  });
}

}  // namespace

int main(int argc, char** argv) {
  return trammel::app::RunProgram(
      {"trammel", "machines that measure what they make and correct themselves", AddCommands,
       GuideOfThisBuild},
      argc, argv);
}
