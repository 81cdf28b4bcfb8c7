// The printer's bed, drawn.
#pragma once

#include <string>

#include "document/plot.h"
#include "settings/printer.h"

namespace trammel::report {

inline constexpr Color kPlate = Rgb(0xf3f5f7);

/// A plot in the middle of `room`, the same scale on both axes.
[[nodiscard]] Plot EvenPlot(Canvas& canvas, const RectPx& room, const Axis& x, const Axis& y,
                            const std::string& title);

/// The whole bed in its own coordinates, with its outline.
[[nodiscard]] Plot BedPlot(Canvas& canvas, const RectPx& room,
                           const settings::PrinterSettings& printer);

/// What a print is heated to as G-code says it, in letters that a picture can have: "PLA: nozzle
/// 215, bed 60 °C" for "pla: nozzle 215, bed 60 degC".
[[nodiscard]] std::string SpelledOut(std::string temperatures);

}  // namespace trammel::report
