// The virtual load cell: the force on a nozzle as its converter reads it, sample by sample.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "base/random.h"
#include "sim/cell/cell_dynamics.h"
#include "sim/cell/cell_traits.h"

namespace trammel::sim {

/// A blob of plastic is a dome, soft at first: its force grows with this power of how far it is
/// squeezed, until it is flat.
inline constexpr double kBlobShape = 1.5;

/// What moves the nozzle at one moment.
struct NozzleState {
  double z_mm = 0;           ///< as the drive was told
  double velocity_mm_s = 0;  ///< signed
  double surface_z_mm = 0;   ///< where the bed below is first touched
};

/// From time to the nozzle; asked in order of time.
using NozzleAt = std::function<NozzleState(double time_s)>;

/// One press as it really was. Heights are those the drive was told, as that is what a client
/// knows.
struct PressTruth {
  double touch_time_s = 0;    ///< the nozzle met the bed
  double touch_z_mm = 0;      ///< below the height of letting go by what the drive has of play
  double contact_time_s = 0;  ///< the bed's force on it came to 0: it let go
  double contact_z_mm = 0;
  double snap_time_s = 0;  ///< where it stuck: it came free; else the same as contact
  double snap_z_mm = 0;
  double peak_force_g = 0;
};

/// A sample as the converter hands it over.
struct CellSample {
  double time_s = 0;
  double force_g = 0;  ///< counts over the scale, nothing tared
  long long counts = 0;
  bool saturated = false;
};

/// Physics and converter in one, advanced from sample to sample. What the nozzle meets depends on
/// its whole path: play, creep, plastic.
class LoadCell {
 public:
  /// REQUIRES Validate(traits). The first sample comes within one sampling interval of start_s.
  LoadCell(const CellTraits& traits, double start_s, Random random);

  /// When the next sample will be there.
  [[nodiscard]] double next_time_s() const {
    return next_s_ + std::max(0.0, traits_.converter.latency_s);
  }
  /// Advances to that time. Faults of the samples are left to SampleCorruptor.
  [[nodiscard]] CellSample Next(const NozzleAt& nozzle);
  /// By how much its readings are behind the force.
  [[nodiscard]] double latency_s() const;
  /// Presses that have ended, oldest first; emptied.
  [[nodiscard]] std::vector<PressTruth> TakePresses();

 private:
  struct Fine {
    double time_s = 0;
    double drive_z_mm = 0;
    double depth_mm = 0;   ///< of the nozzle below first touch
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
  double first_s_;  ///< of the samples
  double next_s_;
  long long samples_ = 0;
  bool begun_ = false;
  Fine last_;
  double speed_mm_s_ = 0;
  double nozzle_z_mm_ = 0;
  double dent_g_ = 0;  ///< what the viscous part of the bed has given way by, as a force
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
  double stopped_s_ = 0;     ///< when the head last came to rest at once …
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

/// Where the drive halts, as it was told, when the trigger's force is reached on the way down; the
/// converter's interval and filter and the stop's latency come on top. REQUIRES valid traits and
/// motion.
[[nodiscard]] double HaltZ(const CellTraits& traits, const TapMotion& motion, double surface_z_mm,
                           Random& random);

/// The faults of samples, on their way from the converter.
class SampleCorruptor {
 public:
  /// @param first_time_s  what the faults' times are counted from.
  SampleCorruptor(const CellTraits& traits, double first_time_s, Random random);
  /// Changes a sample; false where it gets lost. To be called for each, in order.
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

}  // namespace trammel::sim
