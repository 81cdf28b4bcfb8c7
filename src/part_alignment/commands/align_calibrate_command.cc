// trammel align calibrate and trammel align camera: where a camera file comes from.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/camera/camera_convert.h"
#include "part_alignment/commands/align_board.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/files/calibration_grid_file.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/files/foreign_camera_file.h"
#include "part_alignment/report/part_metrology_figures.h"
#include "part_alignment/report/part_metrology_page.h"
#include "part_alignment/report/part_metrology_text.h"

namespace trammel::app {
namespace {

using part_alignment::CameraConvention;

struct CalibrateArguments {
  std::string grid;
  /// With its fields of output in use for either.
  BoardArguments board;
};

int RunGridCalibration(const CalibrateArguments& all) {
  const BoardArguments& arguments = all.board;
  if (auto free = CheckFree(arguments.out, arguments.report, arguments.force); !free) {
    return PrintError(free.error());
  }
  const auto file = files::ReadCalibrationGrid(all.grid);
  if (!file) return PrintError(file.error());
  const SlowWork work("calibrating the camera");
  const auto calibration = part_alignment::CalibrateCamera(file->grid, {});
  if (!calibration) {
    return PrintError(
        {calibration.error().kind, fmt::format("{}: {}", all.grid, calibration.error().message)});
  }
  PrintAnswer(arguments.json, report::ToJson(*calibration), report::CalibrationText(*calibration));
  const bool good = calibration->verdict == Verdict::kGood;
  if (!arguments.report.empty()) {
    std::vector<report::Figure> figures;
    if (good) figures = report::CalibrationFigures(file->grid, *calibration);
    const auto written = WriteMetrologyReport(
        arguments.report, report::CalibrationPage(file->date, *calibration, figures), figures,
        arguments.force);
    if (!written) return PrintError(written.error());
  }
  if (!good) return kExitNotTrusted;
  if (!arguments.out.empty()) {
    const auto written =
        files::WriteWholeFile(arguments.out, files::CalibratedCameraText(*calibration, file->date),
                              files::ReplaceIf(arguments.force));
    if (!written) return PrintError(written.error());
  }
  return kExitGood;
}

int RunCalibrate(const CLI::App& command, const CalibrateArguments& arguments) {
  if (arguments.grid.empty() == arguments.board.board.empty()) {
    return PrintError({ErrorKind::kInput, "align calibrate takes either GRID.json or --board"});
  }
  if (!arguments.board.board.empty()) return RunBoardCalibration(arguments.board);
  for (const char* name : {"--observations", "--keep-observations", "--extra-sigma-px"}) {
    if (command.count(name) == 0) continue;
    return PrintError(
        {ErrorKind::kInput, fmt::format("{} is of pictures of a board: add --board", name)});
  }
  return RunGridCalibration(arguments);
}

struct CameraArguments {
  std::string file;
  std::string out;
  std::string model = "brown_ideal_to_distorted";
  double pixel_pitch_mm = 0;
  double most_error_px = 0.01;
  bool force = false;
};

// A calibration is that of one model's parameters.
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
  options.most_error_px = arguments.most_error_px;
  if (arguments.file == "table1") {
    return part_alignment::ConvertConvention(part_alignment::TableOneCamera(), options);
  }
  // A camera file of our own is turned to the other convention.
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

int RunCamera(const CameraArguments& arguments) {
  if (!arguments.out.empty()) {
    const auto free = RefuseToOverwrite({arguments.out}, arguments.force);
    if (!free) return PrintError(free.error());
  }
  std::optional<part_alignment::CalibrationRecord> calibration;
  const auto converted = Converted(arguments, calibration);
  if (!converted) {
    return PrintError({converted.error().kind,
                       fmt::format("camera {}: {}", arguments.file, converted.error().message)});
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
  const auto written =
      files::WriteWholeFile(arguments.out, text, files::ReplaceIf(arguments.force));
  return written ? static_cast<int>(kExitGood) : PrintError(written.error());
}

}  // namespace

void AddAlignCalibrateCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "calibrate",
      "a camera from one target at known places before it, or from pictures of a printed board");
  const auto all = std::make_shared<CalibrateArguments>();
  BoardArguments& arguments = all->board;
  command->add_option("grid", all->grid, "GRID.json: places and pixels (docs/formats.md)");
  command->add_option("--board", arguments.board,
                      "BOARD.json: pictures by the camera in the spindle of a board on the table, "
                      "and where they were taken");
  command->add_option("--observations", arguments.observations,
                      "of the board's pictures, in place of them: what --keep-observations left");
  command->add_option("--keep-observations", arguments.keep_observations,
                      "file for what the board's pictures show");
  command
      ->add_option("--extra-sigma-px", arguments.extra_sigma_px,
                   "of each mark's centre beside the detector's own: lens, vibration")
      ->check(NumberIn(0, 10))
      ->capture_default_str();
  command->add_option("-o,--out", arguments.out, "camera file to write, if the verdict is good");
  command->add_option("--report", arguments.report, "folder for report.html and the figures");
  command->add_flag("--json", arguments.json, "one JSON object instead of text");
  command->add_flag("--force", arguments.force, "overwrite files");
  command->callback([all, command, &exit_code] { exit_code = RunCalibrate(*command, *all); });
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
  command->add_option("--most-error-px", arguments->most_error_px, "accepted over the sensor")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("-o,--out", arguments->out, "file to write instead of standard output");
  command->add_flag("--force", arguments->force, "overwrite it");
  command->callback([arguments, &exit_code] { exit_code = RunCamera(*arguments); });
}

}  // namespace trammel::app
