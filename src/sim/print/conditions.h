// The twelve conditions under which the paper scanned: plate, filament and light.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

enum class Plate {
  kMatte,     ///< smooth and black
  kTextured,  ///< black with bumps that glint
  kPei,       ///< translucent: the laser spreads below its surface
};

enum class Filament { kBlack, kWhite };

struct Condition {
  Plate plate = Plate::kMatte;
  Filament filament = Filament::kBlack;
  bool ambient = false;  ///< room light on
};

/// All of them, in the order of the paper's table: plates, then filaments, ambient before dark.
[[nodiscard]] std::array<Condition, 12> AllConditions();

/// PLATE-FILAMENT-LIGHT, for example "matte-black-dark".
[[nodiscard]] std::string ToString(const Condition& condition);

/// The inverse of ToString. Error (kInput): another name; the message lists what exists.
[[nodiscard]] Result<Condition> ParseCondition(std::string_view name);

}  // namespace trammel::sim
