// trammel align board: the machine moves its own camera over a printed board, takes the pictures,
// and calibrates it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "app/secrets.h"
#include "app/terminal_operator.h"
#include "base/result.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "machine/linuxcnc/linuxcnc_session.h"
#include "part_alignment/commands/align_calibrate_command.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/commands/machine_options.h"
#include "part_alignment/files/board_file.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/procedure/align_measure.h"
#include "part_alignment/procedure/board_drive.h"
#include "part_alignment/procedure/start_dialogue.h"
#include "session/session.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::BoardMeasurement;
using part_alignment::MachineBox;

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

constexpr double kUsualPitch_mm = 0.003;

Result<part_alignment::BoardTouch> ReadTouch(const std::string& text) {
  constexpr std::size_t kNumbers = 5;
  constexpr double kSigma_mm = 0.005;  // one touch with paper or a probe
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

// Returns the given travel, within the controller's limits.
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
  AddNumber(command, "--extra-sigma-px", arguments.drive.reading.extra_sigma_px,
            "of each mark's centre beside the detector's own: lens, vibration", 0.0, 10.0, kGroup);
  AddNumber(command, "--settle", arguments.drive.settle_s,
            "s between standing and the picture; more than the camera is late by", 0.0, 60.0,
            kGroup);
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
  AddNumber(command, "--feed", arguments.drive.feed_mm_min, "mm/min", 10.0, 1e5, kGroup);
  AddNumber(command, "--turn-speed", arguments.turn_deg_min, "of C, degrees/min", 10.0, 1e5,
            kGroup);
  AddMachineBoxes(command, arguments.boxes, kGroup);
}

void AddTouches(CLI::App& command, BoardCommandArguments& arguments) {
  constexpr const char* kGroup = "What no picture tells";
  command
      .add_option("--touch", arguments.touches,
                  "MARK,X,Y,Z,LENGTH: a mark touched in Z by a tool of this length, and where the "
                  "machine stated its spindle; may be given again")
      ->group(kGroup);
  AddNumber(command, "--tool-length-sigma-mm", arguments.tool_length_sigma_mm,
            "of that length, k = 1", 0.0, 10.0, kGroup);
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

/// Adds the options for camera, board, positions, and quantities that pictures do not determine.
void AddBoardOptions(CLI::App& command, BoardCommandArguments& arguments) {
  AddCamera(command, arguments);
  AddPlaces(command, arguments);
  AddTouches(command, arguments);
}

/// Reads the given board and camera, without views.
/// Errors (kInput): the sheet's file; a touch of no mark or of another form; an invalid sigma.
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

/// Fills in the safe height, obstacles, and the given travel within the controller's limits.
/// Errors: kSafety for an axis without limits from either; kInput for invalid obstacles.
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

/// Prints notices of omitted options, on standard error.
void PrintWhatIsMissing(const BoardCommandArguments& arguments, const BoardMeasurement& board) {
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

constexpr const char* kMoveQuestion = "move";
constexpr const char* kTurnQuestion = "turned";  // never answered beforehand
constexpr const char* kSheetName = "sheet.json";
constexpr std::size_t kMaxSheetBytes = 20'000'000;

// Folder of a run: pictures, BOARD.json and observations, each file whole at any moment.
class BoardFolder {
 public:
  BoardFolder(fs::path folder, files::BoardFile board, std::string sheet)
      : folder_(std::move(folder)), board_(std::move(board)), sheet_(std::move(sheet)) {}

  Result<void> KeepPicture(std::size_t view, const machine::CapturedFrame& picture) {
    if (names_.empty()) {
      TRY(Write(folder_ / kSheetName, sheet_));
    }
    auto name = TRY(WritePicture(folder_, view, picture));
    names_.resize(std::max(names_.size(), view + 1));
    names_[view] = std::move(name);
    return {};
  }

  Result<void> KeepViews(const BoardMeasurement& so_far) {
    board_.measurement = so_far;
    std::vector<part_alignment::SurveyPicture> seen;
    for (std::size_t i = 0; i < so_far.views.size(); ++i) {
      part_alignment::BoardView& view = board_.measurement.views[i];
      view.picture = names_.at(i);
      seen.push_back({view.picture, view.width_px, view.height_px, view.observations, view.discs});
    }
    TRY(Write(board_path(), files::BoardFileText(board_, kSheetName)));
    return Write(seen_path(), files::SurveyFileText(seen));
  }

  // Adds the folder of the pictures taken so far to the message.
  [[nodiscard]] Error Stopped(const Error& error) const {
    if (names_.empty()) return error;
    return {error.kind, fmt::format("{}; the pictures taken ({}) are kept in {}", error.message,
                                    names_.size(), folder_.string())};
  }

  [[nodiscard]] fs::path board_path() const { return folder_ / "board.json"; }
  [[nodiscard]] fs::path seen_path() const { return folder_ / "seen.json"; }
  [[nodiscard]] const fs::path& path() const { return folder_; }

 private:
  static Result<void> Write(const fs::path& path, const std::string& text) {
    return files::WriteWholeFile(path, text, files::IfThere::kReplace);
  }

  fs::path folder_;
  files::BoardFile board_;
  std::string sheet_;               ///< the text of its file
  std::vector<std::string> names_;  ///< picture names
};

// Opens the live camera, which needs no camera file.
Result<std::unique_ptr<machine::FrameSource>> OpenSource(const BoardCommandArguments& arguments,
                                                         const std::stop_token& stop) {
  machine::CameraOptions options;
  if (!arguments.picture_size.empty()) {
    const auto size = ParseWholePair(arguments.picture_size);
    if (!size) {
      return Fail(fmt::format("--picture-size {}: must be WIDTHxHEIGHT, for example 2592x1944",
                              arguments.picture_size.substr(0, 40)));
    }
    options.width_px = size->first;
    options.height_px = size->second;
  }
  const auto address = TRY(CameraAddressOf("--source", arguments.source));
  auto source = machine::OpenCamera(address, options, stop);
  if (source && !(*source)->live()) {
    return Fail(
        fmt::format("--source {} is no live camera; pictures that were taken by hand go "
                    "into a BOARD.json: trammel align calibrate --board",
                    arguments.source));
  }
  return source;
}

// Machine with its camera, while the pictures are taken.
class BoardStand {
 public:
  BoardStand(const BoardCommandArguments& arguments, machine::LinuxCnc& linuxcnc,
             machine::FrameSource& source, TerminalOperator& person, std::stop_token stop)
      : arguments_(arguments),
        linuxcnc_(linuxcnc),
        pictures_(source, arguments.drive.settle_s),
        person_(person),
        stop_(std::move(stop)) {}

  [[nodiscard]] procedure::BoardHooks Hooks(BoardFolder& folder) {
    procedure::BoardHooks hooks;
    hooks.move_to = [this](const Eigen::Vector3d& mm) {
      return linuxcnc_.MoveTo(mm, arguments_.drive.feed_mm_min, stop_);
    };
    hooks.stands_at = [this] {
      const bool c_axis = arguments_.linuxcnc.options.c_holds_spindle;
      return StandsAt(linuxcnc_, c_axis ? std::optional(c_deg_) : std::nullopt, stop_);
    };
    hooks.take_picture = [this] { return pictures_.Take(stop_); };
    hooks.keep_picture = [&folder](std::size_t view, const machine::CapturedFrame& picture) {
      return folder.KeepPicture(view, picture);
    };
    hooks.keep_views = [&folder](const BoardMeasurement& so_far) {
      return folder.KeepViews(so_far);
    };
    hooks.may_move = [this](const std::string& how) {
      return person_.Confirm({kMoveQuestion, how}, Watch());
    };
    hooks.turn_to = [this](double c_deg) { return TurnTo(c_deg); };
    hooks.tell = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
    return hooks;
  }

 private:
  // Monitors the machine while a question is open.
  [[nodiscard]] std::function<Result<void>()> Watch() {
    return [this] { return linuxcnc_.Prepare(true, stop_); };
  }

  Result<void> TurnTo(double c_deg) {
    if (arguments_.linuxcnc.options.c_holds_spindle) {
      TRY(linuxcnc_.TurnTo(c_deg, arguments_.turn_deg_min, stop_));
    } else {
      const auto turned = TRY(
          person_.Confirm({kTurnQuestion,
                           "turn the spindle by half a turn by hand, the camera with it, and lock "
                           "it again; is it done"},
                          Watch()));
      if (!turned) return Fail("the spindle was not turned", ErrorKind::kInterrupted);
    }
    c_deg_ = c_deg;
    return {};
  }

  const BoardCommandArguments& arguments_;
  machine::LinuxCnc& linuxcnc_;
  procedure::StillPictures pictures_;
  TerminalOperator& person_;
  std::stop_token stop_;
  double c_deg_ = 0;
};

Result<void> CheckOperator(const BoardCommandArguments& arguments, const TerminalOperator& person) {
  TRY(person.CheckCanAnswer(kMoveQuestion));
  const machine::LinuxCncOptions& options = arguments.linuxcnc.options;
  if (!arguments.drive.half_turn || options.c_holds_spindle || person.present()) return {};
  return Fail(
      "--half-turn without --c-axis asks somebody to turn the spindle: run it in a terminal");
}

Result<BoardMeasurement> TakeBoard(BoardCommandArguments& arguments, const files::BoardFile& board,
                                   TerminalOperator& person, BoardFolder& folder,
                                   const std::stop_token& stop) {
  auto linuxcnc = TRY(ConnectLinuxCnc(arguments.linuxcnc, stop));
  const auto told = TRY(linuxcnc->Travel(stop));
  TRY(FillRoute(arguments, told, arguments.drive.route));
  const auto source = TRY(OpenSource(arguments, stop));
  arguments.drive.reading.book = TRY(part_alignment::MakeCodeBook(board.bits));
  arguments.drive.board = board.measurement;
  for (const auto& mark : board.measurement.layout) arguments.drive.marks.insert(mark.id);
  BoardStand stand(arguments, *linuxcnc, *source, person, stop);
  return DriveOverBoard(arguments.drive, stand.Hooks(folder));
}

Result<int> RunBoard(BoardCommandArguments arguments) {
  const Interrupt interrupt;
  const std::stop_token stop = interrupt.token();
  TerminalOperator person(stop, {arguments.yes.begin(), arguments.yes.end()});
  TRY(CheckOperator(arguments, person));
  auto board = TRY(BoardOf(arguments));
  if (!arguments.linuxcnc.options.c_holds_spindle) {
    constexpr double kByHand_rad = 0.03;  // 1.7 degrees, k = 1
    board.measurement.machine.index_rad = kByHand_rad;
  }
  auto sheet = TRY(files::ReadWholeFile(arguments.sheet, kMaxSheetBytes));
  const auto place = TRY(NewFolder::Make(arguments.folder));
  BoardFolder folder(place.path(), board, std::move(sheet));
  PrintWhatIsMissing(arguments, board.measurement);
  const auto taken = TakeBoard(arguments, board, person, folder, stop);
  if (!taken) return tl::unexpected(folder.Stopped(procedure::NameStopReason(stop, taken.error())));
  BoardArguments calibrate;
  calibrate.board = folder.board_path().string();
  calibrate.observations = folder.seen_path().string();
  calibrate.answer.out = (folder.path() / "camera.json").string();
  calibrate.answer.report = (folder.path() / "report").string();
  calibrate.answer.json = arguments.json;
  const auto calibrated = RunBoardCalibration(calibrate);
  const int code = calibrated ? *calibrated : PrintError(calibrated.error());
  fmt::print(stderr, "{}{}\n", code == kExitGood ? "camera    " : "kept in   ",
             code == kExitGood ? calibrate.answer.out : folder.path().string());
  if (code == kExitNotTrusted) {
    fmt::print(stderr,
               "next      mend board.json, then: trammel align calibrate --board {} "
               "--observations {} --out {}\n",
               calibrate.board, calibrate.observations, calibrate.answer.out);
  }
  return code;
}

}  // namespace

void AddAlignBoardCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "board", "drive the camera over a printed board, take the pictures, calibrate it");
  const auto arguments = std::make_shared<BoardCommandArguments>();
  arguments->drive.reading.extra_sigma_px = 0.01;  // as in align calibrate --board
  command
      ->add_option("folder", arguments->folder,
                   "new folder for pictures, board.json, camera.json and the report")
      ->required();
  command->add_flag("--json", arguments->json, "one JSON object instead of text");
  command
      ->add_option("--yes", arguments->yes,
                   "answers a question beforehand, for runs without a terminal: move")
      ->delimiter(',')
      ->check(CLI::IsMember(std::set<std::string>{kMoveQuestion}));
  AddBoardOptions(*command, *arguments);
  AddLinuxCncOptions(*command, "--machine",
                     "what moves: session, the LinuxCNC that runs on this computer",
                     arguments->linuxcnc);
  command->get_option("--machine")->required();
  OnRun(*command, exit_code, [arguments] { return RunBoard(*arguments); });
}

}  // namespace trammel::app
