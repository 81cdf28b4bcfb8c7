// trammel align board: the machine carries its own camera over a printed board, takes the pictures,
// and calibrates it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/secrets.h"
#include "app/terminal_person.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "part_alignment/commands/align_board.h"
#include "part_alignment/commands/align_board_arguments.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_record.h"
#include "part_alignment/files/board_file.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/procedure/align_picture.h"
#include "part_alignment/procedure/board_drive.h"
#include "session/session.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::BoardMeasurement;

constexpr const char* kMoveQuestion = "move";
constexpr const char* kTurnQuestion = "turned";  // never answered beforehand
constexpr const char* kSheetName = "sheet.json";
constexpr std::size_t kMostSheetBytes = 20'000'000;

// What is kept of a run as it goes: pictures, BOARD.json and what was seen, each whole at any
// moment.
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

  // With where what was taken is.
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
  std::vector<std::string> names_;  ///< of the pictures
};

// The live camera, which need not be described by any file.
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

// The machine with its camera, while the pictures are taken.
class BoardStand {
 public:
  BoardStand(const BoardCommandArguments& arguments, machine::LinuxCnc& linuxcnc,
             machine::FrameSource& source, TerminalPerson& person, std::stop_token stop)
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
  // While somebody is asked, the machine is looked at.
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
  TerminalPerson& person_;
  std::stop_token stop_;
  double c_deg_ = 0;
};

Result<void> CheckPerson(const BoardCommandArguments& arguments, const TerminalPerson& person) {
  TRY(person.CheckCanAnswer(kMoveQuestion));
  const machine::LinuxCncOptions& options = arguments.linuxcnc.options;
  if (!arguments.drive.half_turn || options.c_holds_spindle || person.present()) return {};
  return Fail(
      "--half-turn without --c-axis asks somebody to turn the spindle: run it in a terminal");
}

Result<BoardMeasurement> TakeBoard(BoardCommandArguments& arguments, const files::BoardFile& board,
                                   TerminalPerson& person, BoardFolder& folder,
                                   const std::stop_token& stop) {
  auto linuxcnc = TRY(ConnectLinuxCnc(arguments.linuxcnc, stop));
  const auto told = TRY(linuxcnc->Travel(stop));
  TRY(FillRoute(arguments, told, arguments.drive.route));
  const auto source = TRY(OpenSource(arguments, stop));
  auto book = TRY(part_alignment::MakeCodeBook(board.bits));
  arguments.drive.reading.book = std::move(book);
  arguments.drive.board = board.measurement;
  for (const auto& mark : board.measurement.layout) arguments.drive.marks.insert(mark.id);
  BoardStand stand(arguments, *linuxcnc, *source, person, stop);
  return DriveOverBoard(arguments.drive, stand.Hooks(folder));
}

int RunBoard(BoardCommandArguments arguments) {
  const Interrupt interrupt;
  const std::stop_token stop = interrupt.token();
  TerminalPerson person(stop, {arguments.yes.begin(), arguments.yes.end()});
  if (auto can = CheckPerson(arguments, person); !can) return PrintError(can.error());
  auto board = BoardOf(arguments);
  if (!board) return PrintError(board.error());
  if (!arguments.linuxcnc.options.c_holds_spindle) {
    constexpr double kByHand_rad = 0.03;  // 1.7 degrees, k = 1
    board->measurement.machine.index_rad = kByHand_rad;
  }
  auto sheet = files::ReadWholeFile(arguments.sheet, kMostSheetBytes);
  if (!sheet) return PrintError(sheet.error());
  const auto place = NewFolder::Make(arguments.folder);
  if (!place) return PrintError(place.error());
  BoardFolder folder(place->path(), *board, std::move(*sheet));
  TellWhatIsMissing(arguments, board->measurement);
  const auto taken = TakeBoard(arguments, *board, person, folder, stop);
  if (!taken) return PrintError(folder.Stopped(procedure::NameStop(stop, taken.error())));
  BoardArguments calibrate;
  calibrate.board = folder.board_path().string();
  calibrate.observations = folder.seen_path().string();
  calibrate.out = (folder.path() / "camera.json").string();
  calibrate.report = (folder.path() / "report").string();
  calibrate.json = arguments.json;
  const int code = RunBoardCalibration(calibrate);
  fmt::print(stderr, "{}{}\n", code == kExitGood ? "camera    " : "kept in   ",
             code == kExitGood ? calibrate.out : folder.path().string());
  if (code == kExitNotTrusted) {
    fmt::print(stderr,
               "next      mend board.json, then: trammel align calibrate --board {} "
               "--observations {} --out {}\n",
               calibrate.board, calibrate.observations, calibrate.out);
  }
  return code;
}

}  // namespace

void AddAlignBoardCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "board", "drive the camera over a printed board, take the pictures, calibrate it");
  const auto arguments = std::make_shared<BoardCommandArguments>();
  arguments->drive.reading.extra_sigma_px = 0.01;  // as of align calibrate --board
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
  command->callback([arguments, &exit_code] { exit_code = RunBoard(*arguments); });
}

}  // namespace trammel::app
