// What one virtual load cell with its nozzle, bed and converter is like.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/cell/contact_law.h"
#include "sim/cell/tap_moves.h"

namespace trammel::sim {

/// How the head begins to rise after a press: what a Z drive does when it turns round.
enum class Onset {
  kInstant,  ///< it follows at once
  kFlat,     ///< backlash: it stands until the drive has moved by onset_travel_mm
  kCurved,   ///< friction with elasticity: it begins softly and is there after a few of them
};

/// The contact.
struct PressTraits {
  ContactLaw law;
  Onset onset = Onset::kInstant;
  double onset_travel_mm = 0;  ///< 0 … 0.1
  /// A share of the force that a held press loses, with its time constant: part of what gives way
  /// is viscous, so a dent stays for a while and the nozzle lets go earlier. 0 … 0.5; 0.001 … 100 s
  double creep_share = 0;
  double creep_s = 0.2;
  /// After the press the nozzle sticks to the bed until it pulls with so much, then snaps off. gf
  double stick_g = 0;
  /// A blob under the nozzle: gives way plastically with so much force, is so high, and after the
  /// press a thread of it pulls with thread_g at most, most of it at thread_mm above the bed.
  double blob_g = 0;
  double blob_mm = 0.1;
  double thread_g = 0;
  double thread_mm = 0.03;
  /// A strand of plastic that is drawn out after the press: its tension rises to strand_g within a
  /// few strand_onset_mm above the bed, falls as its section does when it stretches to several
  /// strand_length_mm, and is gone once it snaps at strand_snap_mm.
  double strand_g = 0;             ///< 0 … 1e4
  double strand_onset_mm = 0.002;  ///< 1e-6 … 5
  double strand_length_mm = 0.1;   ///< 1e-3 … 100
  double strand_snap_mm = 0.15;    ///< 1e-3 … 5
};

/// By how much the nozzle is above where a drive on its way down was told to be.
[[nodiscard]] inline double PlayOf(const PressTraits& press) {
  return press.onset == Onset::kInstant ? 0 : press.onset_travel_mm;
}

/// What else acts on the cell, and what is added on the way to the converter.
struct DisturbanceTraits {
  double noise_g = 2;           ///< white, of one sample at the converter's output
  double pink_g = 0;            ///< 1 sigma of 1/f noise from 0.02 Hz to half the sample rate
  double approach_noise_g = 0;  ///< more of it at approach speed, in proportion to the speed
  double approach_speed_mm_s = 2;
  double drift_g_s = 0;   ///< cable and Bowden tube, with time
  double drift_g_mm = 0;  ///< and with height above the bed
  double wander_g = 0;    ///< 1 sigma of a slow random walk that returns …
  double wander_s = 1;    ///< … with this time constant
  double hum_g = 0;       ///< amplitude of mains' fundamental
  double hum_hz = 50;     ///< 50 or 60
  double hum_second = 0;  ///< amplitudes of its harmonics over the fundamental's
  double hum_third = 0;
  double ring_g = 0;     ///< amplitude of the frame's ringing after a stop at approach speed
  double ring_hz = 60;   ///< of it …
  double ring_s = 0.05;  ///< … and the time constant with which it dies
  /// A resonance of the structure through which a share of the bed's force reaches the cell, and
  /// whose mass the drive accelerates: the break, starts and stops set it ringing.
  double mode_share = 0;       ///< 0 … 1
  double mode_mass_g = 0;      ///< 0 … 1e5 g
  double mode_hz = 12;         ///< 0.5 … 1e4
  double mode_damping = 0.03;  ///< ratio to critical, 1e-4 … 0.9
  double swing_g = 0;          ///< amplitude of a constant swing (a fan, a gantry) …
  double swing_hz = 12;        ///< … and its frequency, 0.1 … 1e4
  double slip_g = 0;           ///< force that goes when a filament or a cable slips, once a tap …
  double slip_above_mm = 0.02;  ///< … as the nozzle rises past this height above the bed, -1 … 5 …
  double slip_s = 0.002;        ///< … within about this time, 1e-6 … 10
  double heater_g = 0;          ///< step while the heater draws current
  double heater_hz = 10;        ///< of its pulse width modulation
  double heater_duty = 0.4;
};

/// The converter: HX711, HX717, ADS131 and their like.
struct ConverterTraits {
  double rate_hz = 320;  ///< 5 … 1e5
  /// Boxcars of one sample each, one after the other, that the force passes through (a sinc
  /// filter): 0 takes the force at the sample's time, 4 is an HX711. The force is read order/2
  /// samples late.
  int filter_order = 0;       ///< 0 … 5
  double counts_per_g = 100;  ///< 0.01 … 1e5; rounds to whole counts
  double sign = 1;            ///< -1: a press counts downwards
  double offset_g = 0;        ///< of the untared cell; what it reads without load
  double saturation_g = 1e5;  ///< it reads no more than this either way, offset included
  double latency_s = 0;       ///< time stamps are so late besides; -0.02 … 0.1
  /// The cell itself: a share of its reading follows the load only with the time constant, and on
  /// the way down a share of the load stays in the reading, most at half the peak (hysteresis).
  double creep_share = 0;       ///< 0 … 0.5
  double creep_s = 0.5;         ///< 1e-3 … 100
  double hysteresis_share = 0;  ///< -0.5 … 0.5
};

/// What goes wrong with samples after the converter. Shares are of all samples, 0 … 1; times are
/// from the recording's first sample (of an impulse: from the cell's start); NaN: never.
struct SampleFaults {
  double drop_share = 0;            ///< not there
  double duplicate_time_share = 0;  ///< bear the time of the sample before
  double held_share = 0;            ///< bear the value of the sample before …
  bool held_regularly = false;      ///< … in turn, as from a host faster than the converter
  bool held_times = false;          ///< … and its time
  double jitter = 0;                ///< of time stamps, their spread over the interval, 0 … 2
  double clock_step_at_s = __builtin_nan("");  ///< the samples' clock jumps …
  double clock_step_s = 0;                     ///< … by so much, -1 … 1
  double minus_one_share = 0;               ///< counts are -1: read before the converter was ready
  double stuck_at_s = __builtin_nan("");    ///< the last value is repeated …
  double stuck_s = 0.1;                     ///< … for so long
  double gap_at_s = __builtin_nan("");      ///< no samples …
  double gap_s = 0.1;                       ///< … for so long
  double impulse_at_s = __builtin_nan("");  ///< something hits the cell, for 10 ms
  double impulse_g = 60;
};

struct CellTraits {
  PressTraits press;
  DisturbanceTraits disturbance;
  ConverterTraits converter;
  SampleFaults faults;
};

/// Names the field, the value and the bound of the first trait that cannot be.
[[nodiscard]] Result<void> Validate(const CellTraits& traits);

/// A plausible cell on a plausible bed: every law, onset and converter occurs, disturbances are
/// small, nothing is faulty.
[[nodiscard]] CellTraits DrawCellTraits(Random& random);

/// Cells by name: "reference" (320 samples/s, 2 gf, 3500 gf/mm) and the reference with one thing
/// that is different.
[[nodiscard]] std::vector<std::string> CellNames();

/// Error (kInput): another name; the message lists what exists.
[[nodiscard]] Result<CellTraits> CellByName(std::string_view name);

}  // namespace trammel::sim
