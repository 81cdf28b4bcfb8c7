// Checks before a machine moves, each with its remedy.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "session/session.h"

namespace trammel::procedure {

struct Check {
  std::string name;  ///< subject of the check
  bool passed = false;
  std::string detail;    ///< finding; if not passed, also the remedy
  bool advice = false;   ///< a calibration can do without it
  bool stopped = false;  ///< the user's stop came before anything was found
  bool unsafe = false;   ///< not passed: to go on could harm the printer, or give a wrong value
};

/// Returns a check that could not be made.
[[nodiscard]] Check NotMade(std::string name, const Error& error);

[[nodiscard]] Check Pass(std::string name, std::string detail);
[[nodiscard]] Check Miss(std::string name, std::string detail);
[[nodiscard]] Check Unsafe(std::string name, std::string detail);

/// Checks that the printer is ready, or becomes ready while it starts, and that nobody works with
/// it. Moves nothing. If it is not ready, no further check is made.
[[nodiscard]] std::vector<Check> CheckReady(const Session& session);

/// Checks that the first word of each line of a setting's G-code is a command of the printer.
[[nodiscard]] Check CheckCommands(const Session& session, const std::string& name,
                                  const std::string& gcode);

/// Checks that the printer switches laser and heaters off by itself if trammel crashes; advice.
[[nodiscard]] Check CheckLimit(const Session& session);

/// Checks that the folder's disk has room for a recording of the given length.
[[nodiscard]] Check CheckDisk(const std::filesystem::path& folder, double record_s,
                              double frames_per_s);
/// Checks that it has room for so many bytes.
[[nodiscard]] Check CheckDisk(const std::filesystem::path& folder, double needed);

/// Checks early that a scan can follow the printer's clock and its motion. Takes some seconds.
[[nodiscard]] std::vector<Check> CheckTiming(const Session& session);

/// Returns the first check that failed, except advice, as an error of this kind; kSafety for unsafe
/// ones, kInterrupted for those skipped by the user's stop.
[[nodiscard]] Result<void> FirstFailure(const std::vector<Check>& checks, ErrorKind kind);

}  // namespace trammel::procedure
