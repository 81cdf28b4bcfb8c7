// What must be right before a machine moves, each with what to do about it.
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
  std::string name;  ///< what was looked at
  bool passed = false;
  std::string detail;    ///< what was found; where not passed, also what to do
  bool advice = false;   ///< a calibration can do without it
  bool stopped = false;  ///< the user's stop came before anything was found
  bool unsafe = false;   ///< not passed: to go on could harm the printer, or give a wrong value
};

/// A check that could not be made.
[[nodiscard]] Check NotMade(std::string name, const Error& error);

[[nodiscard]] Check Pass(std::string name, std::string detail);
[[nodiscard]] Check Miss(std::string name, std::string detail);
[[nodiscard]] Check Unsafe(std::string name, std::string detail);

/// That the printer is ready, or gets ready while it starts, and that nobody works with it. Moves
/// nothing. Where it is not ready, nothing else is looked at.
[[nodiscard]] std::vector<Check> CheckReady(const Session& session);

/// That the first word of each line of a setting's G-code is a command that the printer knows.
[[nodiscard]] Check CheckCommands(const Session& session, const std::string& name,
                                  const std::string& gcode);

/// That the printer switches laser and heaters off by itself should trammel die; advice.
[[nodiscard]] Check CheckLimit(const Session& session);

/// Whether the folder's disk has room for a recording of the given length.
[[nodiscard]] Check CheckDisk(const std::filesystem::path& folder, double record_s,
                              double frames_per_s);
/// Whether it has room for so many bytes.
[[nodiscard]] Check CheckDisk(const std::filesystem::path& folder, double needed);

/// What a first scan would find out late: that the printer's clock and its motion can be followed.
/// Asks for some seconds.
[[nodiscard]] std::vector<Check> CheckTiming(const Session& session);

/// The first check that was not passed, but for advice, as an error of this kind; kSafety what is
/// unsafe, kInterrupted what the user's stop kept from being looked at.
[[nodiscard]] Result<void> FirstFailure(const std::vector<Check>& checks, ErrorKind kind);

}  // namespace trammel::procedure
