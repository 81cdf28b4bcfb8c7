// Outcome of a G-code script, from the printer's messages while it ran.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::machine {

/// Returns the commands (first words, upper case, without comments) of a script, in order.
[[nodiscard]] std::vector<std::string> CommandsOf(std::string_view script);

/// Returns the script's line that a complaint concerns, as "line 3, 'G1 X999'", or a description of
/// the script if that is unclear: "one of its 12 lines, from 'G90' to 'M400'".
[[nodiscard]] std::string BlamedLine(std::string_view script, std::string_view complaint);

/// Follows one running script of the printer. The firmware answers "ok" to unknown commands and
/// only mentions them. It runs one script at a time, so that a complaint meanwhile is attributed to
/// ours unless it is certainly another's.
class ScriptWatch {
 public:
  /// @param macros  names of the printer's macros, upper case; absent: not known
  ScriptWatch(std::string script, std::optional<std::set<std::string>> macros);

  /// Takes a line of notify_gcode_response.
  void OnResponse(std::string_view response);

  /// True if a `!!` arrived: an error answer follows at once, unless a macro only reported an
  /// error.
  [[nodiscard]] bool complained() const { return !complaint_.empty(); }
  /// Returns the printer's message, the line and the remedy; empty if there was no fault.
  [[nodiscard]] std::string Verdict() const;
  [[nodiscard]] const std::string& script() const { return script_; }

 private:
  void OnUnknownCommand(std::string_view name);

  const std::string script_;
  const std::vector<std::string> commands_;
  bool calls_macros_ = true;
  std::string complaint_;  ///< the first `!!`
  std::string unknown_;    ///< the first unknown command's verdict
};

}  // namespace trammel::machine
