// trammel align survey: computes the coordinates of a part's targets from pictures by a hand-held
// camera.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/commands/machine_options.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/procedure/survey_pictures.h"
#include "part_alignment/report/survey_report.h"
#include "part_alignment/survey/survey.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct SurveyArguments {
  std::vector<std::string> pictures;
  std::string scale_bars;
  std::string observations;
  std::optional<double> focal_length_px;
  int bits = 14;
  double extra_sigma_px = 0.005;
  bool plain = false;
  std::string surface;
  std::string keep_observations;
  std::string points;
  AnswerOptions answer;
};

bool IsPicture(const fs::path& path) {
  constexpr std::array<const char*, 5> kEndings = {".jpg", ".jpeg", ".png", ".tif", ".tiff"};
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

// Returns files in the given order; of a folder its pictures, by name.
Result<std::vector<fs::path>> PicturesOf(const std::vector<std::string>& names) {
  std::vector<fs::path> pictures;
  for (const std::string& name : names) {
    std::error_code error;
    if (!fs::is_directory(name, error)) {
      pictures.emplace_back(name);
      continue;
    }
    std::vector<fs::path> of_folder;
    for (const auto& entry : fs::directory_iterator(name, error)) {
      if (entry.is_regular_file(error) && IsPicture(entry.path()))
        of_folder.push_back(entry.path());
    }
    if (of_folder.empty()) {
      return Fail(fmt::format("{}: no picture (JPEG, PNG, TIFF) is in this folder", name));
    }
    std::sort(of_folder.begin(), of_folder.end());
    pictures.insert(pictures.end(), of_folder.begin(), of_folder.end());
  }
  return pictures;
}

// Reads the observations, and adds those of the pictures.
Result<procedure::SurveyReading> ReadObservations(const SurveyArguments& arguments) {
  if (arguments.observations.empty() && arguments.pictures.empty()) {
    return Fail("align survey takes pictures, --observations FILE, or both");
  }
  procedure::SurveyReading all;
  if (!arguments.observations.empty()) {
    all.pictures = TRY(files::ReadSurveyFile(arguments.observations));
  }
  if (arguments.pictures.empty()) return all;
  procedure::SurveyReadOptions options;
  options.book = TRY(part_alignment::MakeCodeBook(arguments.bits));
  options.extra_sigma_px = arguments.extra_sigma_px;
  options.plain = arguments.plain;
  const auto paths = TRY(PicturesOf(arguments.pictures));
  auto read = TRY(procedure::ReadSurveyPictures(
      paths, options, [](const std::string& line) { fmt::print(stderr, "{}\n", line); }));
  for (part_alignment::SurveyPicture& picture : read.pictures) {
    const auto same =
        std::ranges::find(all.pictures, picture.name, &part_alignment::SurveyPicture::name);
    if (same != all.pictures.end()) {
      return Fail(fmt::format("{}: {} has a picture of that name already", picture.name,
                              arguments.observations));
    }
    all.pictures.push_back(std::move(picture));
  }
  all.notices = std::move(read.notices);
  return all;
}

// Checks that a table of points can contain the name.
Result<void> CheckSurface(const std::string& surface) {
  if (surface.find_first_of(",;\t\n\r\"#") == std::string::npos) return {};
  return Fail(
      fmt::format("--surface {}: a name without comma, semicolon, tab, quote, # and line "
                  "end is needed",
                  surface));
}

Result<int> RunSurvey(const SurveyArguments& arguments) {
  const AnswerOptions& options = arguments.answer;
  TRY(CheckFree(options, {arguments.points, arguments.keep_observations}));
  TRY(CheckSurface(arguments.surface));
  part_alignment::SurveyInput input;
  input.focal_length_px = arguments.focal_length_px;
  if (!arguments.scale_bars.empty()) {
    input.bars = TRY(files::ReadScaleBarFile(arguments.scale_bars));
  }
  auto reading = TRY(ReadObservations(arguments));
  input.pictures = std::move(reading.pictures);
  if (!arguments.keep_observations.empty()) {
    TRY(WriteOutputs({{arguments.keep_observations, files::SurveyFileText(input.pictures)}},
                     options.force));
  }
  auto survey = TRY(part_alignment::SolveSurvey(input, {}));
  survey.notices.insert(survey.notices.end(), reading.notices.begin(), reading.notices.end());
  const bool good = survey.verdict == Verdict::kGood;
  Answer answer{survey.verdict, report::ToJson(survey), report::SurveyText(survey)};
  answer.report = [&] { return AnswerReport{report::SurveyPage(Today(), survey), {}}; };
  if (!options.out.empty()) answer.files.push_back({options.out, answer.json});
  if (good && !arguments.points.empty()) {
    answer.files.push_back({arguments.points, report::SurveyPoints(survey, arguments.surface)});
  }
  return GiveAnswer(options, answer);
}

}  // namespace

void AddAlignSurveyCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "survey", "coordinates of a part's targets, from pictures by a camera in hand");
  const auto arguments = std::make_shared<SurveyArguments>();
  command->add_option("pictures", arguments->pictures,
                      "picture files or folders, in the order in which they were taken");
  command->add_option(
      "--observations", arguments->observations,
      "what --keep-observations, or another program, found in pictures before these");
  command->add_option("--scale-bars", arguments->scale_bars,
                      "JSON with scale_bars: from, to, length_mm, sigma_mm; PART.json will do");
  command
      ->add_option("--focal-length", arguments->focal_length_px,
                   "roughly, px; without it, it is searched for")
      ->check(NumberIn(1, 1e6));
  command
      ->add_option("--bits", arguments->bits, "of the code: 12 (16 targets), 14 (44) or 20 (1022)")
      ->check(CLI::IsMember(std::vector<int>{12, 14, 20}))
      ->capture_default_str();
  AddNumber(*command, "--extra-sigma-px", arguments->extra_sigma_px,
            "of each centre beside the detector's own: lens, vibration", 0, 10);
  command->add_flag("--plain", arguments->plain,
                    "also plain white discs, matched over the pictures: P1, P2, …");
  command->add_option("--surface", arguments->surface,
                      "name of the surface for plain targets in the table of --points");
  command->add_option("--keep-observations", arguments->keep_observations,
                      "file for what the pictures show");
  command->add_option("--points", arguments->points,
                      "table of points for align fit, if the verdict is good");
  AddAnswerOptions(*command, arguments->answer, "file for the targets, if the verdict is good",
                   "folder for report.html");
  OnRun(*command, exit_code, [arguments] { return RunSurvey(*arguments); });
}

}  // namespace trammel::app
