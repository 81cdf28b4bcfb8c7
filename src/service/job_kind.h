// Kinds of jobs of a service: a command of an instrument as a process of its own.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "measurement/outcome.h"
#include "session/screen.h"

namespace trammel::service {

/// Served printer, as given on the command line.
struct PrinterPlace {
  std::string config = {};            ///< file; empty: trammel.toml of the current folder
  std::vector<std::string> set = {};  ///< key=value
  std::string address = {};           ///< Moonraker's; empty: the settings'
  std::string camera = {};            ///< empty: the settings'
  std::string material = {};          ///< empty: the settings'
};

/// Arguments of a job, by their names; checked against its kind.
using Arguments = std::map<std::string, std::string>;

/// Nozzle temperature of a run in degC, in place of the settings': the argument, and its setting.
inline constexpr const char* kTemperatureArgument = "temp";
inline constexpr const char* kTemperatureSetting = "filament.nozzle_temperature";

/// Question to the owner before a job starts from a dialog.
struct Offer {
  std::string question;  ///< empty: it moves, heats and lights nothing, and is started unasked
  /// Defaults of the missing arguments, derived from the given ones; also the values that the
  /// button of the dialog after the job passes on: [A-Za-z0-9_.,-]+.
  Arguments start = {};
};

/// Answer of a job, as text.
struct AnswerSummary {
  Verdict verdict = Verdict::kRefused;
  /// "pressure_advance = 0.0172 s (95 %: 0.0154 to 0.0190 s)", or why there is none.
  std::string words;
  std::vector<std::string> lines =
      {};                        ///< before it in the console, of an answer of several values
  std::string why_not_set = {};  ///< why a good value cannot be set; empty: it can
  std::string notice = {};       ///< accompanying notice; empty: none
};

/// Kind of job. Its command moves the machine, with all safe exits; the service starts and stops
/// it, and reads its result.json.
struct JobKind {
  std::string name;                    ///< as in requests
  std::string method;                  ///< called by a macro
  std::vector<std::string> arguments;  ///< that it takes
  /// Checks that it can be started. Errors: the reason.
  /// @param printer  checked, too, for a dialog; null: only the settings
  std::function<Result<Offer>(const PrinterPlace&, const Arguments&, machine::Printer* printer)>
      check;
  std::vector<std::string> command;  ///< options of the printer, arguments and --out come behind
  bool looks = false;                ///< the command takes --camera
  /// Returns the answer in the folder of a run; null: the kind has none. Errors: there is none.
  std::function<Result<AnswerSummary>(const std::string& folder)> answer = {};
  /// Returns the command that sets the answer; empty: there is none.
  std::function<std::vector<std::string>(const std::string& folder, const Arguments&)> apply = {};
  /// Instrument of the answer, by which results in the history find their kind.
  std::optional<measurement::Instrument> instrument = {};
  std::vector<std::string> undo = {};  ///< command that sets the last value back; empty: none
  /// Describes the use of the answer, for a dialog's question: "Use it until Klipper restarts".
  std::function<std::string(const PrinterPlace&, const Arguments&)> use = {};
  /// Returns the value in force, "0.0450 s", displayed beside a proposal; may be null or return an
  /// empty text.
  std::function<std::string(const machine::PrinterState&)> in_force = {};
  /// Final message or question of a job without an answer.
  std::string done = {};
  procedure::Buttons start_buttons = procedure::Buttons::kStart;  ///< for the offer
  procedure::Buttons done_buttons = procedure::Buttons::kClose;   ///< for the final message
};

/// Command that runs permanently beside the server, and is restarted when it ends.
struct Attendant {
  std::string name;                  ///< stem of the file to append to, a time follows: "taps"
  std::vector<std::string> command;  ///< options of the printer and --out FILE come behind
};

/// Offerings of a build's instruments to a service.
struct Offerings {
  std::vector<JobKind> jobs = {};
  std::vector<Attendant> attendants = {};
  bool surveys = false;  ///< `align survey`
};

/// Returns the options that pass the printer to a command, one word each.
[[nodiscard]] std::vector<std::string> OptionText(const PrinterPlace& place);

}  // namespace trammel::service
