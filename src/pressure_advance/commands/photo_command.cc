// trammel pa photo: measures a photo of a pattern, a file or from the printer.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/kept_history.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "files/new_file.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/apply_command.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/commands/photo_analysis.h"
#include "pressure_advance/commands/photo_reading.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/procedure/calibrate.h"
#include "service/job_record.h"
#include "session/print_needs.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using procedure::PatternPhoto;

constexpr const char* kPhotoName = "photo";  // in the recording; keeps its extension

struct PhotoArguments {
  std::vector<std::string> photos;
  LocalAnalysis local;  // of a photo on this computer; without a path: of one on the printer
  PrinterOptions printer;
  std::string file;
  std::string filament;
  std::string out;
};

/// Photo, with notices for the answer.
struct Fetched {
  PatternPhoto photo;
  std::vector<std::string> notices = {};  ///< an empty one is none
};

Result<FoundPlan> PlanFor(const PhotoArguments& arguments, const procedure::Session& session,
                          const std::optional<files::PatternPrint>& print) {
  if (arguments.local.photo.plan.empty() && !print) return FindUploadedPlan(session);
  auto plan = TRY(arguments.local.photo.plan.empty() ? PlanOfPrint(*print)
                                                     : ReadPhotoPlan(arguments.local.photo.plan));
  return FoundPlan{std::move(plan), ""};
}

Result<Fetched> FetchPhoto(const PhotoArguments& arguments, const procedure::Session& session,
                           const std::optional<files::PatternPrint>& print,
                           const fs::path& recordings) {
  auto photo = TRY(procedure::DownloadPhoto(session, arguments.file, service::IsResultPicture));
  if (!arguments.file.empty()) return Fetched{std::move(photo)};
  // The photo was not named, so it may show another filament.
  const std::string kept = kPhotoName + procedure::PictureEnding(photo.name);
  const auto before = TRY(FindKeptCopy(recordings, {&kept, 1}, photo.bytes));
  if (!before.empty()) {
    return Fail(
        fmt::format("{}, the newest photo there, was measured before ({}): upload a photo of "
                    "this pattern, or name that one once more (FILE=, --file)",
                    photo.name, before.string()));
  }
  auto notice = TRY(CheckPhotoIsOf(photo, print, arguments.filament));
  return Fetched{std::move(photo), {std::move(notice)}};
}

Result<int> Measure(const PhotoArguments& arguments, const procedure::Session& session,
                    const files::Config& config, const fs::path& folder, const Fetched& fetched,
                    const PhotoPlan& plan) {
  const PatternPhoto& photo = fetched.photo;
  const fs::path path = folder / (kPhotoName + procedure::PictureEnding(photo.name));
  TRY(files::WriteWholeFile(path, photo.bytes, files::IfThere::kRefuse));
  session.Report({.text = "analysing " + photo.name, .remaining_s = {}, .phase = "analysing"});
  auto run = AnalysePhoto(path, plan);
  if (!run) {
    return Fail(fmt::format("{}: {}", photo.name, run.error().message), run.error().kind);
  }
  for (const std::string& notice : fetched.notices) {
    if (!notice.empty()) run->analysis.notices.push_back(notice);
  }
  ResultFile result = ResultOf(run->analysis, folder.string());
  result.outcome.subject =
      SubjectOf(arguments.filament, session, config, SpoolNow(session, arguments.filament.empty()));
  const int code = PrintAnalysis(*run, result, KeptIn(folder, arguments.local.output.json));
  const Measured& measured = run->analysis.pressure_advance;
  if (arguments.local.output.json || !measured.good()) return code;
  fmt::print("photo             {}\n", photo.name);
  PrintDrift(fs::absolute(folder).parent_path(), result.outcome);
  PrintWrapped("nothing applied", fmt::format("trammel pa apply {}{}", ShellQuoted(folder.string()),
                                              PrinterOptionText(arguments.printer)));
  ExplainKeeping(measured.quantity().value, session);
  return code;
}

// Checks that the printer can have printed the pattern as planned, and that its answer is usable.
Result<void> CheckPrintable(const procedure::Session& session, const PhotoPlan& plan) {
  const auto facts = TRY(procedure::ReadFacts(session));
  procedure::PrintNeeds needs;
  needs.printed_before = true;
  for (const auto& segment : plan.segments) needs.motions.push_back({segment.speed_mm_s, 0});
  auto checks = CompareFacts(facts, needs);
  checks.push_back(procedure::ComparePressureAdvance(facts, facts.advance_names()));
  return FirstFailure(checks, ErrorKind::kSafety);
}

Result<int> RunPhoto(PhotoArguments arguments) {
  if (!arguments.photos.empty()) {
    if (!arguments.file.empty() || !arguments.out.empty() || !arguments.filament.empty()) {
      return Fail(
          "--file, --filament and --out are for a photo on the printer; leave out the "
          "names of photos");
    }
    arguments.local.path = arguments.photos.front();
    arguments.local.more.assign(arguments.photos.begin() + 1, arguments.photos.end());
    return RunLocalAnalysis(arguments.local);
  }
  PhotoReading beside_plan = arguments.local.photo;
  beside_plan.plan.clear();
  std::string option = FirstGiven(beside_plan);
  if (option.empty()) option = FirstOutput(arguments.local.output.files);
  if (!option.empty()) {
    return Fail(
        fmt::format("{} is for a photo on this computer; name it: trammel pa photo PHOTO", option));
  }
  const Interrupt interrupt;
  auto config = TRY(LoadSettings(arguments.printer));
  TRY(CheckFilamentOption(arguments.filament));
  const auto print =
      TRY(arguments.local.photo.plan.empty() ? LastNotedPrint(config.scan.address)
                                             : Result<std::optional<files::PatternPrint>>());
  if (arguments.filament.empty() && print) arguments.filament = print->filament;
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  const procedure::Session silent{*printer, interrupt.token(), {}};
  TRY(TakeStatedBy(silent, StatedFor::kPrinter, config));
  const auto folder = TRY(NewFolder::Make(arguments.out));
  auto photo =
      TRY(FetchPhoto(arguments, session, print, fs::absolute(folder.path()).parent_path()));
  auto plan = TRY(PlanFor(arguments, session, print));
  auto& printed_by = plan.plan.printed_by;
  if (!printed_by) printed_by = gcode::PrintedBy{};  // here, where Klipper is
  if (printed_by->dialect == gcode::Dialect::kKlipper) {
    TRY(CheckPrintable(session, plan.plan));
  }
  photo.notices.push_back(plan.notice);
  return Measure(arguments, session, config, folder.path(), photo, plan.plan);
}

}  // namespace

void AddPhotoCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "photo", "measure a photo of a pattern: a file, or the newest on the printer");
  const auto arguments = std::make_shared<PhotoArguments>();
  constexpr int kMaxPhotos = 100;
  command
      ->add_option("photo", arguments->photos,
                   "JPEG or PNG on this computer, several with --gcode: one for each pattern; left "
                   "out: the newest picture in the folder trammel beside printer.cfg")
      ->expected(0, kMaxPhotos);
  AddLocalAnalysisOptions(*command, arguments->local);
  AddPrinterOptions(*command, arguments->printer);
  AddMaterialOption(*command, arguments->printer.material);
  command->add_option("--file", arguments->file,
                      "its name in that folder; left out: the newest "
                      "picture there");
  command->add_option("--filament", arguments->filament,
                      "which filament it is: trammel history lists the result under it; without "
                      "it, the one that the pattern was printed for, else that of Spoolman's "
                      "active spool");
  command->add_option("-o,--out", arguments->out, "new folder for photo and result");
  command->add_flag("--json", arguments->local.output.json, "print the answer as one JSON object");
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunPhoto(*arguments)); });
}

}  // namespace trammel::app
