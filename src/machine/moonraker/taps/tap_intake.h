// Taps in a printer's messages, independent of the link.
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

/// Finds a descent along z, a halt, and a rise of at most 1 mm, and cuts out the samples around
/// them. Drops repeated data; a repeated move with another length replaces the first, which was cut
/// short. Not thread-safe.
class TapBuilder {
 public:
  /// Adds a batch of load_cell/dump_force: "data" with [time, force, …] rows. Skips other rows.
  void AddForces(const nlohmann::json& batch);
  /// Adds a batch of motion_report/dump_trapq (MoveLog::Add).
  void AddMoves(const nlohmann::json& batch);
  /// Discards all data from before a restart of the firmware.
  void Reset();

  /// Returns the complete taps, each once, in the format of load_cell_probe/dump_taps: "time",
  /// "force" and "moves"; "x_rise_print_time_s" is the start of the rise.
  [[nodiscard]] std::vector<nlohmann::json> Take();
  /// Returns the print time of the newest force; -infinity if there is none.
  [[nodiscard]] double forces_until_s() const;
  /// True if forces arrive but moves have not for a while; also for a printer at rest.
  [[nodiscard]] bool MovesStayAway() const;

 private:
  struct Sample {
    double time_s = 0;
    double force_g = 0;
  };
  /// Rise, and the descent before it, as indices of moves_.
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

/// Name of a load cell in requests.
struct LoadCellName {
  std::string name;
  bool probe = false;  ///< It has dump_taps, too.
};

/// Finds the first load cell among the printer's objects, a probe before any other. Requests name
/// "load_cell_probe" in full, "load_cell_probe left" by its last word.
[[nodiscard]] std::optional<LoadCellName> FirstLoadCell(const nlohmann::json& objects);

/// Converts messages to events. Single-threaded, except temperature().
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
  void Notify(const std::string& news) const { events_.on_news(news); }
  /// Resets after print time restarted.
  void Restart();
  /// Notes that the printer has dump_taps; the first tap shows if it sends complete ones.
  void ExpectTaps() { source_ = Source::kUnknown; }
  /// True if a macro has just moved without a report: the moves must be subscribed to again. True
  /// once for each restart.
  [[nodiscard]] bool MissesMoves();
  /// Reads the Z offset from the probe's settings.
  void TakeSettings(const nlohmann::json& status);

  [[nodiscard]] std::optional<double> temperature_c() const;

 private:
  /// Assembler of the taps.
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
