// A printer's own buttons: calibrates when the printer asks for it, and answers on its screen.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "app/printer_session.h"
#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/procedure/screen.h"

namespace trammel::app {

/// Waits for the remote methods `trammel_pressure_advance` and `trammel_apply`, which
/// klipper/trammel.cfg's macros call. One calibration at a time; whoever asks meanwhile is told so.
/// Nothing is applied before `trammel_apply`, and then only the last good answer. Progress, answers
/// and failures go to the printer's screen and to standard error. Survives what happens to the
/// printer and to the connection, as far as machine::Printer does.
class Listener {
 public:
  /// @param options     read anew for each calibration, so that an edited file is taken up
  /// @param recordings  each calibration gets a folder of its own in here
  Listener(machine::Printer& printer, PrinterOptions options, std::filesystem::path recordings,
           std::stop_token stop);
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() = default;

  /// Registers the methods. Errors: kMachine, kInterrupted. Once only.
  [[nodiscard]] Result<void> Register();

  /// Serves until it is stopped; a calibration under way is then ended safely.
  /// @returns whether one was under way.
  [[nodiscard]] bool Serve();

 private:
  enum class Call { kCalibrate, kApply };

  // Shared with the printer's callbacks, which may outlive the listener.
  struct Inbox {
    std::mutex mutex;
    std::condition_variable_any called;
    std::deque<Call> calls;
    std::deque<std::string> words;  ///< of the calibration, for the screen
  };

  void Answer(Call call);
  void Calibrate();
  // Each gives a sentence for the screen: the answer, or why there is none.
  [[nodiscard]] std::string RunCalibration();
  [[nodiscard]] std::string Propose(const std::filesystem::path& folder);
  [[nodiscard]] std::string Apply();
  void Tell(std::string text);  // from the worker: written down now, shown by Serve
  void Show(std::string_view text);
  void ShowAll();  // what the worker told so far

  machine::Printer& printer_;
  PrinterOptions options_;
  std::filesystem::path recordings_;
  std::stop_token stop_;

  procedure::Screen screen_;  // only Serve's thread speaks
  std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
  std::mutex mutex_;
  bool working_ = false;                // guarded by mutex_
  std::optional<KeptAnswer> proposal_;  // guarded by mutex_: the last good answer
  std::jthread worker_;                 // last: it uses everything above
};

}  // namespace trammel::app
