// Single solid of a STEP file, as an Open CASCADE object.
#pragma once

#include <TopoDS_Shape.hxx>
#include <gp_Pnt.hxx>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

struct CadSolid {
  TopoDS_Shape solid;  ///< mm
  std::string unit;
  std::vector<std::string> notices;
};

[[nodiscard]] std::string PlaceText(const gp_Pnt& at_mm);

/// Errors (kInput): those of ReadStepFile about the content, without the file's name.
[[nodiscard]] Result<CadSolid> SolidOf(std::string_view text);

}  // namespace trammel::machine
