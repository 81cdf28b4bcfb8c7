// A printed board on the machine's table, under the virtual spindle's camera.
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

/// The sheet as it was meant: marks in columns and rows, numbered from 1 along the rows. Printer
/// and paper make something else of it.
struct BoardSheet {
  int columns = 11;      ///< 2 … 100
  int rows = 8;          ///< 2 … 100
  double pitch_mm = 24;  ///< between neighbours, 1 … 500
  /// Other marks than columns and rows: right and up from the sheet's middle, mm.
  std::vector<std::array<double, 2>> places_mm = {};
  /// Each way of the paper is printed longer or shorter by up to this part of itself.
  double print_scale = 2e-3;
  double print_error_mm = 0.03;  ///< of each mark, 1 sigma per axis
  double bend_mm = 0.3;          ///< sagitta over the board's diagonal, in a direction of the seed
  double lean_rad = 3e-3;        ///< of the table's top, uniform within +-this about X and Y
  double off_mm = 5;             ///< of the board's middle from the machine's (X, Y) below
  Triple middle_mm = {600, 400, 0};
};

/// Standard deviations of what a machine's seed draws. Scale and squareness are about the machine's
/// zero, as in SpindleMachine.
struct BoardMachine {
  double scale = 20e-6;            ///< relative, each axis
  double square_rad = 20e-6;       ///< each of the three
  double lean_rad = 100e-6;        ///< of the spindle's axis about X and Y
  double index_rad = 2e-3;         ///< of C, anew whenever it turns
  double repeatability_mm = 2e-3;  ///< of each axis in each approach
  double tool_length_mm = 0.010;   ///< of the stated length of the tool that touches marks
  double touch_mm = 2e-3;          ///< of one touch, each axis
  double warms_by_mm = 0;          ///< the spindle grows along Z by this from first to last stop
};

/// What happens between two stops. Counts of stops; 0: never.
struct BoardMishap {
  std::size_t board_moves_after = 0;
  Triple board_by_mm = {};
  double board_by_rad = 0;  ///< about Z through its middle
  double board_share = 1;   ///< of its marks, from the first on: the others lie still
  std::size_t camera_moves_after = 0;
  Triple camera_by_mm = {};   ///< in the taper's frame
  Triple camera_by_rad = {};  ///< about its axes
  std::size_t lens_moves_after = 0;
  double focal_factor = 1;
  /// With lens_moves_after 0: every other stop is another camera, whose focal length is that much
  /// longer.
  bool every_other = false;
};

struct BoardSetup {
  SpindleLens lens;
  BoardSheet sheet;
  BoardMachine machine;
  BoardMishap mishap;
  std::vector<SpindleStop> stops;
  double tool_length_mm = 120;
  std::vector<int> touched;  ///< numbers of marks
  double sigma_px = 0.05;    ///< of a mark's centre per axis, 1 sigma
};

struct BoardTouchStop {
  int mark = 0;
  Triple stated_mm = {};  ///< of the spindle
};

/// What is true, drawn from a setup.
struct BoardWorld {
  BoardSetup setup;
  std::vector<Triple> marks_mm;   ///< in the machine, mark 1 first
  std::vector<Triple> normals;    ///< of the paper at the marks, unit vectors
  Place machine_from_sheet;       ///< of the unbent, well-printed sheet
  SpindleMachine machine;         ///< scale and squareness as drawn
  Turn lean;                      ///< of the spindle's axis
  std::vector<double> index_rad;  ///< error of C at each stop
  std::vector<Triple> actual_mm;  ///< of the spindle at each stop
  std::vector<BoardTouchStop> touches;
  Random noise = Random(0);
};

/// Evenly over a square of XY and, in turn, `heights` heights of the camera above the table; one
/// round for each angle of C.
/// REQUIRES per_turn, heights >= 1.
[[nodiscard]] std::vector<SpindleStop> BoardStops(const BoardSetup& setup, int per_turn,
                                                  int heights, double reach_mm, double low_mm,
                                                  double high_mm, const std::vector<double>& c_rad);

/// REQUIRES stops, and touched marks that exist.
[[nodiscard]] BoardWorld DrawBoardWorld(const BoardSetup& setup, std::uint64_t seed);

/// Where the camera really is at a stop, and the lens it then has.
[[nodiscard]] Place MachineFromCamera(const BoardWorld& world, std::size_t stop);
[[nodiscard]] SpindleLens LensAt(const BoardWorld& world, std::size_t stop);
/// A mark as it lies at a stop, in the machine.
[[nodiscard]] Triple MarkAt(const BoardWorld& world, std::size_t stop, std::size_t mark);

/// Marks at least `margin_px` within the picture, with the noise of sigma_px; `target` counts marks
/// from 0. Two normal numbers are drawn for every mark, seen or not.
[[nodiscard]] std::vector<SpindleObservation> Look(const BoardWorld& world, std::size_t stop,
                                                   double margin_px, Random& random);

/// The marks as a picture shows them. Its lens is the camera's; light, clutter and eye those of
/// `like`. REQUIRES one pattern for each mark.
[[nodiscard]] SpindlePicture BoardPictureAt(const BoardWorld& world, std::size_t stop,
                                            const std::vector<RingPattern>& patterns,
                                            const SpindlePicture& like);

/// Where the spindle really comes to when it is sent somewhere; draws an error of the approach.
[[nodiscard]] Triple ActualFor(const BoardWorld& world, const Triple& stated_mm, Random& random);

/// Where the spindle has to be sent (stated) so that its actual place is this.
[[nodiscard]] Triple StatedFor(const SpindleMachine& machine, const Triple& actual_mm);

/// The camera in the taper as the spindle carries it at the first stop: with the lean of its axis,
/// and C as the machine states it.
[[nodiscard]] Place TaperFromCameraAsHeld(const BoardWorld& world);

}  // namespace trammel::sim
