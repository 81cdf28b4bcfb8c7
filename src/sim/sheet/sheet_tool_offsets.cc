#include "sim/sheet/sheet_tool_offsets.h"

namespace trammel::sim {

SheetToolOffsets::SheetToolOffsets(const SheetSetup& setup) : firmware_(setup.firmware) {
  for (std::size_t tool = 0; tool < stored_.size(); ++tool) {
    if (!setup.stored[tool]) continue;
    stored_[tool] = {setup.stored[tool]->x_mm, setup.stored[tool]->y_mm, 0};
    has_changer_ = true;
  }
  if (firmware_ == SheetFirmware::kKlipper) {
    if (has_changer_) shift_ = stored_[0];
  } else {
    Home();
  }
}

double SheetToolOffsets::StoredOf(int tool, std::size_t axis) const {
  return stored_[static_cast<std::size_t>(tool)][axis];
}

void SheetToolOffsets::Select(int tool, bool by_changer) {
  const int last = tool_;
  tool_ = tool;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    switch (firmware_) {
      case SheetFirmware::kKlipper:
        if (by_changer && has_changer_ && tool != last && axis < 2) {
          shift_[axis] = StoredOf(tool, axis);
        }
        break;
      case SheetFirmware::kMarlin:  // moves by the difference of the tables as they are now
        shift_[axis] -= StoredOf(tool, axis) - StoredOf(last, axis);
        break;
      case SheetFirmware::kRepRapFirmware:
        shift_[axis] = -StoredOf(tool, axis);
        break;
    }
  }
}

void SheetToolOffsets::Store(int tool, int axis, double offset_mm) {
  const auto index = static_cast<std::size_t>(axis);
  stored_[static_cast<std::size_t>(tool)][index] = offset_mm;
  has_changer_ = true;
  if (firmware_ == SheetFirmware::kRepRapFirmware && tool == tool_) shift_[index] = -offset_mm;
}

void SheetToolOffsets::SetGcodeOffset(int axis, double offset_mm) {
  shift_[static_cast<std::size_t>(axis)] = offset_mm;
}

void SheetToolOffsets::AdjustGcodeOffset(int axis, double by_mm) {
  shift_[static_cast<std::size_t>(axis)] += by_mm;
}

void SheetToolOffsets::Home() {
  if (firmware_ == SheetFirmware::kKlipper) return;  // keeps SET_GCODE_OFFSET
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double zero = firmware_ == SheetFirmware::kMarlin ? StoredOf(0, axis) : 0;
    shift_[axis] = zero - StoredOf(tool_, axis);
  }
}

}  // namespace trammel::sim
