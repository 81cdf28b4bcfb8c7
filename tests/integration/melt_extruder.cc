#include "melt_extruder.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/square.h"

namespace trammel::test {

std::vector<CreepPart> FractionalCreep(double order) {
  constexpr double kShortest_s = 0.0015, kLongest_s = 0.3;
  constexpr int kParts = 11;  // a factor of 1.6 apart: less than a Kelvin element's own width
  std::vector<CreepPart> parts;
  const auto compliance = [&](double part) {  // up to a part of the range, over the longest one's
    return std::pow(kShortest_s / kLongest_s, (1 - order) * (1 - part / kParts));
  };
  for (int i = 0; i < kParts; ++i) {
    parts.push_back({compliance(i + 1) - compliance(i),
                     kShortest_s * std::pow(kLongest_s / kShortest_s, (i + 0.5) / kParts)});
  }
  return parts;
}

void AddCreep(MeltPhysics& physics, const std::vector<CreepPart>& parts) {
  double share = 0;
  for (const CreepPart& part : parts) share += part.share;
  for (CreepPart& part : physics.creep) part.share *= 1 - share;
  physics.creep.insert(physics.creep.end(), parts.begin(), parts.end());
}

MeltExtruder::MeltExtruder(const MeltPhysics& physics, double slow_mm_s, double fast_mm_s)
    : physics_(physics), fast_mm_s_(fast_mm_s) {
  TRAMMEL_CHECK(0 < slow_mm_s && slow_mm_s < fast_mm_s && physics.lag_s >= 0 && physics.yield < 1,
                "slow = {}, fast = {}, lag = {}, yield = {}", slow_mm_s, fast_mm_s, physics.lag_s,
                physics.yield);
  settled_viscosity_ = SteadyViscosity(fast_mm_s);
  double nozzle_share = 1;
  for (const MeltStage& stage : physics.stages) nozzle_share -= stage.share;
  for (const CreepPart& part : physics.creep) prompt_ -= part.share;
  TRAMMEL_CHECK(nozzle_share > 0 && prompt_ > 0, "nozzle = {}, prompt = {}", nozzle_share, prompt_);
  const std::vector<double> slow = SteadyPressures(slow_mm_s), fast = SteadyPressures(fast_mm_s);
  drive_pressure_ = fast.front();
  for (std::size_t i = 0; i < fast.size(); ++i) {
    const double share = i < physics.stages.size() ? physics.stages[i].share : nozzle_share;
    compliance_mm_.push_back(share * physics.lag_s * (fast_mm_s - slow_mm_s) / (fast[i] - slow[i]));
  }
  stored_mm_.resize(fast.size());
  crept_mm_.resize(physics.creep.size());
}

void MeltExtruder::SetLine(double compliance, double viscosity) {
  line_compliance_ = compliance;
  line_viscosity_ = viscosity;
}

double MeltExtruder::SteadyViscosity(double flow_mm_s) const {
  const double share = flow_mm_s / fast_mm_s_;
  return (1 + physics_.structure / (1 + physics_.structure_shear * share)) *
         (1 + physics_.cooling * share) / settled_viscosity_;
}

double MeltExtruder::NozzlePressure(double flow_mm_s, double viscosity) const {
  return viscosity * (physics_.yield +
                      (1 - physics_.yield) * std::pow(flow_mm_s / fast_mm_s_, physics_.exponent));
}

double MeltExtruder::NozzleFlow(double pressure, double viscosity) const {
  const double beyond = pressure / viscosity - physics_.yield;
  if (beyond <= 0) return 0;
  return fast_mm_s_ * std::pow(beyond / (1 - physics_.yield), 1 / physics_.exponent);
}

std::vector<double> MeltExtruder::SteadyPressures(double flow_mm_s) const {
  std::vector<double> pressures(physics_.stages.size() + 1);
  pressures.back() = NozzlePressure(flow_mm_s, SteadyViscosity(flow_mm_s));
  for (std::size_t i = physics_.stages.size(); i-- > 0;) {
    const MeltStage& stage = physics_.stages[i];
    pressures[i] = pressures[i + 1] + stage.drop * flow_mm_s / fast_mm_s_ + stage.friction;
  }
  return pressures;
}

double MeltExtruder::SlipAt(double pressure) const {
  return std::min(0.9, physics_.slip * Square(std::max(0.0, pressure) / drive_pressure_));
}

MeltSteady MeltExtruder::Steady(double drive_mm_s) const {
  // The loss grows with the remaining flow: bisect the interval of the latter.
  double lo = 0, hi = drive_mm_s;
  for (int i = 0; physics_.slip > 0 && i < 50; ++i) {
    const double flow = (lo + hi) / 2;
    const bool too_much = flow > drive_mm_s * (1 - SlipAt(SteadyPressures(flow).front()));
    (too_much ? hi : lo) = flow;
  }
  const std::vector<double> pressures = SteadyPressures(hi);
  MeltSteady steady{hi, 1 - hi / drive_mm_s, 0};
  for (std::size_t i = 0; i < pressures.size(); ++i) {
    steady.stored_mm += compliance_mm_[i] * pressures[i];
  }
  return steady;
}

double MeltExtruder::Stored_mm() const {
  double sum = -backlash_mm_;
  for (const double stored : stored_mm_) sum += stored;
  for (const double crept : crept_mm_) sum += crept;
  return sum;
}

double MeltExtruder::Pressure(std::size_t node) const {
  const double stored = node + 1 == stored_mm_.size() ? std::max(0.0, stored_mm_[node])  // a void
                                                      : stored_mm_[node];
  return stored / (compliance_mm_[node] * line_compliance_ * (node == 0 ? prompt_ : 1));
}

double MeltExtruder::ThroughBacklash(double driven_mm) {
  const double taken = driven_mm > 0 ? std::min(driven_mm, backlash_mm_)
                                     : std::max(driven_mm, backlash_mm_ - physics_.backlash_mm);
  backlash_mm_ -= taken;
  return driven_mm - taken;
}

void MeltExtruder::MoveBetweenStages(double step_s) {
  for (std::size_t i = 0; i < physics_.stages.size(); ++i) {
    const MeltStage& stage = physics_.stages[i];
    const double difference = Pressure(i) - Pressure(i + 1);
    const double beyond = std::abs(difference) - stage.friction;
    if (beyond <= 0) continue;
    const double moved = std::copysign(beyond, difference) * fast_mm_s_ / stage.drop * step_s;
    stored_mm_[i] -= moved;
    stored_mm_[i + 1] += moved;
  }
}

void MeltExtruder::Creep(double step_s) {
  const double pressure = Pressure(0);
  for (std::size_t j = 0; j < crept_mm_.size(); ++j) {
    const CreepPart& part = physics_.creep[j];
    const double settled_mm = part.share * compliance_mm_[0] * line_compliance_ * pressure;
    const double moved = (settled_mm - crept_mm_[j]) * step_s / part.time_s;
    crept_mm_[j] += moved;
    stored_mm_[0] -= moved;
  }
}

void MeltExtruder::FollowFlow(double step_s) {
  const double share = flow_mm_s_ / fast_mm_s_;
  structure_ += (1 - structure_ * (1 + physics_.structure_shear * share)) * step_s /
                physics_.structure_time_s;
  cold_ += (share - cold_) * step_s / physics_.cooling_time_s;
  usual_flow_mm_s_ += (flow_mm_s_ - usual_flow_mm_s_) * step_s / physics_.asymmetry_time_s;
}

double MeltExtruder::Step(double driven_mm, double step_s) {
  double pushed_mm = ThroughBacklash(driven_mm);
  if (physics_.lag_s == 0) {
    flow_mm_s_ = pushed_mm / step_s;
    return pushed_mm;
  }
  if (pushed_mm > 0) {
    const double lost = pushed_mm * SlipAt(Pressure(0));
    slipped_mm_ += lost;
    pushed_mm -= lost;
  }
  stored_mm_[0] += pushed_mm;
  MoveBetweenStages(step_s);
  Creep(step_s);
  const double rising = std::tanh((flow_mm_s_ - usual_flow_mm_s_) / (0.2 * fast_mm_s_));
  const double viscosity = line_viscosity_ * (1 + physics_.structure * structure_) *
                           (1 + physics_.cooling * cold_) / settled_viscosity_ *
                           (1 + physics_.asymmetry / 2 * rising);
  const double pressure = Pressure(stored_mm_.size() - 1);
  const double left_mm =
      std::min(NozzleFlow(pressure, viscosity) * step_s, std::max(0.0, stored_mm_.back()));
  stored_mm_.back() -= left_mm;
  flow_mm_s_ = left_mm / step_s;
  FollowFlow(step_s);
  return left_mm;
}

}  // namespace trammel::test
