// Writes a part's pose in a control's syntax: the part that its work offset corrects, and the
// remainder.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "geometry/euler.h"

namespace trammel::part_alignment {

enum class Control { kLinuxCnc, kSiemens, kHeidenhain, kFanuc };

/// "linuxcnc", "siemens", "heidenhain", "fanuc"; absent for anything else.
[[nodiscard]] std::optional<Control> ParseControl(std::string_view name);
[[nodiscard]] std::string_view ToString(Control control);

/// Offset register of a control: its name on the machine and its number in the command.
struct OffsetSlot {
  std::string name;         ///< "G54", "G54.1 P7"; Heidenhain: the preset's row, "1"
  int number = 1;           ///< the P of G10, the index of $P_UIFR, the row
  bool additional = false;  ///< Fanuc's G54.1 Pn, set by L20
};

/// Parses a work offset's name. LinuxCNC: G54 … G59, G59.1 … G59.3. Siemens: G54 … G57, G505 …
/// G599. Fanuc: G54 … G59, "G54.1 P1" … "G54.1 P300". Heidenhain: a row of the preset table, 1 …
/// 9999. Errors (kInput) list the control's valid names.
[[nodiscard]] Result<OffsetSlot> ParseOffsetSlot(Control control, const std::string& name);

struct ControlText {
  std::vector<std::string> set;    ///< stores the offset
  std::vector<std::string> use;    ///< commands that a program needs to use it
  std::vector<std::string> notes;  ///< effects on the control, and its limitations
};

/// @param machine_from_part  all angles are written where `tilts`, else only that about Z.
/// @param tilts  Siemens and Heidenhain alone take rotations about X and Y. They place every point
///               right then, but the tool still comes along the machine's Z unless the machine
///               swivels it.
/// Lengths are written to 1e-6 mm, angles to 1e-9 degrees (2e-7 mm at 10 m).
/// Errors (kInput): numbers that are not finite, `tilts` for a control that takes none.
[[nodiscard]] Result<ControlText> TextFor(Control control, const OffsetSlot& slot,
                                          const geometry::Pose& machine_from_part, bool tilts);

}  // namespace trammel::part_alignment
