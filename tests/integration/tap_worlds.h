// The worlds of the tap study: virtual cells, beds, drives and faults, each from a seed.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sim/cell/load_cell.h"

namespace trammel {

/// Guarantee of the contact method for a world's taps.
enum class Promise {
  kUnbiased,   ///< read, without bias: a press that the method models, and white noise
  kCovered,    ///< read, with the bias within the interval
  kMayRefuse,  ///< the same, but taps may be refused
  kHidden,     ///< a soft toe that noise hides: the answer lies between the touch and the bed's own
  kRefused,    ///< 95 % of the taps are refused
};

/// A kind of tap; 320 samples/s, 2 gf, 3500 gf/mm and 45 um of press unless changed.
struct TapWorld {
  std::string name;
  Promise promise = Promise::kCovered;
  sim::CellTraits cell;
  sim::TapScene scene;
  /// Draws cell and scene of each tap from its seed; null where all taps have the world's.
  void (*draw)(TapWorld& world, Random& random) = nullptr;
  /// 99 % of the answers are within it.
  double within_um = std::numeric_limits<double>::infinity();
  bool latency_known = true;  ///< The analysis is given the converter's latency.
};

/// Worlds that vary one thing: a group of the study.
struct TapWorlds {
  std::string group;
  std::vector<TapWorld> worlds;
};
[[nodiscard]] std::vector<TapWorlds> AllTapWorlds();

/// Taps once, with a bed height and a start drawn from the seed. Where the world draws, `world`
/// holds the tap's own cell and scene afterwards.
[[nodiscard]] sim::SimulatedTap SimulateTapOf(TapWorld& world, std::uint64_t seed);

}  // namespace trammel
