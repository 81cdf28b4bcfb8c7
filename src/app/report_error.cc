#include <fmt/format.h>

#include <cstdio>

#include "app/commands.h"

namespace trammel::app {

int Report(const Error& error) {
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

}  // namespace trammel::app
