// What the structure, the plastic and the cell itself add to the bed's force over time.
#pragma once

#include <vector>

#include "base/random.h"
#include "sim/cell/cell_traits.h"

namespace trammel::sim {

/// A damped resonance of the structure, advanced exactly for a drive that is constant in between.
class StructureMode {
 public:
  /// Advances by dt_s. @returns what ringing adds to the reading, gf: the mode's force less the
  /// share of the bed's force that it carries at rest.
  /// @param acceleration_mm_s2  mean of the drive's since the last call.
  [[nodiscard]] double Advance(const DisturbanceTraits& traits, double bed_g,
                               double acceleration_mm_s2, double dt_s);

 private:
  bool begun_ = false;
  double force_g_ = 0;
  double rate_g_s_ = 0;
};

/// 1/f noise: sums processes that forget within times two octaves apart, all of one strength.
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

/// A strand of plastic between nozzle and bed.
class PlasticStrand {
 public:
  /// @returns its pull at a height above the bed, gf; touching the bed fastens a new one.
  [[nodiscard]] double Pull(const PressTraits& traits, double gap_mm);

 private:
  bool fast_ = false;
};

/// A filament or cable that slips as the nozzle rises, once after each press.
class Slip {
 public:
  /// Advances by dt_s. @returns what it adds to the reading, gf.
  [[nodiscard]] double Force(const DisturbanceTraits& traits, double gap_mm, double dt_s);

 private:
  bool armed_ = false;
  double slips_ = 0;
  double gone_ = 0;  ///< of the slips, how much has taken effect
};

/// The cell's own creep and hysteresis.
class CellMemory {
 public:
  /// Advances by dt_s. @returns the load as the cell shows it, gf.
  [[nodiscard]] double Advance(const ConverterTraits& traits, double load_g, double dt_s);

 private:
  bool begun_ = false;
  double slow_g_ = 0;  ///< what the creeping part shows
  double peak_g_ = 0;  ///< of the load since it was last none
};

}  // namespace trammel::sim
