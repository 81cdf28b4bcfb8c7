// Contributions of structure, plastic and the cell itself to the bed's force over time.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "base/random.h"
#include "sim/cell/cell_traits.h"

namespace trammel::sim {

/// Damped resonance of the structure, advanced exactly for a piecewise constant drive.
class StructureMode {
 public:
  /// Advances by dt_s. @returns the ringing's contribution to the reading, gf: the mode's force
  /// minus its static share of the bed's force.
  /// @param acceleration_mm_s2  mean of the drive's since the last call.
  [[nodiscard]] double Advance(const DisturbanceTraits& traits, double bed_g,
                               double acceleration_mm_s2, double dt_s);

 private:
  bool begun_ = false;
  double force_g_ = 0;
  double rate_g_s_ = 0;
};

/// 1/f noise: sums relaxation processes with time constants two octaves apart, all of one strength.
class PinkNoise {
 public:
  PinkNoise(double rate_hz, Random random);
  /// @returns the next sample's, of standard deviation 1.
  [[nodiscard]] double Next();

 private:
  Random random_;
  std::vector<double> kept_;
  std::vector<double> values_;
};

/// Strand of plastic between nozzle and bed.
class PlasticStrand {
 public:
  /// @returns its pull at a height above the bed, gf; touching the bed fastens a new one.
  [[nodiscard]] double Pull(const PressTraits& traits, double gap_mm);

 private:
  bool fast_ = false;
};

/// Filament or cable that slips as the nozzle rises, once after each press.
class Slip {
 public:
  /// Advances by dt_s. @returns the contribution to the reading, gf.
  [[nodiscard]] double Force(const DisturbanceTraits& traits, double gap_mm, double dt_s);

 private:
  bool armed_ = false;
  double slips_ = 0;
  double gone_ = 0;  ///< part of the slips that has taken effect
};

/// Creep and hysteresis of the cell.
class CellMemory {
 public:
  /// Advances by dt_s. @returns the load shown by the cell, gf.
  [[nodiscard]] double Advance(const ConverterTraits& traits, double load_g, double dt_s);

 private:
  bool begun_ = false;
  double slow_g_ = 0;  ///< creeping part of the reading
  double peak_g_ = 0;  ///< maximum load since the last zero
};

/// Exponent of a blob's force over its compression until it is flat: a dome is soft at first.
inline constexpr double kBlobShape = 1.5;

/// Motion of the nozzle at one moment.
struct NozzleState {
  double z_mm = 0;           ///< commanded position
  double velocity_mm_s = 0;  ///< signed
  double surface_z_mm = 0;   ///< first contact with the bed below
};

/// Motion of the nozzle over time; called in order of time.
using NozzleAt = std::function<NozzleState(double time_s)>;

/// True course of one press. Heights are the drive's commanded ones, as a client knows only these.
struct PressTruth {
  double touch_time_s = 0;    ///< the nozzle met the bed
  double touch_z_mm = 0;      ///< below the height of letting go by what the drive has of play
  double contact_time_s = 0;  ///< the bed's force on it came to 0: it let go
  double contact_z_mm = 0;
  double snap_z_mm = 0;  ///< where it stuck: it came free; else the same as contact
  double peak_force_g = 0;
};

/// Sample as delivered by the converter.
struct CellSample {
  double time_s = 0;
  double force_g = 0;  ///< counts over the scale, nothing tared
  long long counts = 0;
  bool saturated = false;
};

/// Physics and converter in one, advanced from sample to sample. The contact depends on the
/// nozzle's whole path: backlash, creep, plastic.
class LoadCell {
 public:
  /// REQUIRES valid traits. The first sample comes within one sampling interval of start_s.
  LoadCell(const CellTraits& traits, double start_s, Random random);

  /// Returns the time of the next sample's arrival.
  [[nodiscard]] double next_time_s() const {
    return next_s_ + std::max(0.0, traits_.converter.latency_s);
  }
  /// Advances to the next sample. SampleCorruptor adds the samples' faults.
  [[nodiscard]] CellSample Next(const NozzleAt& nozzle);
  /// Returns the delay of its readings behind the force.
  [[nodiscard]] double latency_s() const;
  /// Returns and removes the presses that have ended, oldest first.
  [[nodiscard]] std::vector<PressTruth> TakePresses();

 private:
  struct Fine {
    double time_s = 0;
    double drive_z_mm = 0;
    double depth_mm = 0;   ///< nozzle depth below first contact
    double contact_g = 0;  ///< the bed's force, were it able to pull
  };
  void Begin(double time_s, const NozzleState& nozzle);
  void Step(double time_s, const NozzleAt& nozzle);
  void FollowDrive(double drive_z_mm);
  [[nodiscard]] double Elastic(double depth_mm) const;
  double BedForce(const Fine& now);
  double PlasticForce(double gap_mm, double fell_mm, double dt_s);
  double Disturbance(double time_s, double gap_mm, double dt_s);
  [[nodiscard]] double Filtered(double force_g);
  double OutputNoise();
  void NoteTruth(const Fine& now, double bed_g);

  CellTraits traits_;
  Random random_;
  double start_s_;
  double first_s_;  ///< first sample
  double next_s_;
  long long samples_ = 0;
  bool begun_ = false;
  Fine last_;
  double speed_mm_s_ = 0;
  double nozzle_z_mm_ = 0;
  double dent_g_ = 0;  ///< viscous yield of the bed, as a force
  double wander_g_ = 0;
  double blob_mm_ = 0;  ///< height of the plastic below the nozzle
  double blob_force_g_ = 0;
  bool thread_ = false;
  bool touching_ = false;  ///< a press has begun and is not over
  bool stuck_ = false;
  PressTruth press_;
  std::vector<PressTruth> presses_;
  std::array<double, 3> hum_phase_rad_{};
  double heater_phase_ = 0;
  double stopped_s_ = 0;     ///< time of the latest abrupt stop …
  double stopped_mm_s_ = 0;  ///< … and how fast it was
  std::array<std::vector<double>, 5> boxcars_;
  std::array<double, 5> boxcar_sums_{};
  std::size_t boxcar_at_ = 0;
  double force_g_ = 0;
  double velocity_mm_s_ = 0;
  StructureMode mode_;
  PinkNoise pink_;
  PlasticStrand strand_;
  Slip slip_;
  CellMemory memory_;
  double swing_phase_rad_ = 0;
};

/// Computes the commanded height of the drive's halt once the trigger's force is reached on the way
/// down. The converter's interval and filter and the stop's latency are added. REQUIRES valid
/// traits and motion.
[[nodiscard]] double HaltZ(const CellTraits& traits, const TapMotion& motion, double surface_z_mm,
                           Random& random);

/// Faults of samples after the converter.
class SampleCorruptor {
 public:
  /// @param first_time_s  what the faults' times are counted from.
  SampleCorruptor(const CellTraits& traits, double first_time_s, Random random);
  /// Changes a sample; false if it is lost. Called for each, in order.
  [[nodiscard]] bool Pass(CellSample& sample);

 private:
  void Hold(CellSample& sample);
  void Stamp(CellSample& sample);

  CellTraits traits_;
  double first_time_s_;
  Random random_;
  bool has_last_ = false;
  CellSample last_;
  Random stamps_;  ///< and holds
  double hold_phase_ = 0;
};

struct TapScene {
  TapMotion motion;
  double press_mm = 0.045;    ///< depth at the halt; 0: as the trigger and its latency bring it
  double surface_z_mm = 0;    ///< bed height
  double start_time_s = 100;  ///< start of the approach
  double lead_s = 0.15;       ///< recorded before the nozzle meets the bed
  double tail_s = 0.32;       ///< and after the pull-back
};

struct SimulatedTap {
  std::vector<double> time_s;
  std::vector<double> force_g;
  std::vector<ZMove> moves;
  /// Absent if the pull-back is too short for the nozzle to release.
  std::optional<PressTruth> truth;
  double latency_s = 0;  ///< converter's latency
};

/// Simulates one tap. REQUIRES valid traits and motion, press_mm >= 0.
[[nodiscard]] SimulatedTap SimulateTap(const CellTraits& traits, const TapScene& scene,
                                       Random& random);

}  // namespace trammel::sim
