// Shift of the machine's position by stored tool offsets, for each firmware.
#pragma once

#include <array>

#include "sim/sheet/sheet_gcode.h"

namespace trammel::sim {

/// Selected tool and all offsets of the firmware. The machine's position is the commanded one, plus
/// G92's origin, plus shift(). Axes: 0 x, 1 y, 2 z.
class SheetToolOffsets {
 public:
  using Shift = std::array<double, 3>;  ///< mm

  explicit SheetToolOffsets(const SheetSetup& setup);

  [[nodiscard]] const Shift& shift() const { return shift_; }

  /// Changes the tool. @param by_changer  by T or SELECT_TOOL: Klipper's toolchanger extension then
  /// sets SET_GCODE_OFFSET's x and y to the stored offset, unless that tool is already selected.
  void Select(int tool, bool by_changer);
  /// Stores an offset in the firmware's own sign.
  void Store(int tool, int axis, double offset_mm);
  /// Klipper's SET_GCODE_OFFSET.
  void SetGcodeOffset(int axis, double offset_mm);
  void AdjustGcodeOffset(int axis, double by_mm);
  /// Klipper's RESTORE_GCODE_STATE.
  void RestoreGcodeOffset(const Shift& shift) { shift_ = shift; }
  /// Resets the position to the firmware's tables, as homing does in every firmware.
  void Home();

 private:
  [[nodiscard]] double StoredOf(int tool, std::size_t axis) const;

  SheetFirmware firmware_;
  bool has_changer_ = false;
  int tool_ = 0;
  std::array<Shift, kMaxSheetTools> stored_{};
  Shift shift_{};
};

}  // namespace trammel::sim
