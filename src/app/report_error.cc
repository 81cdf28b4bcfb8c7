#include <fmt/format.h>

#include <cstdio>

#include "app/commands.h"
#include "base/bug_note.h"

namespace trammel::app {

int PrintError(const Error& error) {
  fmt::print(stderr, "trammel: {}\n", error.message);
  switch (error.kind) {
    case ErrorKind::kInput:
      return kExitUsage;
    case ErrorKind::kMeasurement:
      return kExitNotTrusted;
    case ErrorKind::kMachine:
      return kExitMachine;
    case ErrorKind::kSafety:
      return kExitUnsafe;
    case ErrorKind::kInterrupted:
      return kExitInterrupted;
  }
  return kExitUsage;
}

int CodeOf(const Result<int>& code) { return code ? *code : PrintError(code.error()); }
int CodeOf(const Result<void>& done) { return done ? kExitGood : PrintError(done.error()); }

int ExitCodeOf(const std::function<int()>& command) {
  int code = kExitGood;
  (void)NoteBug([&] { code = command(); });
  const std::optional<std::string> bug = NotedBug();
  if (!bug) return code;
  // Not fmt::print, which throws if standard error is closed.
  const std::string text =
      fmt::format("trammel: this is a bug in trammel, please report it: {}\n", *bug);
  std::fputs(text.c_str(), stderr);
  return kExitBug;
}

}  // namespace trammel::app
