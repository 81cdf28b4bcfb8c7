// How much filament a hot end holds compressed at a given flow: the cause of all lag.
#pragma once

#include <string_view>

namespace trammel::sim {

/// The shape of S(q), the filament stored (mm) at steady flow q (mm of filament per second).
enum class StorageKind {
  kLinear,      ///< S = c q: one time constant at every flow
  kPower,       ///< S = c q^n: shear thinning, the lag falls as the flow rises
  kTanh,        ///< S = c ((1 - a) q + a q0 tanh(q / q0)): part of the storage saturates
  kReciprocal,  ///< S = c ((1 - a) q + a q0 (1 - 1 / (1 + q / q0))): saturates more slowly
};

[[nodiscard]] std::string_view ToString(StorageKind kind);

struct StorageLaw {
  StorageKind kind = StorageKind::kLinear;
  double scale_s = 0.036;         ///< c: s (kPower: mm / (mm/s)^n); > 0
  double exponent = 1;            ///< n of kPower; 0.2 … 1
  double saturating_share = 0.5;  ///< a of the saturating laws; 0 … 0.95
  double knee_mm_s = 2;           ///< q0 of the saturating laws, filament mm/s; > 0
};

/// S(q) in mm of filament; odd in q.
[[nodiscard]] double Stored(const StorageLaw& law, double flow_mm_s);

/// A steady flow and its slope over the storage that drives it.
struct DrivenFlow {
  double flow_mm_s = 0;
  double slope_per_s = 0;  ///< dq/dS: the inverse of the local time constant
};

/// The inverse of Stored, odd in stored_mm. The saturating laws are solved to 1e-12 of the flow.
[[nodiscard]] DrivenFlow FlowFromStored(const StorageLaw& law, double stored_mm);

/// K* = (S(fast) - S(slow)) / (fast - slow): the pressure advance that stores just what the change
/// of flow needs. REQUIRES fast > slow >= 0, filament mm/s.
[[nodiscard]] double IdealPressureAdvance(const StorageLaw& law, double slow_mm_s,
                                          double fast_mm_s);

/// The law with its scale set so that IdealPressureAdvance is k_star_s. REQUIRES k_star_s > 0.
[[nodiscard]] StorageLaw ScaledTo(StorageLaw law, double k_star_s, double slow_mm_s,
                                  double fast_mm_s);

}  // namespace trammel::sim
