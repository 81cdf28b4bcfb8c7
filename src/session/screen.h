// Output to people and programs: the printer's screen and console, and progress for other
// processes.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "session/session.h"

namespace trammel::procedure {

/// Buttons of a dialog.
enum class Buttons {
  kStart,  ///< calibrate, or not
  kPrint,  ///< print the pattern for a photo, or not
  kPhoto,  ///< measure the photo, or later
  kSheet,  ///< print the sheet of tool offsets, or not
  kScan,   ///< measure its scan, or later
  kUse,    ///< apply the answer, or keep the old value
  kClose
};

/// Shows messages to the printer's user: in the console by the first of TRAMMEL_SAY
/// (klipper/trammel.cfg), RESPOND and M118 that the printer supports, and on the display by M117 if
/// it has one. Not thread-safe. The printer must outlive it.
class Screen {
 public:
  explicit Screen(machine::Printer& printer) : printer_(printer) {}

  /// Shows one line, and closes a dialog that Ask opened: what it asks is decided. Errors: those of
  /// the printer; none if it cannot show messages.
  [[nodiscard]] Result<void> Show(std::string_view text, const machine::WaitLimit& limit);

  /// Shows a dialog of one line with buttons, by TRAMMEL_ASK (klipper/trammel.cfg), for front ends
  /// and touch screens. Without such a macro there is no dialog, and no error.
  /// @param start  passed on by the first button (except of kUse), by TRAMMEL_ASK's parameters in
  ///     small letters ("filament", "token"); values of [A-Za-z0-9_.,-]+, others are omitted.
  [[nodiscard]] Result<void> Ask(std::string_view text, Buttons buttons,
                                 const std::map<std::string, std::string>& start,
                                 const machine::WaitLimit& limit);

  /// Returns the first line of the text as a quoted G-code argument: printable ASCII without
  /// characters that begin a comment or end the quotation. Of more than 1000 characters the middle
  /// is cut out: the cause is first, the remedy last.
  [[nodiscard]] static std::string Plain(std::string_view text);

 private:
  void LearnCommands(const machine::WaitLimit& limit);

  machine::Printer& printer_;
  bool learnt_ = false;
  std::string say_;  // "RESPOND MSG=\"{}\"" and so on, with the text's place; empty: no way
  bool has_display_ = false;
  bool has_dialogs_ = false;
  bool closes_dialogs_ = false;
  bool dialog_open_ = false;
};

// Progress from one process to another: a line of JSON on standard error.

/// {"progress":"scanning line 2 of 9","remaining_s":40,"phase":"scanning","done":0.111}: the text
/// always, the others where they are known. Without a line feed.
[[nodiscard]] std::string ProgressLine(const Progress& progress);

/// Parses such a line; absent if it is none. Texts are cut at 1024 bytes, the phase at 32.
[[nodiscard]] std::optional<Progress> ParseProgressLine(std::string_view line);

}  // namespace trammel::procedure
