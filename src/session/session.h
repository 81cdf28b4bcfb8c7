// Context of every procedure: the printer, a way to be stopped, and a receiver of progress.
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

/// Current step, for a watching user.
struct Progress {
  std::string text;                   ///< one line, without a full stop
  std::optional<double> remaining_s;  ///< about how long this step takes from now on
  /// Phase that begins here, for programs: "checking", "homing", "heating", "cooling", "uploading",
  /// "printing", "scanning", "analysing", "restoring". Empty: unchanged.
  std::string phase = {};
  std::optional<double> done = {};  ///< progress of the phase, 0 … 1
};

/// The printer must outlive the session. `stop` is the user's Ctrl-C.
struct Session {
  machine::Printer& printer;
  std::stop_token stop;
  std::function<void(const Progress&)> tell;  ///< may be empty
  /// True if the printer switches laser and heaters off by itself unless KeepAlive is called in
  /// time.
  bool has_limit = false;
  std::string owner = {};     ///< name of this run for the printer; empty: not sent
  std::string own_file = {};  ///< among the printer's files; a job of any other is somebody else's
  /// Records on disk which settings a G-code text sets, for recovery after a crash. Empty: not
  /// recorded.
  std::function<Result<void>(std::string_view gcode)> note = {};

  void Report(std::string text, std::optional<double> remaining_s = {}) const {
    Report({std::move(text), remaining_s});
  }
  void Report(const Progress& progress) const {
    if (tell) tell(progress);
  }
  [[nodiscard]] machine::WaitLimit Within(double time_limit_s) const {
    return {time_limit_s, stop};
  }
};

/// Macro that restarts the printer's own limit for laser and heaters, and the one that ends it
/// (klipper/trammel.cfg).
inline constexpr const char* kKeepAlive = "_TRAMMEL_KEEP_ALIVE";
inline constexpr const char* kRelease = "_TRAMMEL_RELEASE";
/// Macro by which a person does the same, after a dialog.
inline constexpr const char* kReleaseByHand = "TRAMMEL_RELEASE";

/// Restarts the printer's limit. Does nothing if it has none.
/// Errors: kMachine, also if the printer now belongs to another trammel.
[[nodiscard]] Result<void> KeepAlive(const Session& session);

/// Describes another client's job, printing or paused; empty if there is none.
[[nodiscard]] std::string OthersJob(const machine::PrinterState& state,
                                    const std::string& own_file);

/// Checks that the printer is ready and free of others' jobs; called right before each command that
/// moves or heats. Errors: kMachine, kInterrupted.
[[nodiscard]] Result<void> CheckStillFree(const Session& session);

/// Checks that the printer is ready, by its last report. Errors: kMachine.
[[nodiscard]] Result<void> CheckStillReady(const Session& session);

/// Checks that the printer is ready and homed, by its last report; to be called after each wait
/// that could miss an emergency stop or a restart. Errors: kMachine.
[[nodiscard]] Result<void> CheckStillHomed(const Session& session);

/// Records the settings that the script sets, then runs it. Errors: those of both.
[[nodiscard]] Result<void> RunNoted(const Session& session, std::string_view script,
                                    double time_limit_s);

/// Waits; false if the session was stopped meanwhile.
[[nodiscard]] bool Pause(double time_s, const std::stop_token& stop);

/// Names the user's stop as the cause of a failure: Ctrl-C and a closed terminal also reach a
/// tunnel or a camera's server of the same terminal. Called right after a failure; before any stop,
/// the error is returned unchanged.
[[nodiscard]] Error NameStopReason(const std::stop_token& stop, Error error);

/// Does the same for a result that may be a success.
template <class T>
[[nodiscard]] Result<T> NameStopReason(const std::stop_token& stop, Result<T> done) {
  if (done) return done;
  return tl::unexpected(NameStopReason(stop, std::move(done.error())));
}

/// Fails (kMachine) while the printer prints or is paused: a setting would act in that print, and
/// waiting for it would drain its queue of moves. Also fails while another run of trammel has the
/// printer, since its end restores the old values.
/// @param what  ends "apply … when it has ended", for example "the offset".
[[nodiscard]] Result<void> RefuseWhilePrinting(const Session& session, std::string_view what);

}  // namespace trammel::procedure
