// Points, directions and sigmas as files have them: three numbers in a list.
#pragma once

#include <Eigen/Core>

#include "files/json_object.h"

namespace trammel::files {

/// Three numbers under a key; zeros after a fault, which is kept in `object`.
[[nodiscard]] inline Eigen::Vector3d ReadThree(JsonObject& object, const char* key,
                                               NumberRange range) {
  const auto numbers = object.Numbers(key, 3, 3, range);
  if (numbers.size() != 3) return Eigen::Vector3d::Zero();
  return {numbers[0], numbers[1], numbers[2]};
}

}  // namespace trammel::files
