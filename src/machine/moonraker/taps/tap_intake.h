// What a printer's messages report of taps, whatever link they came over.
#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "machine/moonraker/printer.h"
#include "machine/moonraker/taps/tap_stream.h"

namespace trammel::machine {

/// Looks for a descent along z, a halt, and a rise of at most 1 mm, and cuts out the samples around
/// them. What comes a second time is dropped; a move that comes again with another length was cut
/// short, and replaces the first. Not thread-safe.
class TapBuilder {
 public:
  /// One batch of load_cell/dump_force: "data" with [time, force, …] rows. Others are skipped.
  void AddForces(const nlohmann::json& batch);
  /// One batch of motion_report/dump_trapq (MoveLog::Add).
  void AddMoves(const nlohmann::json& batch);
  /// What is kept belongs to another time: the firmware was restarted.
  void Reset();

  /// The taps that are complete, each once, in the shape of load_cell_probe/dump_taps: "time",
  /// "force" and "moves"; "x_rise_print_time_s" is when the rise began.
  [[nodiscard]] std::vector<nlohmann::json> Take();
  /// Print time of the newest force; -infinity where none came.
  [[nodiscard]] double forces_until_s() const;
  /// Forces come and moves have not for a while. True of a printer that stands still, too.
  [[nodiscard]] bool MovesStayAway() const;

 private:
  struct Sample {
    double time_s = 0;
    double force_g = 0;
  };
  /// A rise, and the descent before it, as indices of moves_.
  struct Found {
    std::size_t first = 0;
    std::size_t rise = 0;
    std::size_t end = 0;
  };
  [[nodiscard]] bool Complete(const Found& found, double& until_s) const;
  [[nodiscard]] bool FindRise(std::size_t from, Found& found) const;
  [[nodiscard]] nlohmann::json Cut(const Found& found, double until_s) const;
  void Insert(const TrapezoidMove& move);
  void Forget();

  std::deque<Sample> samples_;
  std::deque<TrapezoidMove> moves_;
  double taken_until_s_ = -1e300;
};

/// A load cell by the name that requests want.
struct LoadCellName {
  std::string name;
  bool probe = false;  ///< It has dump_taps, too.
};

/// The first load cell among the printer's objects, a probe before any other. "load_cell_probe" is
/// called so in requests, "load_cell_probe left" by its last word.
[[nodiscard]] std::optional<LoadCellName> FirstLoadCell(const nlohmann::json& objects);

/// Turns messages into events. Of one thread, but for temperature().
class TapIntake {
 public:
  explicit TapIntake(TapStreamEvents events) : events_(std::move(events)) {}

  void TakeTap(const nlohmann::json& params, double received_s);
  void TakeForces(const nlohmann::json& batch, double received_s);
  void TakeMoves(const nlohmann::json& batch, double received_s);
  /// @param first  The answer to a subscription: its probe result is of an earlier tap.
  void TakeStatus(const nlohmann::json& status, double received_s, bool first);
  void TakeLine(const std::string& line, double received_s);
  void TakeCall(const nlohmann::json& arguments, double received_s) const;
  void Tell(const std::string& news) const { events_.on_news(news); }
  /// Print time begins anew.
  void Restart();
  /// The printer has dump_taps, which tells with the first tap whether it sends whole ones.
  void ExpectTaps() { source_ = Source::kUnknown; }
  /// A macro has just moved, and nothing was told of it: the moves have to be asked for again. True
  /// once for each restart.
  [[nodiscard]] bool MissesMoves();
  /// Z offset of the probe's settings.
  void TakeSettings(const nlohmann::json& status);

  [[nodiscard]] std::optional<double> temperature_c() const;

 private:
  /// Who puts the taps together.
  enum class Source { kUnknown, kPrinter, kBuilder };
  void HandOnBuilt(double received_s);

  const TapStreamEvents events_;
  TapBuilder builder_;
  Source source_ = Source::kBuilder;
  std::vector<nlohmann::json> held_;  ///< built while nobody knew whether the printer sends its own
  bool missed_moves_ = false;
  nlohmann::json last_whole_;  ///< a second subscription brings each tap twice
  double z_offset_mm_ = 0;
  bool by_position_ = false;  ///< the printer tells last_probe_position alone
  mutable std::mutex mutex_;
  std::optional<double> temperature_c_;
};

}  // namespace trammel::machine
