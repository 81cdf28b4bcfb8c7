// What a service can be asked to do: an instrument's commands, as words for a process of their own.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "machine/moonraker/printer_state.h"
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

/// What is put before the owner before a job is started from a dialog.
struct Offer {
  std::string question;
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

/// A kind of job. What moves a machine is done by the command that the words are of, with all its
/// safe ways out; the service starts and stops it, and reads what it says.
struct JobKind {
  std::string name;                    ///< as requests name it
  std::vector<std::string> arguments;  ///< that it takes
  /// Those of them that are a setting for the run: the setting's key.
  std::map<std::string, std::string> settings = {};
  /// Looks whether it can be started, without asking the printer. Errors: why not.
  std::function<Result<Offer>(const PrinterPlace&, const Arguments&)> check;
  /// The same with a look at the printer, for a dialog; empty: `check` says all.
  std::function<Result<Offer>(machine::Printer&, const PrinterPlace&, const Arguments&)> offer = {};
  /// The command that does it; options of the printer and --out FOLDER are put behind.
  std::vector<std::string> words;
  bool looks = true;  ///< it takes --camera
  /// The command that sets its answer, with the folder of the run; empty: there is none.
  std::function<std::vector<std::string>(const std::string& folder, const Arguments&)> apply = {};
  /// What is to be said where something fails after the answer was set.
  std::string set_in_part = "applied, and not kept as asked for";
  /// What a dialog asks, and using the answer does: "Use it until Klipper restarts".
  std::function<std::string(const Arguments&)> use = {};
  /// What using it writes besides by the settings of a printer, "in Spoolman"; may be empty.
  std::function<std::string(const PrinterPlace&)> use_also = {};
  /// How a notice in result.json begins that belongs to the answer; empty: none does.
  std::string notice = {};
  /// The value in force, "0.0450 s", to stand beside a proposal; may be empty, and say nothing.
  std::function<std::string(const machine::PrinterState&)> in_force = {};
  std::string quantity;  ///< of its answer, as result.json names it; empty: it has none such
  /// The answer in the folder of a run, where it is not one quantity. Errors: there is none.
  std::function<Result<AnswerInWords>(const std::string& folder)> answer = {};
  /// Of a job without an answer: what is said, and asked, when it is done.
  std::string done = {};
  procedure::Buttons start_buttons = procedure::Buttons::kStart;  ///< of the offer
  procedure::Buttons done_buttons = procedure::Buttons::kClose;   ///< of what it says when done
  std::vector<std::string> copies = {};  ///< stems of the uploads that it copies into its folder
  std::string picture = {};              ///< of its answer, a PNG in its folder; empty: none
  std::string offer_method;              ///< that a macro calls to be asked; empty: none
  /// That a macro calls to start it unasked; empty: none. REQUIRES that it neither moves, heats nor
  /// lights anything.
  std::string start_method;

  [[nodiscard]] bool has_answer() const { return answer || !quantity.empty(); }
};

/// A command that is to run beside the desk all the time, and is started again where it ends.
struct Attendant {
  std::string name;  ///< of the file that it adds to, with its time behind: "taps"
  /// The command; options of the printer and --out FILE are put behind.
  std::vector<std::string> words;
};

/// What the instruments of a build have to offer to a service.
struct Offerings {
  std::vector<JobKind> jobs = {};
  std::vector<Attendant> attendants = {};
};

/// The options by which a command is told of the printer, one word each.
[[nodiscard]] std::vector<std::string> OptionWords(const PrinterPlace& place);

}  // namespace trammel::service
