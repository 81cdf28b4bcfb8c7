// How this process's clock and a printer's clocks go together.
#pragma once

namespace trammel::machine {

/// Clock b as a straight line over clock a, b = b0 + rate · (a − a0), with the bound that the
/// samples leave.
struct ClockLine {
  double a0_s = 0;  ///< where the bound is tightest is near here
  double b0_s = 0;
  double rate = 1;             ///< seconds of b per second of a; 1 up to the drift of two crystals
  double half_width_s = 0;     ///< at a0: b lies within ± this
  double half_width_rate = 0;  ///< grows by this per second away from a0

  [[nodiscard]] double BFromA(double a_s) const { return b0_s + rate * (a_s - a0_s); }
  [[nodiscard]] double AFromB(double b_s) const { return a0_s + (b_s - b0_s) / rate; }
  /// ± bound of b at a, seconds.
  [[nodiscard]] double HalfWidth(double a_s) const {
    const double away_s = a_s > a0_s ? a_s - a0_s : a0_s - a_s;
    return half_width_s + half_width_rate * away_s;
  }
};

/// host: this process's CLOCK_MONOTONIC (std::chrono::steady_clock). event: the clock of the host
/// that the firmware runs on (its CLOCK_MONOTONIC_RAW). print: the firmware's print time.
struct ClockRelation {
  ClockLine event_from_host;
  ClockLine print_from_host;
  int samples = 0;  ///< that the relation rests on

  [[nodiscard]] double PrintTimeOf(double host_s) const { return print_from_host.BFromA(host_s); }
  [[nodiscard]] double HostTimeOf(double print_s) const { return print_from_host.AFromB(print_s); }
  /// ± bound of PrintTimeOf(host), seconds; divide by √3 for a standard uncertainty.
  [[nodiscard]] double PrintTimeBound(double host_s) const {
    return print_from_host.HalfWidth(host_s);
  }
};

}  // namespace trammel::machine
