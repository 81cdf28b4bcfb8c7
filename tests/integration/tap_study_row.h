// One row of the tap study: a kind of virtual tap, drawn anew from each seed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/cell/simulated_tap.h"
#include "tap/samples/tap.h"

namespace trammel {

inline constexpr double kUmPerMm = 1e3;

/// Reported figures have seeds from here on; nothing may be tuned on them.
inline constexpr std::uint64_t kReportedTapSeed = 500'000;

enum class Demand {
  kExact,      ///< bias of at most 0.30 um; a law that the contact method models
  kOther,      ///< bias within the interval; a law or a rate that it does not
  kDisturbed,  ///< besides, more than white noise acts: such taps may be refused
};

struct TapRow {
  std::string name;
  Demand demand = Demand::kOther;
  sim::CellTraits cell;
  sim::TapScene scene;
  /// Draws cell and scene of each tap from its seed; null where all taps have the row's.
  void (*draw)(TapRow& row, Random& random) = nullptr;
  double worst_um = 1e9;      ///< every tap, with none refused
  bool lets_go = true;        ///< within the pull-back
  double within_um = 1e9;     ///< 99 % of all taps
  bool latency_known = true;  ///< the analysis is told the converter's latency
};

/// A whole number from the environment.
[[nodiscard]] std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise);

/// A row of a named cell (sim/cell/cell_traits.h).
[[nodiscard]] TapRow NamedRow(const char* name, Demand demand, const char* cell);

/// Taps once, with a bed height and a start drawn from the seed. Where the row draws, `row` holds
/// the tap's own cell and scene afterwards.
[[nodiscard]] sim::SimulatedTap SimulateRow(TapRow& row, std::uint64_t seed);

[[nodiscard]] std::vector<tap::Move> MovesOf(const sim::SimulatedTap& simulated);

}  // namespace trammel
