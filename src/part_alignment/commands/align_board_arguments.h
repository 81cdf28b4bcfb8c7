// What trammel align board is told: its options, and what they mean of board, machine and camera.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc_limits.h"
#include "part_alignment/commands/linuxcnc_options.h"
#include "part_alignment/commands/machine_boxes.h"
#include "part_alignment/files/board_file.h"
#include "part_alignment/procedure/board_drive.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct BoardCommandArguments {
  std::string folder;
  std::string source;
  std::string sheet;
  std::string picture_size;
  double pixel_pitch_mm = 0;
  double lens_focal_length_mm = 0;
  std::vector<std::string> touches;
  double tool_length_sigma_mm = 0.010;
  std::vector<double> place_mm;
  std::vector<double> place_sigma_mm;
  std::vector<double> safe_z_mm;  ///< one number, or none
  double turn_deg_min = 1200;
  std::vector<std::string> yes;
  MachineBoxArguments boxes;
  procedure::BoardDriveOptions drive;
  LinuxCncArguments linuxcnc;
  bool json = false;
};

/// Of camera, board, places, and what no picture tells.
void AddBoardOptions(CLI::App& command, BoardCommandArguments& arguments);

/// What is told of board and camera, without views.
/// Errors (kInput): the sheet's file; a touch of no mark or of another form; a sigma that is none.
[[nodiscard]] Result<files::BoardFile> BoardOf(const BoardCommandArguments& arguments);

/// The safe height, obstacles, and the travel that was given within what the controller tells.
/// Errors: kSafety for an axis of which neither tells the limits; kInput for obstacles that are
/// none.
[[nodiscard]] Result<void> FillRoute(const BoardCommandArguments& arguments,
                                     const machine::LinuxCncTravel& told,
                                     procedure::RouteOptions& route);

/// Notices of what was left out, on standard error.
void TellWhatIsMissing(const BoardCommandArguments& arguments,
                       const part_alignment::BoardMeasurement& board);

}  // namespace trammel::app
