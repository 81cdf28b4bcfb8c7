// How every command ends: its exit code, and the message of its error.
#pragma once

#include <functional>

#include "base/result.h"

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
int PrintError(const Error& error);

/// The exit code of what a command came to; prints its error.
int CodeOf(const Result<int>& code);
int CodeOf(const Result<void>& done);

/// Runs a command. What it throws, or was noted on a thread meanwhile (base/bug_note.h), is a bug:
/// printed, with an exit code of its own; the machine was restored on the way.
int ExitCodeOf(const std::function<int()>& command);

}  // namespace trammel::app
