#include "part_alignment/commands/align_board_arguments.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "app/option_values.h"
#include "app/provenance.h"
#include "part_alignment/procedure/start_dialogue.h"

namespace trammel::app {
namespace {

using part_alignment::BoardMeasurement;
using part_alignment::MachineBox;

constexpr double kUsualPitch_mm = 0.003;

Result<part_alignment::BoardTouch> ReadTouch(const std::string& text) {
  constexpr std::size_t kNumbers = 5;
  constexpr double kSigma_mm = 0.005;  // of one touch with paper or a probe
  const auto numbers = procedure::ParseNumbers(text, kNumbers);
  if (!numbers || (*numbers)[0] != std::floor((*numbers)[0])) {
    return Fail(
        fmt::format("--touch {}: must be MARK,X,Y,Z,LENGTH, as in 7,412.5,230.1,-188.24,85: "
                    "the mark, the spindle's place there, the tool's length",
                    text.substr(0, 80)));
  }
  const std::vector<double>& n = *numbers;
  const double none = std::numeric_limits<double>::infinity();
  return part_alignment::BoardTouch{
      fmt::format("{:.0f}", n[0]), {n[1], n[2], n[3]}, n[4], {none, none, kSigma_mm}};
}

// The travel that was given, within what the controller tells.
Result<MachineBox> TravelWithin(const BoardCommandArguments& arguments,
                                const machine::LinuxCncTravel& told) {
  MachineBox travel{told.low_mm, told.high_mm};
  if (!arguments.boxes.travel.empty()) {
    const MachineBox given = TravelOf(arguments.boxes);
    travel.low_mm = travel.low_mm.cwiseMax(given.low_mm);
    travel.high_mm = travel.high_mm.cwiseMin(given.high_mm);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (travel.low_mm[axis] > -machine::kFarthest_mm &&
        travel.high_mm[axis] < machine::kFarthest_mm) {
      continue;
    }
    return Fail(
        fmt::format("LinuxCNC tells no limits of {} (MIN_LIMIT, MAX_LIMIT in its INI file): "
                    "say --travel, so that no place is planned out of reach",
                    "XYZ"[axis]),
        ErrorKind::kSafety);
  }
  return travel;
}

void AddCamera(CLI::App& command, BoardCommandArguments& arguments) {
  constexpr const char* kGroup = "Camera and board";
  command
      .add_option("--source", arguments.source, "the live camera: /dev/videoN, aravis:ID, http://…")
      ->required()
      ->group(kGroup);
  command
      .add_option("--sheet", arguments.sheet,
                  "the printed sheet's layout, as align targets --layout left it")
      ->required()
      ->group(kGroup);
  command
      .add_option("--picture-size", arguments.picture_size,
                  "WIDTHxHEIGHT, asked of /dev/videoN; other cameras send what they are set to")
      ->group(kGroup);
  command
      .add_option("--pixel-pitch-mm", arguments.pixel_pitch_mm,
                  "of the sensor, by its data sheet; it scales the focal length in mm alone")
      ->check(NumberIn(1e-5, 1.0))
      ->group(kGroup);
  command
      .add_option("--lens-focal-length-mm", arguments.lens_focal_length_mm,
                  "as engraved: with --pixel-pitch-mm it checks the machine's unit of Z")
      ->check(NumberIn(0.0, 1e4))
      ->group(kGroup);
  command
      .add_option("--extra-sigma-px", arguments.drive.reading.extra_sigma_px,
                  "of each mark's centre beside the detector's own: lens, vibration")
      ->check(NumberIn(0.0, 10.0))
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--settle", arguments.drive.settle_s,
                  "s between standing and the picture; more than the camera is late by")
      ->check(NumberIn(0.0, 60.0))
      ->capture_default_str()
      ->group(kGroup);
}

void AddPlaces(CLI::App& command, BoardCommandArguments& arguments) {
  constexpr const char* kGroup = "Places";
  command.add_option("--pictures", arguments.drive.pictures, "at the spindle's first angle")
      ->check(CLI::Range(12, 500))
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_flag("--half-turn", arguments.drive.half_turn,
                "half as many with the spindle at 180 degrees, a quarter turned back: C turns, or "
                "you are asked to")
      ->group(kGroup);
  command
      .add_option("--highest-z", arguments.drive.highest_mm,
                  "of the spindle; left out: twice the present distance from the board")
      ->check(NumberIn(-1e5, 1e5))
      ->group(kGroup);
  command
      .add_option("--safe-z", arguments.safe_z_mm,
                  "machine Z at which the spindle may cross everywhere; left out: the upper limit")
      ->expected(1)
      ->check(NumberIn(-1e6, 1e6))
      ->group(kGroup);
  command.add_option("--feed", arguments.drive.feed_mm_min, "mm/min")
      ->check(NumberIn(10.0, 1e5))
      ->capture_default_str()
      ->group(kGroup);
  command.add_option("--turn-speed", arguments.turn_deg_min, "of C, degrees/min")
      ->check(NumberIn(10.0, 1e5))
      ->capture_default_str()
      ->group(kGroup);
  AddMachineBoxes(command, arguments.boxes, kGroup);
}

void AddTouches(CLI::App& command, BoardCommandArguments& arguments) {
  constexpr const char* kGroup = "What no picture tells";
  command
      .add_option("--touch", arguments.touches,
                  "MARK,X,Y,Z,LENGTH: a mark touched in Z by a tool of this length, and where the "
                  "machine stated its spindle; may be given again")
      ->group(kGroup);
  command
      .add_option("--tool-length-sigma-mm", arguments.tool_length_sigma_mm, "of that length, k = 1")
      ->check(NumberIn(0.0, 10.0))
      ->capture_default_str()
      ->group(kGroup);
  CLI::Option* const place =
      command
          .add_option("--place", arguments.place_mm,
                      "of the camera in the spindle from a drawing, X,Y,Z mm from the gauge line")
          ->expected(3)
          ->delimiter(',')
          ->group(kGroup);
  CLI::Option* const sigma =
      command.add_option("--place-sigma", arguments.place_sigma_mm, "of these three, k = 1")
          ->expected(3)
          ->delimiter(',')
          ->group(kGroup);
  place->needs(sigma);
  sigma->needs(place);
}

}  // namespace

void AddBoardOptions(CLI::App& command, BoardCommandArguments& arguments) {
  AddCamera(command, arguments);
  AddPlaces(command, arguments);
  AddTouches(command, arguments);
}

Result<files::BoardFile> BoardOf(const BoardCommandArguments& arguments) {
  auto board = files::ReadBoardSheet(arguments.sheet);
  if (!board) return board;
  if (board->measurement.layout.empty()) {
    return Fail(
        fmt::format("{}: has no marks with codes, or has them on several pages; one page is "
                    "needed",
                    arguments.sheet));
  }
  board->date = Today();
  BoardMeasurement& measurement = board->measurement;
  measurement.camera.looks_along = part_alignment::LooksAlong::kPlusZ;
  measurement.camera.pixel_pitch_mm =
      arguments.pixel_pitch_mm > 0 ? arguments.pixel_pitch_mm : kUsualPitch_mm;
  measurement.lens_focal_length_mm = arguments.lens_focal_length_mm;
  measurement.tool_length_sigma_mm = arguments.tool_length_sigma_mm;
  std::set<std::string> marks;
  for (const auto& mark : measurement.layout) marks.insert(mark.id);
  for (const std::string& text : arguments.touches) {
    auto touch = TRY(ReadTouch(text));
    if (!marks.contains(touch.mark)) {
      return Fail(fmt::format("--touch {}: the sheet {} has no mark {}", text, arguments.sheet,
                              touch.mark));
    }
    measurement.touches.push_back(std::move(touch));
  }
  if (arguments.place_mm.empty()) return board;
  const auto& at = arguments.place_mm;
  const auto& sigma = arguments.place_sigma_mm;
  measurement.place = {{at[0], at[1], at[2]}, {sigma[0], sigma[1], sigma[2]}};
  if ((measurement.place->sigma_mm.array() > 0).all()) return board;
  return Fail(fmt::format("--place-sigma {}: must be three numbers above 0, mm",
                          fmt::join(arguments.place_sigma_mm, ",")));
}

Result<void> FillRoute(const BoardCommandArguments& arguments, const machine::LinuxCncTravel& told,
                       procedure::RouteOptions& route) {
  const auto travel = TRY(TravelWithin(arguments, told));
  auto obstacles = TRY(ObstaclesOf(arguments.boxes));
  if (!obstacles.empty() && arguments.boxes.camera_below_mm == 0) {
    return Fail("--obstacle needs --camera-below: no camera file tells how far the camera reaches");
  }
  route.travel = travel;
  route.obstacles = std::move(obstacles);
  route.camera_radius_mm = arguments.boxes.camera_radius_mm;
  route.camera_below_mm = arguments.boxes.camera_below_mm;
  route.safe_z_mm = arguments.safe_z_mm.empty() ? travel.high_mm.z() : arguments.safe_z_mm.front();
  return {};
}

void TellWhatIsMissing(const BoardCommandArguments& arguments, const BoardMeasurement& board) {
  const auto notice = [](const char* text) { fmt::print(stderr, "notice    {}\n", text); };
  if (arguments.pixel_pitch_mm == 0) {
    notice(
        "without --pixel-pitch-mm 0.003 mm is taken: it scales the focal length in mm and "
        "nothing else");
  }
  if (board.touches.empty() && !board.place) {
    notice(
        "without --touch (or --place) nothing tells the camera's place along the spindle: the "
        "pictures are kept, and touches can be added to board.json later");
  }
  if (!arguments.drive.half_turn && !board.place) {
    notice("without --half-turn (or --place) nothing tells the camera's place across the spindle");
  }
  if (arguments.boxes.obstacles.empty()) {
    notice(
        "without --obstacle nothing but the safe height and the height it begins from keeps the "
        "camera clear");
  }
}

}  // namespace trammel::app
