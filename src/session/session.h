// What every procedure is given: the printer, a way to be stopped, and a receiver of progress.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"
#include "machine/moonraker/printer.h"

namespace trammel::procedure {

/// What is happening now, for a person who watches.
struct Progress {
  std::string text;                   ///< one line, without a full stop
  std::optional<double> remaining_s;  ///< about how long this step takes from now on
  /// The phase that begins with it, for programs: "checking", "homing", "heating", "cooling",
  /// "uploading", "printing", "scanning", "analysing", "restoring". Empty: the same as before.
  std::string phase = {};
  std::optional<double> done = {};  ///< of the phase, 0 … 1
};

/// The printer must outlive the session. `stop` is the user's Ctrl-C.
struct Session {
  machine::Printer& printer;
  std::stop_token stop;
  std::function<void(const Progress&)> tell;  ///< may be empty
  /// The printer switches laser and heaters off by itself unless KeepAlive is called in time.
  bool has_limit = false;
  std::string owner = {};     ///< by which the printer knows this run; empty: it is not told
  std::string own_file = {};  ///< among the printer's files; a job of any other is somebody else's
  /// Notes on disk what a G-code text sets, for the run after one that dies. Empty: nobody notes
  /// it.
  std::function<Result<void>(std::string_view gcode)> note = {};

  void Say(std::string text, std::optional<double> remaining_s = {}) const {
    Tell({std::move(text), remaining_s});
  }
  void Tell(const Progress& progress) const {
    if (tell) tell(progress);
  }
  [[nodiscard]] machine::WaitLimit Within(double time_limit_s) const {
    return {time_limit_s, stop};
  }
};

/// The macro by which the printer's own limit for laser and heaters begins anew, and the one that
/// ends it (klipper/trammel.cfg).
inline constexpr const char* kKeepAlive = "_TRAMMEL_KEEP_ALIVE";
inline constexpr const char* kRelease = "_TRAMMEL_RELEASE";
/// The macro by which a person does the same, after a dialog.
inline constexpr const char* kReleaseByHand = "TRAMMEL_RELEASE";

/// Tells the printer that somebody still looks after it. Nothing where it has no limit.
/// Errors: kMachine, also where the printer belongs to another trammel by now.
[[nodiscard]] Result<void> KeepAlive(const Session& session);

/// Somebody else's job, printing or paused, in words; empty where there is none.
[[nodiscard]] std::string OthersJob(const machine::PrinterState& state,
                                    const std::string& own_file);

/// Asks the printer whether it is ready and free of others' jobs; to be called right before each
/// command that moves or heats. Errors: kMachine, kInterrupted.
[[nodiscard]] Result<void> CheckStillFree(const Session& session);

/// Whether the printer is ready, by what it last told. Errors: kMachine.
[[nodiscard]] Result<void> CheckStillReady(const Session& session);

/// Whether the printer is ready and homed, by what it last told; to be called after each wait in
/// which nothing else would notice an emergency stop or a restart. Errors: kMachine.
[[nodiscard]] Result<void> CheckStillHomed(const Session& session);

/// Notes what the script sets, then runs it. Errors: those of both.
[[nodiscard]] Result<void> RunNoted(const Session& session, std::string_view script,
                                    double time_limit_s);

/// Waits; false where the session was stopped meanwhile.
[[nodiscard]] bool Pause(double time_s, const std::stop_token& stop);

/// Names the stop that the user asked for as what ended the work, and the failure as what came with
/// it: Ctrl-C and a closed terminal reach a tunnel or a camera's server of the same terminal, too.
/// To be called where something has just failed; before any stop, the error is returned as it is.
[[nodiscard]] Error NameStop(const std::stop_token& stop, Error error);

/// The same for what may have succeeded.
template <class T>
[[nodiscard]] Result<T> NameStop(const std::stop_token& stop, Result<T> done) {
  if (done) return done;
  return tl::unexpected(NameStop(stop, std::move(done.error())));
}

/// Refuses (kMachine) while the printer prints or is paused: what is set then acts in somebody's
/// print, and waiting for it would drain its queue of moves. Refuses while another run of trammel
/// has the printer, too: its end brings back what was set before.
/// @param what  ends "apply … when it has ended", for example "the offset".
[[nodiscard]] Result<void> RefuseWhilePrinting(const Session& session, std::string_view what);

}  // namespace trammel::procedure
