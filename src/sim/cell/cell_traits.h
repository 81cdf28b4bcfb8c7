// Contact force of a nozzle and a bed at a given depth.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "base/result.h"

namespace trammel::sim {

enum class ContactKind {
  kLinear,     ///< F = k d: everything that gives way is a spring
  kQuadratic,  ///< F = k d (1 + a d/D): stiffens (a > 0) or softens (a < 0)
  kCubic,      ///< F = k d (1 + a (d/D)^2)
  kPower,      ///< F = k D (d/D)^n: n = 1.5 is Hertz's sphere on a plane
  kTwoSlope,   ///< F = k d up to the knee, a times k more or less beyond: a second body bears too
  kYielding,   ///< F = k h D (1 - exp(-d/(h D))): gives way more and more, h is the knee
};

/// Increase of the stiffness behind the toe, at the end to that of the bed alone.
enum class ToeKind {
  kRounded,      ///< evenly with depth, or at once: a film that is pressed flat
  kExponential,  ///< a film in series whose compliance falls exponentially with force: it is packed
};

/// Force over the carriage's depth below the height of first touch. The compliance is that of the
/// whole: bed, nozzle, cell and frame. Beyond D the law continues along its tangent.
struct ContactStiffness {
  ContactKind kind = ContactKind::kLinear;
  double stiffness_g_mm = 3500;  ///< k, 1 … 1e6
  double reference_mm = 0.045;   ///< D, 1e-4 … 1
  double share =
      0;  ///< a, -0.45 … 5 (kTwoSlope: -0.95 … 5): force at D in excess of k D, as a share of it
  double exponent = 1;  ///< n of kPower, 0.4 … 3
  double knee = 0.5;    ///< of kTwoSlope and kYielding, as a share of D, 0.05 … 20
  /// Soft film, burr or washer in front of the contact: the initial stiffness is only toe_share of
  /// the law's. kRounded: it rises to it between toe_mm (1 - toe_rounding) and toe_mm (1 +
  /// toe_rounding). kExponential: d = x + (1 - s) T (1 - exp(-x / (s T))), with x the law's depth,
  /// T toe_mm and s toe_share; far below, both are equally deep.
  ToeKind toe_kind = ToeKind::kRounded;
  double toe_mm = 0;                ///< 0 … 0.2
  double toe_share = 1;             ///< 0.02 … 1
  double toe_rounding = 0;          ///< 0 … 1
  double sheet_gap_mm = 0;          ///< a loose sheet gives way so far before it lies, 0 … 1
  double sheet_stiffness_g_mm = 0;  ///< and so softly, 0 … 1e5
};

/// Returns the force, gf; 0 at and above the height of first touch. Never falls with depth.
[[nodiscard]] double ContactForce(const ContactStiffness& law, double depth_mm);

/// Computes the inverse, to 1e-9 mm; 0 for forces that are not positive.
[[nodiscard]] double ContactDepth(const ContactStiffness& law, double force_g);

/// z(t) = start_z_mm + z_direction (start_velocity_mm_s dt + acceleration_mm_s2 dt^2 / 2).
struct ZMove {
  double start_time_s = 0;
  double duration_s = 0;  ///< 0: the place is told anew, the head stands
  double start_velocity_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double start_z_mm = 0;
  double z_direction = 0;  ///< -1 down, +1 up, 0 at rest
};

/// Motion of a tap. Defaults: recorded taps of a Voron with an HX717.
struct TapMotion {
  double approach_speed_mm_s = 2;   ///< 0.05 … 50
  double acceleration_mm_s2 = 350;  ///< at every start and end, 1 … 1e5
  double approach_from_mm = 1.05;   ///< above the bed, 0.02 … 100
  double trigger_force_g = 75;      ///< 1 … 1e5
  /// Time from the triggering sample until the steps end, 0 … 0.5 s.
  double stop_latency_s = 0.008;
  double told_after_s = 0.25;          ///< from the stop to the halt's entry in the queue, 0 … 5
  double pause_s = 0.17;               ///< from that entry to the pull-back, 0 … 5
  double pull_back_mm = 0.1;           ///< 0.005 … 5
  double pull_back_speed_mm_s = 0.32;  ///< 0.005 … 20; at 320 samples/s 1 um per sample
};

/// Returns start and cruise of the approach, cut short by the stop at `halt_z_mm`; as in Klipper,
/// the approach has no deceleration. REQUIRES start_z_mm > halt_z_mm.
[[nodiscard]] std::vector<ZMove> ApproachMoves(const TapMotion& motion, double start_time_s,
                                               double start_z_mm, double halt_z_mm);

/// Returns the halt's entry, then start, cruise and end of the pull-back. Without cruise if the
/// pull-back is too short to reach its speed.
[[nodiscard]] std::vector<ZMove> PullBackMoves(const TapMotion& motion, double stop_time_s,
                                               double halt_z_mm);

struct ZState {
  double z_mm = 0;
  double velocity_mm_s = 0;  ///< signed, up is positive
};

/// Returns the state; before the first move: at its start; between and after moves: at rest at the
/// last end. REQUIRES moves in order of time, not empty.
[[nodiscard]] ZState StateAt(std::span<const ZMove> moves, double time_s);

/// Start of the head's rise after a press: reversal of a Z drive.
enum class Onset {
  kInstant,  ///< it follows at once
  kFlat,     ///< backlash: it stands until the drive has moved by onset_travel_mm
  kCurved,   ///< friction with elasticity: it begins softly and is there after a few of them
};

/// Traits of the contact.
struct PressTraits {
  ContactStiffness law;
  Onset onset = Onset::kInstant;
  double onset_travel_mm = 0;  ///< 0 … 0.1
  /// Share of the force that a held press loses, with its time constant: part of the compliance is
  /// viscous, so a dent remains for a while and the nozzle releases earlier. 0 … 0.5; 0.001 … 100 s
  double creep_share = 0;
  double creep_s = 0.2;
  /// Maximum adhesion of the nozzle to the bed after the press, before it snaps off. gf
  double stick_g = 0;
  /// Blob under the nozzle: force at which it yields plastically, its height, and after the press
  /// the maximum pull thread_g of its thread, mainly at thread_mm above the bed.
  double blob_g = 0;
  double blob_mm = 0.1;
  double thread_g = 0;
  double thread_mm = 0.03;
  /// Strand of plastic drawn out after the press: its tension rises to strand_g within a few
  /// strand_onset_mm above the bed, falls with its cross-section when it stretches to several
  /// strand_length_mm, and vanishes when it snaps at strand_snap_mm.
  double strand_g = 0;             ///< 0 … 1e4
  double strand_onset_mm = 0.002;  ///< 1e-6 … 5
  double strand_length_mm = 0.1;   ///< 1e-3 … 100
  double strand_snap_mm = 0.15;    ///< 1e-3 … 5
};

/// Returns the nozzle's height above the commanded position of a descending drive.
[[nodiscard]] inline double BacklashOf(const PressTraits& press) {
  return press.onset == Onset::kInstant ? 0 : press.onset_travel_mm;
}

/// Other forces on the cell, and noise before the converter.
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
  double ring_hz = 60;   ///< its frequency …
  double ring_s = 0.05;  ///< … and the time constant with which it dies
  /// Resonance of the structure that transmits a share of the bed's force to the cell, with a mass
  /// that the drive accelerates: the break, starts and stops excite it.
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
  double heater_hz = 10;        ///< pulse width modulation
  double heater_duty = 0.4;
};

/// Converter: HX711, HX717, ADS131 and similar.
struct ConverterTraits {
  double rate_hz = 320;  ///< 5 … 1e5
  /// Number of consecutive one-sample boxcar filters of the force (a sinc filter): 0 takes the
  /// force at the sample's time, 4 is an HX711. The reading is delayed by order/2 samples.
  int filter_order = 0;       ///< 0 … 5
  double counts_per_g = 100;  ///< 0.01 … 1e5; rounds to whole counts
  double sign = 1;            ///< -1: a press counts downwards
  double offset_g = 0;        ///< untared cell's reading without load
  double saturation_g = 1e5;  ///< it reads no more than this either way, offset included
  double latency_s = 0;       ///< time stamps are so late besides; -0.02 … 0.1
  /// Errors of the cell itself: a share of its reading follows the load with the time constant, and
  /// during unloading a share of the load remains in the reading, most at half the peak
  /// (hysteresis).
  double creep_share = 0;       ///< 0 … 0.5
  double creep_s = 0.5;         ///< 1e-3 … 100
  double hysteresis_share = 0;  ///< -0.5 … 0.5
};

/// Faults of samples after the converter. Shares are of all samples, 0 … 1; times are from the
/// recording's first sample (of an impulse: from the cell's start); NaN: never.
struct SampleFaults {
  double drop_share = 0;            ///< not there
  double duplicate_time_share = 0;  ///< bear the time of the sample before
  double held_share = 0;            ///< bear the value of the sample before …
  bool held_regularly = false;      ///< … in turn, as from a host faster than the converter
  bool held_times = false;          ///< … and its time
  double jitter = 0;                ///< time stamp spread over the interval, 0 … 2
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

/// Draws a plausible cell on a plausible bed: every law, onset and converter occurs, disturbances
/// are small, without faults.
[[nodiscard]] CellTraits DrawCellTraits(Random& random);

/// Returns the names of cells: "reference" (320 samples/s, 2 gf, 3500 gf/mm) and the reference with
/// one change each.
[[nodiscard]] std::vector<std::string> CellNames();

/// Error (kInput): an unknown name; the message lists the known ones.
[[nodiscard]] Result<CellTraits> CellByName(std::string_view name);

}  // namespace trammel::sim
