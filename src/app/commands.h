// End of every command: exit code and error message.
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

/// Prints the message to standard error and returns the exit code of its kind.
int PrintError(const Error& error);

/// Returns the exit code of a command's result; prints its error.
int CodeOf(const Result<int>& code);
int CodeOf(const Result<void>& done);

/// Runs a command. An exception, or a bug noted on a thread meanwhile (base/bug_note.h), is printed
/// and gets its own exit code; unwinding has restored the machine.
int ExitCodeOf(const std::function<int()>& command);

}  // namespace trammel::app
