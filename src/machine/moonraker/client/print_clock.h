// How the printer's clocks and ours go together, from messages that carry their times.
#pragma once

#include <array>
#include <deque>
#include <optional>

#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// One message with a time in it.
struct ClockSample {
  /// Host time before it was asked for; absent where nobody asked.
  std::optional<double> sent_s = std::nullopt;
  double received_s = 0;   ///< host time when it was here
  double eventtime_s = 0;  ///< the server's clock, read between the two
  std::optional<double> estimated_print_time_s = std::nullopt;  ///< print time at eventtime
};

/// How long before the next update a query is best sent, in turn. A late one (it takes longer than
/// its lead) tells nothing, an early one little: which lead is best depends on the network.
inline constexpr std::array<double, 6> kQueryLeads_s = {0.0015, 0.003, 0.005, 0.009, 0.016, 0.03};

/// Keeps, for each clock, the set of all straight lines that no sample contradicts: a time was read
/// after its request was sent and before it was received, whatever the delays were. Delays only
/// widen the set, they never bias it; one fast answer narrows it. The middle of the set is the
/// estimate, its extent the bound.
///
/// A server whose time runs at another rate than ours (a simulation that runs faster) is noticed,
/// and so is a clock that jumps (a restart of the firmware): what was before is forgotten.
class PrintClock {
 public:
  /// Samples must come in order of received_s. Values that are not finite are ignored.
  void Add(const ClockSample& sample);
  void Reset() { samples_.clear(); }

  /// Absent before there is a sample with a print time.
  [[nodiscard]] std::optional<ClockRelation> Relation() const;

  /// When the next message that nobody asks for will be read, as host time; at the latest, later by
  /// no more than the fastest delivery so far. A question that arrives just before it is answered
  /// with it, and brackets the time most closely. Absent before there are a few such messages.
  [[nodiscard]] std::optional<double> NextUpdate() const;

 private:
  std::deque<ClockSample> samples_;
};

}  // namespace trammel::machine
