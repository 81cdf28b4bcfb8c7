// Relation of the printer's clocks and ours, from messages with time stamps.
#pragma once

#include <array>
#include <deque>
#include <optional>

#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Message with a time stamp.
struct ClockSample {
  /// Host time before the request; absent for an unrequested message.
  std::optional<double> sent_s = std::nullopt;
  double received_s = 0;   ///< host time when it was here
  double eventtime_s = 0;  ///< the server's clock, read between the two
  std::optional<double> estimated_print_time_s = std::nullopt;  ///< print time at eventtime
};

/// Lead times of a query before the next update, used in turn. A late one (it takes longer than its
/// lead) yields no information, an early one little: the best lead depends on the network.
inline constexpr std::array<double, 6> kQueryLeads_s = {0.0015, 0.003, 0.005, 0.009, 0.016, 0.03};

/// Maintains, for each clock, the set of all straight lines consistent with the samples: a time was
/// read after its request was sent and before it was received, whatever the delays were. Delays
/// only widen the set without bias; one fast answer narrows it. The centre of the set is the
/// estimate, its extent the bound.
///
/// Detects a server clock of another rate (a simulation that runs faster) and a clock that jumps (a
/// restart of the firmware): earlier samples are discarded.
class PrintClock {
 public:
  /// Samples must be ordered by received_s. Ignores values that are not finite.
  void Add(const ClockSample& sample);
  void Reset() { samples_.clear(); }

  /// Absent before the first sample with a print time.
  [[nodiscard]] std::optional<ClockRelation> Relation() const;

  /// Predicts when the next unrequested message will be read, as host time; at the latest, later by
  /// no more than the fastest delivery so far. A query that arrives just before is answered
  /// together with it, and bounds the time most closely. Absent before there are a few such
  /// messages.
  [[nodiscard]] std::optional<double> NextUpdate() const;

 private:
  std::deque<ClockSample> samples_;
};

}  // namespace trammel::machine
