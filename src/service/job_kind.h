// What a service can be asked to do: a command of an instrument as a process of its own.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "session/screen.h"

namespace trammel::service {

/// A printer that is served, as the command line names one.
struct PrinterPlace {
  std::string config = {};            ///< file; empty: trammel.toml of the current folder
  std::vector<std::string> set = {};  ///< key=value
  std::string address = {};           ///< Moonraker's; empty: the settings'
  std::string camera = {};            ///< empty: the settings'
  std::string material = {};          ///< empty: the settings'
};

/// Of a job, by their names; checked against its kind.
using Arguments = std::map<std::string, std::string>;

/// The nozzle's temperature of a run in degC, in place of the settings': the argument, and the
/// setting that it is.
inline constexpr const char* kTemperatureArgument = "temp";
inline constexpr const char* kTemperatureSetting = "filament.nozzle_temperature";

/// What is put before the owner before a job is started from a dialog.
struct Offer {
  std::string question;  ///< empty: it moves, heats and lights nothing, and is started unasked
  /// What follows from the arguments that were given, and stands in for those that were not; also
  /// what the button of the dialog after the job hands on: values of [A-Za-z0-9_.,-]+.
  Arguments start = {};
};

/// The answer of a job, in words.
struct AnswerInWords {
  Verdict verdict = Verdict::kRefused;
  /// "pressure_advance = 0.0172 s (95 %: 0.0154 to 0.0190 s)", or why there is none.
  std::string words;
  std::vector<std::string> lines =
      {};                        ///< before it in the console, of an answer of several values
  std::string why_not_set = {};  ///< of a good one that nothing can set; empty: it can be
  std::string notice = {};       ///< that belongs to it; empty: none
};

/// A kind of job. What moves a machine is done by its command, with all its safe ways out; the
/// service starts and stops it, and reads the result.json that it leaves.
struct JobKind {
  std::string name;                    ///< as requests name it
  std::string method;                  ///< that a macro calls for it
  std::vector<std::string> arguments;  ///< that it takes
  /// Looks whether it can be started. Errors: why not.
  /// @param printer  looked at, too, for a dialog; null: the settings alone
  std::function<Result<Offer>(const PrinterPlace&, const Arguments&, machine::Printer* printer)>
      check;
  std::vector<std::string> command;  ///< options of the printer, arguments and --out come behind
  bool looks = false;                ///< the command takes --camera
  /// The answer in the folder of a run; empty: it has none. Errors: there is none.
  std::function<Result<AnswerInWords>(const std::string& folder)> answer = {};
  /// The command that sets its answer; empty: there is none.
  std::function<std::vector<std::string>(const std::string& folder, const Arguments&)> apply = {};
  /// What a dialog asks, and using the answer does: "Use it until Klipper restarts".
  std::function<std::string(const PrinterPlace&, const Arguments&)> use = {};
  /// The value in force, "0.0450 s", to stand beside a proposal; may be empty, and say nothing.
  std::function<std::string(const machine::PrinterState&)> in_force = {};
  /// Of a job without an answer: what is said, and asked, when it is done.
  std::string done = {};
  procedure::Buttons start_buttons = procedure::Buttons::kStart;  ///< of the offer
  procedure::Buttons done_buttons = procedure::Buttons::kClose;   ///< of what it says when done
};

/// A command that is to run beside the server all the time, and is started again where it ends.
struct Attendant {
  std::string name;                  ///< of the file that it adds to, with its time behind: "taps"
  std::vector<std::string> command;  ///< options of the printer and --out FILE come behind
};

/// What the instruments of a build have to offer to a service.
struct Offerings {
  std::vector<JobKind> jobs = {};
  std::vector<Attendant> attendants = {};
};

/// The options by which a command is told of the printer, one word each.
[[nodiscard]] std::vector<std::string> OptionWords(const PrinterPlace& place);

}  // namespace trammel::service
