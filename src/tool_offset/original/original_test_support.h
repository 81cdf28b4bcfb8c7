// The published generator's G-code, written for tests from its published lengths: shares nothing
// with the plan that it is compared to.
#pragma once

#include <string>
#include <vector>

namespace trammel::tool_offset {

struct OriginalPrint {
  std::vector<int> tools = {1, 2, 3};
  int reference = 2;
  double rotation_deg = 15;
  std::vector<std::vector<double>> moved;  ///< of each tool, along the print's axes; empty: none
  double centre_x_mm = 100;
  double centre_y_mm = 100;
};

[[nodiscard]] std::string WriteOriginalGcode(const OriginalPrint& print);

}  // namespace trammel::tool_offset
