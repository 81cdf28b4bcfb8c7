// Printed board on the machine's table, under the virtual spindle's camera.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/spindle/spindle_camera.h"
#include "sim/spindle/spindle_lens.h"
#include "sim/spindle/spindle_world.h"

namespace trammel::sim {

/// Nominal sheet: marks in columns and rows, numbered from 1 along the rows. Printer and paper
/// distort it.
struct BoardSheet {
  int columns = 11;      ///< 2 … 100
  int rows = 8;          ///< 2 … 100
  double pitch_mm = 24;  ///< between neighbours, 1 … 500
  /// Marks other than columns and rows: right and up from the sheet's centre, mm.
  std::vector<std::array<double, 2>> places_mm = {};
  /// Maximum relative error of the print's length along each axis of the paper.
  double print_scale = 2e-3;
  double print_error_mm = 0.03;  ///< per mark, 1 sigma per axis
  double bend_mm = 0.3;          ///< sagitta over the board's diagonal, in a direction of the seed
  double lean_rad = 3e-3;        ///< table top, uniform within +-this about X and Y
  double off_mm = 5;             ///< board centre from the machine's (X, Y) below
  Triple middle_mm = {600, 400, 0};
};

/// Standard deviations of the traits drawn by a machine's seed. Scale and squareness are about the
/// machine's zero, as in SpindleMachine.
struct BoardMachine {
  double scale = 20e-6;            ///< relative, each axis
  double square_rad = 20e-6;       ///< each of the three
  double lean_rad = 100e-6;        ///< spindle axis about X and Y
  double index_rad = 2e-3;         ///< error of C, new at every rotation
  double repeatability_mm = 2e-3;  ///< per axis and approach
  double tool_length_mm = 0.010;   ///< stated length of the tool that touches marks
  double touch_mm = 2e-3;          ///< per touch and axis
  double warms_by_mm = 0;          ///< the spindle grows along Z by this from first to last stop
};

/// Event between two stations. Counts of stations; 0: never.
struct BoardMishap {
  std::size_t board_moves_after = 0;
  Triple board_by_mm = {};
  double board_by_rad = 0;  ///< about Z through its middle
  double board_share = 1;   ///< share of its marks that move, from the first on
  std::size_t camera_moves_after = 0;
  Triple camera_by_mm = {};   ///< taper frame
  Triple camera_by_rad = {};  ///< about its axes
  std::size_t lens_moves_after = 0;
  double focal_factor = 1;
  /// With lens_moves_after 0: every other station has another camera, of that much longer focal
  /// length.
  bool every_other = false;
};

struct BoardSetup {
  SpindleLens lens;
  BoardSheet sheet;
  BoardMachine machine;
  BoardMishap mishap;
  std::vector<SpindleStation> stops;
  double tool_length_mm = 120;
  std::vector<int> touched;  ///< numbers of marks
  double sigma_px = 0.05;    ///< mark centre per axis, 1 sigma
};

struct BoardTouchStation {
  int mark = 0;
  Triple stated_mm = {};  ///< stated spindle position
};

/// Truth drawn from a setup.
struct BoardWorld {
  BoardSetup setup;
  std::vector<Triple> marks_mm;   ///< machine frame, mark 1 first
  std::vector<Triple> normals;    ///< paper normals at the marks, unit vectors
  Place machine_from_sheet;       ///< flat, exactly printed sheet
  SpindleMachine machine;         ///< scale and squareness as drawn
  Turn lean;                      ///< spindle axis
  std::vector<double> index_rad;  ///< error of C at each stop
  std::vector<Triple> actual_mm;  ///< spindle position per stop
  std::vector<BoardTouchStation> touches;
  Random noise = Random(0);
};

/// Returns stops spread evenly over a square of XY and, in turn, `heights` heights of the camera
/// above the table; one round for each angle of C.
/// REQUIRES per_turn, heights >= 1.
[[nodiscard]] std::vector<SpindleStation> BoardStations(const BoardSetup& setup, int per_turn,
                                                        int heights, double reach_mm, double low_mm,
                                                        double high_mm,
                                                        const std::vector<double>& c_rad);

/// REQUIRES stops, and touched marks that exist.
[[nodiscard]] BoardWorld DrawBoardWorld(const BoardSetup& setup, std::uint64_t seed);

/// Returns the camera's true position at a station, and its lens there.
[[nodiscard]] Place MachineFromCamera(const BoardWorld& world, std::size_t stop);
[[nodiscard]] SpindleLens LensAt(const BoardWorld& world, std::size_t stop);
/// Returns a mark's position in the machine at a stop.
[[nodiscard]] Triple MarkAt(const BoardWorld& world, std::size_t stop, std::size_t mark);

/// Returns the marks at least `margin_px` within the picture, with the noise of sigma_px; `target`
/// counts marks from 0. Draws two normal numbers for every mark, seen or not.
[[nodiscard]] std::vector<SpindleObservation> Look(const BoardWorld& world, std::size_t stop,
                                                   double margin_px, Random& random);

/// Returns the marks as a picture. Its lens is the camera's; light, clutter and eye are those of
/// `like`. REQUIRES one pattern for each mark.
[[nodiscard]] SpindlePicture BoardPictureAt(const BoardWorld& world, std::size_t stop,
                                            const std::vector<RingPattern>& patterns,
                                            const SpindlePicture& like);

/// Returns the spindle's true position for a commanded one; draws an error of the approach.
[[nodiscard]] Triple ActualFor(const BoardWorld& world, const Triple& stated_mm, Random& random);

/// Returns the command that moves the spindle to this actual place.
[[nodiscard]] Triple StatedFor(const SpindleMachine& machine, const Triple& actual_mm);

/// Returns the camera in the taper as carried by the spindle at the first stop: with its axis'
/// tilt, and the stated C.
[[nodiscard]] Place TaperFromCameraAsHeld(const BoardWorld& world);

}  // namespace trammel::sim
