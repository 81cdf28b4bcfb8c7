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
#include "pressure_advance/procedure/recording_cutter.h"
#include "pressure_advance/procedure/screen.h"

namespace trammel::app {

/// Waits for the remote methods that klipper/trammel.cfg's macros call: `trammel_offer` asks on the
/// screen whether to calibrate, `trammel_pressure_advance` calibrates, `trammel_apply` sets the
/// last good answer and `trammel_dismiss` drops it. The first two take `filament`, a name: what is
/// applied is then kept for it, too. One calibration at a time; whoever asks meanwhile is told so.
/// Nothing is applied before `trammel_apply`. Progress, answers and failures go to the printer's
/// screen and to standard error, answers with buttons. Survives what happens to the printer and to
/// the connection, as far as machine::Printer does.
class Listener {
 public:
  /// @param options     read anew for each calibration, so that an edited file is taken up
  /// @param recordings  each calibration gets a folder of its own in here
  /// @param keep_full   frames stay whole
  Listener(machine::Printer& printer, PrinterOptions options, std::filesystem::path recordings,
           bool keep_full, std::stop_token stop);
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() = default;

  /// Registers the methods. Errors: kMachine, kInterrupted. Once only.
  [[nodiscard]] Result<void> Register();

  /// Serves until it is stopped; a calibration under way is then ended safely.
  /// @returns whether one was under way.
  [[nodiscard]] bool Serve();

 private:
  enum class Method { kOffer, kCalibrate, kApply, kDismiss };

  struct Call {
    Method method = Method::kCalibrate;
    std::string filament;  ///< a name, or empty
  };

  // What is said on the screen, with buttons or without.
  struct Words {
    std::string text;
    std::optional<procedure::Buttons> buttons = {};
    std::string filament = {};  ///< the start button's: a key
  };

  // The last good answer, and which filament it was made with.
  struct Proposal {
    KeptAnswer answer;
    std::string filament;
  };

  // Shared with the printer's callbacks, which may outlive the listener.
  struct Inbox {
    std::mutex mutex;
    std::condition_variable_any called;
    std::deque<Call> calls;
    std::deque<Words> words;  ///< of the calibration, for the screen
  };

  void Answer(const Call& call);
  void Calibrate(const std::string& filament);
  // Each gives a sentence for the screen: the answer, or why there is none.
  [[nodiscard]] Words RunCalibration(const std::string& filament,
                                     procedure::RecordingCutter* cutter);
  [[nodiscard]] Words Propose(const std::filesystem::path& folder, const std::string& filament);
  [[nodiscard]] Words Offer(const std::string& filament) const;
  [[nodiscard]] std::string Apply();
  [[nodiscard]] std::string Dismiss();
  void Tell(Words words);  // from the worker: written down now, shown by Serve
  void Show(const Words& words);
  void ShowAll();  // what the worker told so far

  machine::Printer& printer_;
  PrinterOptions options_;
  std::filesystem::path recordings_;
  bool keep_full_;
  std::stop_token stop_;

  procedure::Screen screen_;  // only Serve's thread speaks
  std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
  std::mutex mutex_;
  bool working_ = false;              // guarded by mutex_
  std::optional<Proposal> proposal_;  // guarded by mutex_
  std::jthread worker_;               // last: it uses everything above
};

}  // namespace trammel::app
