// Processing of taps as they arrive: analysed, compared, stored, and returned to a waiting macro.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "machine/moonraker/taps/tap_stream.h"
#include "tap/commands/tap_run.h"

namespace trammel::app {

struct WatchOptions {
  tap::TapOptions tap;
  std::filesystem::path recording;  ///< JSON lines that every tap is added to.
  std::string printer;              ///< address, noted with each
  bool answer = false;              ///< Send each macro that asks its contact.
  double answer_within_s = 3;       ///< from the macro's call; then it receives a failure
  std::size_t count = 0;            ///< Ends after so many taps; 0: never.
};

/// Returns the macro call with the result of an analysis: Z, U, LO and HI only if it is good,
/// otherwise the reason's name. @param id  of the calling macro; empty: none.
[[nodiscard]] std::string AnswerScript(const tap::TapAnalysis& analysis, const std::string& id);
/// Returns the macro call for a missing tap.
[[nodiscard]] std::string NoTapScript(const std::string& id);

/// Takes events from a TapStream's thread and processes them on its caller's. Prints every tap on
/// standard output.
class TapWatcher {
 public:
  explicit TapWatcher(WatchOptions options);

  /// Returns the events for OpenTapStream. The watcher must outlive the stream.
  [[nodiscard]] machine::TapStreamEvents Events();

  /// Runs until stopped or until the requested number of taps. @returns an exit code.
  [[nodiscard]] int Serve(machine::TapStream& stream, const std::stop_token& stop);

 private:
  struct TapCame {
    nlohmann::json tap;
    double received_s = 0;
  };
  struct FirmwareZ {
    double z_mm = 0;
    double received_s = 0;
  };
  struct Call {
    std::string id;
    double since_print_time_s = 0;  ///< the tap that is meant rose after it
    double took_s = 0;              ///< from then to the macro's request; 0: unknown
    double received_s = 0;
  };
  struct News {
    std::string text;
  };
  using Event = std::variant<TapCame, FirmwareZ, Call, News>;
  /// Tap that may still receive the printer's own result.
  struct Open {
    nlohmann::json raw;
    report::AnalysedTap tap;
    double received_s = 0;
  };

  void Push(Event event);
  [[nodiscard]] std::optional<Event> Next(const std::stop_token& stop);
  [[nodiscard]] double NextDeadline() const;
  [[nodiscard]] bool Enough() const;
  void Take(TapCame& came, machine::TapStream& stream);
  void Take(const FirmwareZ& firmware);
  void Take(const Call& call, machine::TapStream& stream);
  void Answer(machine::TapStream& stream, double now_s);
  void Close();
  void Keep(Open& open);
  void PrintSummary() const;

  const WatchOptions options_;
  tap::TapAnalyser analyser_;
  std::mutex mutex_;
  std::condition_variable_any came_;
  std::deque<Event> events_;

  // Used only by Serve's thread.
  std::optional<Open> open_;
  std::optional<FirmwareZ> loose_z_;
  std::optional<Call> asked_;
  std::optional<double> unanswered_s_;  ///< time of the last tap not yet sent to a macro
  std::optional<tap::TapAnalysis> last_;
  std::optional<double> last_rise_print_time_s_;  ///< if the tap states when it rose
  std::vector<report::AnalysedTap> taps_;         ///< without samples
  std::size_t unrecorded_ = 0;                    ///< taps that did not fit
  std::vector<double> received_s_;
  std::vector<double> differences_mm_;  ///< The printer's z minus ours.
};

}  // namespace trammel::app
