// Plans as the tests ask for them.
#pragma once

#include <algorithm>
#include <string>

#include "base/check.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// The default sheet of tools 0 … count - 1.
inline SheetSettings WithTools(int count) {
  SheetSettings settings;
  settings.tools.clear();
  for (int tool = 0; tool < count; ++tool) settings.tools.push_back(tool);
  return settings;
}

/// The structure of that name. REQUIRES that there is one.
inline const Structure& Named(const SheetPlan& plan, const std::string& name) {
  const auto found = std::find_if(plan.structures.begin(), plan.structures.end(),
                                  [&](const Structure& s) { return s.name == name; });
  TRAMMEL_CHECK(found != plan.structures.end(), "no structure {}", name);
  return *found;
}

}  // namespace trammel::tool_offset
