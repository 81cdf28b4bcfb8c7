// Simulates one extruder step by step: the drive, elastic storages, and the melt in the nozzle.
#pragma once

#include <vector>

namespace trammel::test {

/// Describes a storage upstream of the nozzle chamber, such as the filament in its tube.
struct MeltStage {
  double share = 0;     ///< share of storage, as difference between both speeds
  double drop = 0;      ///< pressure lost behind it at the fast flow, over the nozzle's
  double friction = 0;  ///< Coulomb friction behind it, over the nozzle's pressure at the fast flow
};

/// Describes a Kelvin element: a share of the first storage that follows the pressure with a delay.
struct CreepPart {
  double share = 0;
  double time_s = 0;
};

/// Describes the physics of one extruder. Flows are mm of nominal line per s, pressures are over
/// the nozzle's pressure at the steady fast flow.
struct MeltPhysics {
  double lag_s = 0.03;            ///< storage's difference over the flow's; 0: a rigid extruder
  double exponent = 1;            ///< pressure ~ flow^exponent
  double yield = 0;               ///< pressure below which nothing flows
  std::vector<MeltStage> stages;  ///< drive to nozzle
  std::vector<CreepPart> creep;   ///< of the storage next to the drive; sum of shares < 1
  double structure = 0;           ///< viscosity that rest adds (thixotropy), relative
  double structure_time_s = 0.1;  ///< growth at rest
  double structure_shear = 4;     ///< ratio of breakdown at the fast flow to growth
  double cooling = 0;             ///< viscosity that the fast flow adds as it cools the melt
  double cooling_time_s = 0.3;
  double asymmetry = 0;            ///< viscosity while the flow rises less that while it falls
  double asymmetry_time_s = 0.03;  ///< memory of the flow's change
  double backlash_mm = 0;          ///< drive's, mm of line
  double slip = 0;                 ///< share of the drive lost at the fast flow; ~ pressure^2
};

/// Returns the creep with which a linear extruder lags by the Mittag-Leffler function of an order
/// below 1 instead of the exponential: compliance ~ time^(1 - order), from 1.5 ms to 0.3 s. What is
/// faster is prompt.
[[nodiscard]] std::vector<CreepPart> FractionalCreep(double order);

/// Adds creep to a physics; what creeps there already keeps its part of the rest.
void AddCreep(MeltPhysics& physics, const std::vector<CreepPart>& parts);

/// Steady state of an extruder.
struct MeltSteady {
  double flow_mm_s = 0;
  double slip = 0;       ///< share of the drive
  double stored_mm = 0;  ///< filament
};

class MeltExtruder {
 public:
  MeltExtruder(const MeltPhysics& physics, double slow_mm_s, double fast_mm_s);

  /// Sets what a line differs by from the mean one, as factors.
  void SetLine(double compliance, double viscosity);
  /// Drives filament for a time step.
  /// @returns filament that leaves the nozzle, mm of line
  double Step(double driven_mm, double step_s);
  /// Computes the steady state of the mean line at a constant drive.
  [[nodiscard]] MeltSteady Steady(double drive_mm_s) const;

  [[nodiscard]] double Flow_mm_s() const { return flow_mm_s_; }
  /// Filament between drive and nozzle, the play of the drive included.
  [[nodiscard]] double Stored_mm() const;
  [[nodiscard]] double Slipped_mm() const { return slipped_mm_; }

 private:
  [[nodiscard]] double SteadyViscosity(double flow_mm_s) const;
  [[nodiscard]] double NozzlePressure(double flow_mm_s, double viscosity) const;
  [[nodiscard]] double NozzleFlow(double pressure, double viscosity) const;
  [[nodiscard]] std::vector<double> SteadyPressures(double flow_mm_s) const;
  [[nodiscard]] double SlipAt(double pressure) const;
  [[nodiscard]] double Pressure(std::size_t node) const;
  double ThroughBacklash(double driven_mm);
  void MoveBetweenStages(double step_s);
  void Creep(double step_s);
  void FollowFlow(double step_s);

  MeltPhysics physics_;
  double fast_mm_s_;
  double settled_viscosity_ = 1;       ///< at the steady fast flow, before scaling to 1
  double drive_pressure_ = 1;          ///< at the steady fast flow
  double prompt_ = 1;                  ///< share of the first storage that does not creep
  std::vector<double> compliance_mm_;  ///< mean line, per storage, the nozzle's last
  double line_compliance_ = 1, line_viscosity_ = 1;

  std::vector<double> stored_mm_, crept_mm_;  ///< a nozzle's below 0: a void to be filled again
  double flow_mm_s_ = 0, usual_flow_mm_s_ = 0;
  double structure_ = 1, cold_ = 0;
  double backlash_mm_ = 0, slipped_mm_ = 0;
};

}  // namespace trammel::test
