// The paper's twelve scan conditions: plate, filament and light.
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

/// Returns all conditions, in the order of the paper's table: plates, then filaments, ambient
/// before dark.
[[nodiscard]] std::array<Condition, 12> AllConditions();

/// Returns PLATE-FILAMENT-LIGHT, for example "matte-black-dark".
[[nodiscard]] std::string ToString(const Condition& condition);

/// Inverts ToString. Error (kInput): an unknown name; the message lists the known ones.
[[nodiscard]] Result<Condition> ParseCondition(std::string_view name);

}  // namespace trammel::sim
