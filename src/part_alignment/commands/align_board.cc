#include "part_alignment/commands/align_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/files/board_file.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/procedure/survey_pictures.h"
#include "part_alignment/report/board_report.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::SurveyPicture;

Result<void> CheckPlaces(const BoardArguments& arguments) {
  TRY(CheckFree(arguments.out, arguments.report, arguments.force));
  if (arguments.keep_observations.empty()) return {};
  return RefuseToOverwrite({arguments.keep_observations}, arguments.force);
}

// From the pictures beside BOARD.json, or as they were kept.
Result<procedure::SurveyReading> ReadMarks(const BoardArguments& arguments,
                                           const files::BoardFile& board) {
  if (!arguments.observations.empty()) {
    auto pictures = TRY(files::ReadSurveyFile(arguments.observations));
    return procedure::SurveyReading{std::move(pictures), {}};
  }
  procedure::SurveyReadOptions options;
  auto book = TRY(part_alignment::MakeCodeBook(board.bits));
  options.book = std::move(book);
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

// Each view's picture by its name; a picture that no view names is none of this table.
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

}  // namespace

int RunBoardCalibration(const BoardArguments& arguments) {
  if (auto free = CheckPlaces(arguments); !free) return PrintError(free.error());
  auto board = files::ReadBoardFile(arguments.board);
  if (!board) return PrintError(board.error());
  const auto reading = ReadMarks(arguments, *board);
  if (!reading) return PrintError(reading.error());
  if (!arguments.keep_observations.empty()) {
    const auto kept =
        files::WriteWholeFile(arguments.keep_observations, files::SurveyFileText(reading->pictures),
                              files::ReplaceIf(arguments.force));
    if (!kept) return PrintError(kept.error());
  }
  const std::string where =
      arguments.observations.empty() ? arguments.board : arguments.observations;
  if (auto joined = JoinMarks(reading->pictures, where, *board); !joined) {
    return PrintError(joined.error());
  }
  const SlowWork work("calibrating the camera");
  auto calibration = part_alignment::CalibrateByBoard(board->measurement, {});
  if (!calibration) {
    return PrintError({calibration.error().kind,
                       fmt::format("{}: {}", arguments.board, calibration.error().message)});
  }
  calibration->notices.insert(calibration->notices.end(), reading->notices.begin(),
                              reading->notices.end());
  PrintAnswer(arguments.json, report::ToJson(*calibration),
              report::BoardCalibrationText(*calibration));
  if (!arguments.report.empty()) {
    const auto written = WriteMetrologyReport(
        arguments.report, report::BoardCalibrationPage(board->date, *calibration), {},
        arguments.force);
    if (!written) return PrintError(written.error());
  }
  if (calibration->verdict != Verdict::kGood) return kExitNotTrusted;
  if (!arguments.out.empty()) {
    const auto written =
        files::WriteWholeFile(arguments.out, files::CalibratedCameraText(*calibration, board->date),
                              files::ReplaceIf(arguments.force));
    if (!written) return PrintError(written.error());
  }
  return kExitGood;
}

}  // namespace trammel::app
