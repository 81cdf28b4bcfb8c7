// trammel align calibrate and trammel align camera: make a camera file.
#include "part_alignment/commands/align_calibrate_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/camera/camera_convert.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/commands/machine_options.h"
#include "part_alignment/files/board_file.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/files/foreign_camera_file.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/procedure/survey_pictures.h"
#include "part_alignment/report/calibration_report.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::CameraConvention;
using part_alignment::SurveyPicture;

struct CalibrateArguments {
  std::string grid;
  BoardArguments board;  ///< its output options serve both methods
};

// Prints a calibration and writes its camera file.
template <class Calibration>
Result<int> GiveCalibration(const AnswerOptions& options, const Calibration& calibration,
                            const std::string& date, std::function<AnswerReport()> report) {
  Answer answer{calibration.verdict, report::ToJson(calibration),
                report::CalibrationText(calibration), std::move(report)};
  if (!options.out.empty() && calibration.verdict == Verdict::kGood) {
    answer.files = {{options.out, files::CalibratedCameraText(calibration, date)}};
  }
  return GiveAnswer(options, answer);
}

Result<int> RunGridCalibration(const std::string& path, const AnswerOptions& options) {
  TRY(CheckFree(options));
  const auto file = TRY(files::ReadCalibrationGrid(path));
  const SlowWork work("calibrating the camera");
  const auto calibration = part_alignment::CalibrateCamera(file.grid, {});
  if (!calibration) {
    return Fail(fmt::format("{}: {}", path, calibration.error().message), calibration.error().kind);
  }
  return GiveCalibration(options, *calibration, file.date, [&] {
    AnswerReport report;
    if (calibration->verdict == Verdict::kGood) {
      report.figures = report::CalibrationFigures(file.grid, *calibration);
    }
    report.page = report::CalibrationPage(file.date, *calibration, report.figures);
    return report;
  });
}

// Reads the marks from the pictures beside BOARD.json, or from stored observations.
Result<procedure::SurveyReading> ReadMarks(const BoardArguments& arguments,
                                           const files::BoardFile& board) {
  if (!arguments.observations.empty()) {
    auto pictures = TRY(files::ReadSurveyFile(arguments.observations));
    return procedure::SurveyReading{std::move(pictures), {}};
  }
  procedure::SurveyReadOptions options;
  options.book = TRY(part_alignment::MakeCodeBook(board.bits));
  options.extra_sigma_px = arguments.extra_sigma_px;
  options.finder.mirrored =
      board.measurement.camera.looks_along == part_alignment::LooksAlong::kMinusZ;
  std::vector<fs::path> paths;
  for (const auto& view : board.measurement.views) {
    paths.push_back(fs::path(arguments.board).parent_path() / view.picture);
  }
  return procedure::ReadSurveyPictures(
      paths, options, [](const std::string& line) { fmt::print(stderr, "{}\n", line); });
}

// Assigns each view's picture by its name; a picture that no view names is not part of this table.
Result<void> JoinMarks(const std::vector<SurveyPicture>& pictures, const std::string& where,
                       files::BoardFile& board) {
  std::map<std::string, const SurveyPicture*> by_name;
  for (const SurveyPicture& picture : pictures) by_name[picture.name] = &picture;
  for (auto& view : board.measurement.views) {
    const auto found = by_name.find(fs::path(view.picture).filename().string());
    if (found == by_name.end()) {
      return Fail(
          fmt::format("{}: has no picture {}, which a view names; the table of places and "
                      "the pictures do not belong together",
                      where, view.picture));
    }
    view.width_px = found->second->width_px;
    view.height_px = found->second->height_px;
    view.observations = found->second->observations;
    view.discs = found->second->discs;
    by_name.erase(found);
  }
  if (by_name.empty()) return {};
  return Fail(
      fmt::format("{}: no view names the picture {}; the table of places and the pictures "
                  "do not belong together",
                  where, by_name.begin()->first));
}

Result<int> RunCalibrate(const CLI::App& command, const CalibrateArguments& arguments) {
  if (arguments.grid.empty() == arguments.board.board.empty()) {
    return Fail("align calibrate takes either GRID.json or --board");
  }
  if (!arguments.board.board.empty()) return RunBoardCalibration(arguments.board);
  for (const char* name : {"--observations", "--keep-observations", "--extra-sigma-px"}) {
    if (command.count(name) == 0) continue;
    return Fail(fmt::format("{} is of pictures of a board: add --board", name));
  }
  return RunGridCalibration(arguments.grid, arguments.board.answer);
}

struct CameraArguments {
  std::string file;
  std::string out;
  std::string model = "brown_ideal_to_distorted";
  double pixel_pitch_mm = 0;
  double max_error_px = 0.01;
  bool force = false;
};

// Converts a camera of our own. A calibration is that of one model's parameters.
Result<part_alignment::ConvertedCamera> ConvertOwn(
    const files::CameraFile& own, const CameraArguments& arguments,
    const part_alignment::ConvertOptions& options,
    std::optional<part_alignment::CalibrationRecord>& calibration) {
  if (arguments.pixel_pitch_mm != 0) {
    return Fail("--pixel-pitch-mm is for other programs' files: this one has its own");
  }
  if (own.camera.convention == options.convention) {
    calibration = own.calibration;
  } else if (own.calibration) {
    fmt::print(stderr,
               "notice     the calibration's date, distances and covariance are those of the other "
               "model and are left out: what is solved with this file states too little\n");
  }
  return part_alignment::ConvertConvention(own.camera, options);
}

Result<part_alignment::ConvertedCamera> Converted(
    const CameraArguments& arguments,
    std::optional<part_alignment::CalibrationRecord>& calibration) {
  part_alignment::ConvertOptions options;
  options.convention = arguments.model == "brown_measured_to_ideal"
                           ? CameraConvention::kBrownMeasuredToIdeal
                           : CameraConvention::kBrownIdealToDistorted;
  options.max_error_px = arguments.max_error_px;
  if (arguments.file == "table1") {
    return part_alignment::ConvertConvention(part_alignment::TableOneCamera(), options);
  }
  // A camera file of our own is converted to the other convention.
  if (const auto own = files::ReadCameraFile(arguments.file)) {
    return ConvertOwn(*own, arguments, options, calibration);
  }
  const auto foreign = TRY(files::ReadForeignCameraFile(arguments.file));
  if (!(arguments.pixel_pitch_mm > 0)) {
    return Fail(
        "--pixel-pitch-mm is missing: other programs' files do not have it, and the focal "
        "length in mm follows from it");
  }
  return part_alignment::FromOpenCv(foreign, arguments.pixel_pitch_mm, options);
}

Result<int> RunCamera(const CameraArguments& arguments) {
  if (!arguments.out.empty()) {
    TRY(RefuseToOverwrite({arguments.out}, arguments.force));
  }
  std::optional<part_alignment::CalibrationRecord> calibration;
  const auto converted = Converted(arguments, calibration);
  if (!converted) {
    return Fail(fmt::format("camera {}: {}", arguments.file, converted.error().message),
                converted.error().kind);
  }
  fmt::print(stderr,
             "the two cameras differ by at most {:.2g} px over the sensor ({:.2g} px root mean "
             "square)\n",
             converted->largest_error_px, converted->rms_error_px);
  const std::string text = files::CameraFileText({converted->camera, calibration});
  if (arguments.out.empty()) {
    fmt::print("{}", text);
    return kExitGood;
  }
  TRY(files::WriteWholeFile(arguments.out, text, files::ReplaceIf(arguments.force)));
  return kExitGood;
}

}  // namespace

Result<int> RunBoardCalibration(const BoardArguments& arguments) {
  TRY(CheckFree(arguments.answer, {arguments.keep_observations}));
  auto board = TRY(files::ReadBoardFile(arguments.board));
  const auto reading = TRY(ReadMarks(arguments, board));
  if (!arguments.keep_observations.empty()) {
    TRY(WriteOutputs({{arguments.keep_observations, files::SurveyFileText(reading.pictures)}},
                     arguments.answer.force));
  }
  TRY(JoinMarks(reading.pictures,
                arguments.observations.empty() ? arguments.board : arguments.observations, board));
  const SlowWork work("calibrating the camera");
  auto calibration = part_alignment::CalibrateByBoard(board.measurement, {});
  if (!calibration) {
    return Fail(fmt::format("{}: {}", arguments.board, calibration.error().message),
                calibration.error().kind);
  }
  calibration->notices.insert(calibration->notices.end(), reading.notices.begin(),
                              reading.notices.end());
  return GiveCalibration(arguments.answer, *calibration, board.date, [&] {
    return AnswerReport{report::CalibrationPage(board.date, *calibration), {}};
  });
}

void AddAlignCalibrateCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "calibrate",
      "a camera from one target at known places before it, or from pictures of a printed board");
  const auto all = std::make_shared<CalibrateArguments>();
  BoardArguments& arguments = all->board;
  command->add_option("grid", all->grid,
                      "GRID.json: places and pixels (docs/reference/formats.md)");
  command->add_option("--board", arguments.board,
                      "BOARD.json: pictures by the camera in the spindle of a board on the table, "
                      "and where they were taken");
  command->add_option("--observations", arguments.observations,
                      "of the board's pictures, in place of them: what --keep-observations left");
  command->add_option("--keep-observations", arguments.keep_observations,
                      "file for what the board's pictures show");
  AddNumber(*command, "--extra-sigma-px", arguments.extra_sigma_px,
            "of each mark's centre beside the detector's own: lens, vibration", 0, 10);
  AddAnswerOptions(*command, arguments.answer, "camera file to write, if the verdict is good",
                   "folder for report.html and the figures");
  OnRun(*command, exit_code, [all, command] { return RunCalibrate(*command, *all); });
}

void AddAlignCameraCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "camera", "a camera file from OpenCV's or mrcal's, or with the distortion turned round");
  const auto arguments = std::make_shared<CameraArguments>();
  command
      ->add_option("file", arguments->file,
                   "OpenCV YAML, XML or JSON, mrcal .cameramodel, a camera file, or table1: the "
                   "camera of the paper")
      ->required();
  command->add_option("--pixel-pitch-mm", arguments->pixel_pitch_mm, "of the sensor");
  command->add_option("--model", arguments->model, "direction of the distortion's polynomial")
      ->check(CLI::IsMember(
          std::vector<std::string>{"brown_ideal_to_distorted", "brown_measured_to_ideal"}))
      ->capture_default_str();
  command->add_option("--most-error-px", arguments->max_error_px, "accepted over the sensor")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("-o,--out", arguments->out, "file to write instead of standard output");
  command->add_flag("--force", arguments->force, "overwrite it");
  OnRun(*command, exit_code, [arguments] { return RunCamera(*arguments); });
}

}  // namespace trammel::app
