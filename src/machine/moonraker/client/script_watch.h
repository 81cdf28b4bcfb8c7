// Whether a G-code script went well, from what the printer said while it ran.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::machine {

/// The commands (first words, upper case, without comments) of a script, in order.
[[nodiscard]] std::vector<std::string> CommandsOf(std::string_view script);

/// The script's line that a complaint is about, as "line 3, 'G1 X999'", or what the script is where
/// the complaint does not tell: "one of its 12 lines, from 'G90' to 'M400'".
[[nodiscard]] std::string BlamedLine(std::string_view script, std::string_view complaint);

/// Follows one script that the printer is running. The firmware answers "ok" to unknown commands
/// and only mentions them; it runs one script at a time, so that a complaint that comes while ours
/// runs is taken for ours unless it is certainly somebody else's.
class ScriptWatch {
 public:
  /// @param macros  names of the printer's macros, upper case; absent: not known
  ScriptWatch(std::string script, std::optional<std::set<std::string>> macros);

  /// A line of notify_gcode_response.
  void OnResponse(std::string_view response);

  /// A `!!` came: an error answer follows at once, unless a macro only reported an error.
  [[nodiscard]] bool complained() const { return !complaint_.empty(); }
  /// Empty where nothing is wrong; otherwise what the printer said, on which line, and what to do.
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
