#include "tool_offset/sheet/sheet_settings.h"

#include <array>

namespace trammel::tool_offset {
namespace {

using S = SheetSettings;
constexpr std::string_view kIn = kSheetSection;

constexpr auto kFields = std::to_array<SheetField>({
    {kIn, "tools", &S::tools, "", 0, 31,
     "Numbers of the tools as the firmware has them: 2 to 8, the reference among them. To check "
     "one "
     "tool again, name it and the reference."},
    {kIn, "reference_tool", &S::reference_tool, "", 0, 31,
     "The tool that all offsets are against, one of the tools."},
    {kIn, "controls", &S::controls, "", 2, 8,
     "Structures per axis of the reference tool against itself, an even number: they show what the "
     "method itself adds."},
    {kIn, "pick_ups", &S::pick_ups, "", 0, 4,
     "Times that each tool is put back and picked up again, to see how well it comes back."},
    {kIn, "self_test", &S::self_test, "", 0, 0,
     "One tool draws structures with known offsets, to see how well they are read."},
    {kIn, "for_photo", &S::for_photo, "", 0, 0,
     "Arranges the sheet for a photo by a phone: what belongs to one tool at opposite places. It "
     "takes more paper; a scanner reads it, too."},
    {kIn, "pitch", &S::pitch_mm, "mm", 2, 10,
     "From finger to finger. Should not be a whole number of motor cycles, turned by the tilt."},
    {kIn, "teeth", &S::teeth, "", 5, 60,
     "Fingers of a comb, at most: fewer, down to 9, where the sheet would not fit the paper."},
    {kIn, "leg_spacing", &S::leg_spacing_mm, "mm", 0.3, 3,
     "Between the two legs of a finger, and between the lines of the box."},
    {kIn, "leg_length", &S::leg_length_mm, "mm", 3, 20, "Length of a leg."},
    {kIn, "overlap", &S::overlap_mm, "mm", 1, 19,
     "Where the fingers of both combs stand side by side, in the middle of a structure."},
    {kIn, "structure_gap", &S::structure_gap_mm, "mm", 2, 20,
     "White between structures, and to the box."},
    {kIn, "tilt", &S::tilt_deg, "°", -40, 40,
     "How far the sheet is turned, counter-clockwise, at least 5 either way: both motors then move "
     "along every leg."},
    {kIn, "line_width", &S::line_width_mm, "mm", 0.1, 1.5, "Width of a line."},
    {kIn, "layer_height", &S::layer_height_mm, "mm", 0.02, 1,
     "Height of the nozzle above the paper."},
    {kIn, "paper_thickness", &S::paper_thickness_mm, "mm", 0, 1,
     "Added to the height: 0.1 for office paper, 0 where the bed was probed with the paper on it."},
    {kIn, "print_speed", &S::print_speed_mm_s, "mm/s", 1, 200, "Speed of all lines."},
    {kIn, "acceleration", &S::acceleration_mm_s2, "mm/s²", 100, 50000,
     "Acceleration of all moves of the sheet."},
    {kIn, "run_in", &S::run_in_mm, "mm", 1, 10,
     "Travel before each leg in the leg's own direction, so that the play of both axes is taken up "
     "before it begins."},
    {kIn, "nozzle_temperatures", &S::nozzle_temperatures_c, "°C", 150, 500,
     "One for each tool, in their order. Empty: nozzle_temperature of [filament] for all."},
    {kIn, "retract_lengths", &S::retract_lengths_mm, "mm", 0, 20,
     "One for each tool, in their order. Empty: retract_length of [printer] for all."},
    {kIn, "flows", &S::flows, "", 0.5, 2,
     "Factor on the filament, one for each tool, in their order. Empty: 1 for all."},
    {kIn, "prime_length", &S::prime_length_mm, "mm", 0, 50,
     "Filament pushed out before a tool draws its prime line outside the box."},
    {kIn, "tool_change_gcode", &S::tool_change_gcode, "", 0, 0,
     "Picks up {tool}. Klipper without T macros: ACTIVATE_EXTRUDER EXTRUDER={extruder}; IDEX: "
     "SET_DUAL_CARRIAGE CARRIAGE={tool} before it."},
    {kIn, "prime_gcode", &S::prime_gcode, "", 0, 0,
     "Your own wiping or priming, after a tool was picked up and is hot."},
    {kIn, "wipe_gcode", &S::wipe_gcode, "", 0, 0, "Your own wiping, before a tool is put back."},
    {kIn, "paper", &S::paper, "", 0, 0,
     "What is printed on: A5, A4, letter, A3, A2, or any for paper that takes whatever fits the "
     "bed."},
    {kIn, "position_x", &S::position_x_mm, "mm", -2000, 2000,
     "X of the middle of the box. Left out: everything is centred on the bed."},
    {kIn, "position_y", &S::position_y_mm, "mm", -2000, 2000,
     "Y of the middle of the box. Left out: everything is centred on the bed."},
    {kIn, "start_gcode", &S::start_gcode, "", 0, 0,
     "Homes and levels before the paper comes, instead of start_gcode of [printer], which heats. "
     "Whatever it heats is switched off again and has cooled before the paper comes."},
    {kIn, "paper_clearance", &S::paper_clearance_mm, "mm", 10, 300,
     "Height of the nozzle above the bed while the paper is taped."},
    {kIn, "pause", &S::pause, "", 0, 0,
     "Wait for the paper to be taped down, once everything is homed and cold. false: it lies there "
     "before the print is started."},
    {kIn, "pause_gcode", &S::pause_gcode, "", 0, 0,
     "How to wait. Empty: PAUSE (Klipper), M0 (Marlin), M291 (RepRapFirmware)."},
    {kIn, "bed_temperature", &S::bed_temperature_c, "°C", 0, kWarmestPaper_c,
     "Temperature of the bed under the paper; 0: it stays off. Left out: the filament's, at most "
     "60."},
});

}  // namespace

std::span<const SheetField> SheetFields() { return kFields; }

}  // namespace trammel::tool_offset
