// Names the worlds that the melt study prints in.
#pragma once

#include <string>
#include <vector>

#include "melt_world.h"

namespace trammel::test {

struct MeltRow {
  std::string name;
  MeltWorld world;
};

/// Returns one mechanism after the other, each at two or three strengths, and at last ten printers
/// of three mechanisms drawn at random.
[[nodiscard]] std::vector<MeltRow> MeltRows(const MeltWorld& usual);

}  // namespace trammel::test
