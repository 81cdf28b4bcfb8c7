// One function per command group; each lives in app/<group>_command.cc.
#pragma once

#include <functional>

#include "base/result.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// Exit codes of every command (CONVENTIONS.md).
enum ExitCode {
  kExitGood = 0,
  kExitUsage = 1,
  kExitNotTrusted = 2,
  kExitMachine = 3,
  kExitUnsafe = 4,
  kExitBug = 70,
  kExitInterrupted = 130,
};

/// Prints the message to standard error and gives the exit code of its kind.
int Report(const Error& error);

/// Runs a command. What it throws, or was noted on a thread meanwhile (base/bug_note.h), is a bug:
/// printed, with an exit code of its own; the machine was restored on the way.
int ExitCodeOf(const std::function<int()>& command);

/// Each Add…Command hangs its subcommands below `parent`; a callback stores its exit code in
/// `exit_code`.
void AddConfigCommand(CLI::App& parent, int& exit_code);
void AddAnalyzeCommand(CLI::App& parent, int& exit_code);
void AddPatternCommand(CLI::App& parent, int& exit_code);
void AddSimCommand(CLI::App& parent, int& exit_code);
/// `calibrate`, `print` and `scan`.
void AddCalibrateCommands(CLI::App& parent, int& exit_code);
void AddApplyCommand(CLI::App& parent, int& exit_code);
void AddValidateCommand(CLI::App& parent, int& exit_code);
void AddListenCommand(CLI::App& parent, int& exit_code);
/// Below `trammel tap`.
void AddTapAnalyzeCommand(CLI::App& parent, int& exit_code);
void AddTapPlotCommand(CLI::App& parent, int& exit_code);
void AddTapTuneCommand(CLI::App& parent, int& exit_code);
void AddTapWatchCommand(CLI::App& parent, int& exit_code);
/// Below `trammel offset`.
void AddOffsetPatternCommand(CLI::App& parent, int& exit_code);
void AddOffsetScanCommand(CLI::App& parent, int& exit_code);
void AddOffsetAnalyzeCommand(CLI::App& parent, int& exit_code);
void AddOffsetApplyCommand(CLI::App& parent, int& exit_code);
void AddDoctorCommand(CLI::App& parent, int& exit_code);
/// `trammel sim printer`, `sim camera`, `sim sheet` and `sim spindle`, below `trammel sim`.
void AddSimPrinter(CLI::App& parent, int& exit_code);
void AddSimCamera(CLI::App& parent, int& exit_code);
void AddSimSheet(CLI::App& parent, int& exit_code);
void AddSimSpindle(CLI::App& parent, int& exit_code);

}  // namespace trammel::app
