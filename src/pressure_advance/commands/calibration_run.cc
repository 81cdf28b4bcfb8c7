#include "pressure_advance/commands/calibration_run.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/recorded_frames.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"
#include "session/uploads.h"
#include "settings/material.h"

namespace trammel::app {

void AddKeepFullOption(CLI::App& command, bool& keep_full) {
  command.add_flag("--keep-full", keep_full,
                   "keep every frame of the recording whole, some 150 MB instead of 5");
}

procedure::CalibrationRequest RequestFor(const files::Config& config,
                                         std::filesystem::path folder) {
  procedure::CalibrationRequest request;
  request.pattern = config.pattern;
  request.settings = config.scan;
  request.folder = std::move(folder);
  request.identity.started = UtcNow();
  request.identity.run = NewRunName();
  return request;
}

Result<void> ReportEnd(const Result<void>& done, const std::vector<std::string>& unrestored,
                       const std::filesystem::path& folder, const char* so_far) {
  for (const std::string& failure : unrestored) {
    fmt::print(stderr, "trammel: NOT AS IT WAS: {}\n", failure);
  }
  std::error_code ignored;
  if (!done && !std::filesystem::is_empty(folder, ignored)) {
    fmt::print(stderr, "trammel: {} {}\n", so_far, folder.string());
  }
  if (!done || unrestored.empty()) return done;
  return Fail(fmt::format("the printer is not as it was: {}", fmt::join(unrestored, "; ")),
              ErrorKind::kMachine);
}

CalibrationRun CalibrateInto(const procedure::Session& session,
                             procedure::CalibrationRequest request) {
  request.note_print = [&](bool ended) { return NotePrint(session, request, ended); };
  const procedure::CalibrationOutcome outcome = Calibrate(session, request);
  return {
      ReportEnd(outcome.done, outcome.unrestored, request.folder, "what was recorded so far is in"),
      outcome.done.has_value(), outcome.bed_c};
}

void CutRecordings(const std::vector<std::filesystem::path>& folders, const std::stop_token& stop) {
  std::fflush(stdout);  // the answer, before some seconds of cutting
  for (const std::filesystem::path& folder : folders) {
    for (const std::string& line : procedure::CutRecording(folder, stop)) {
      fmt::print(stderr, "trammel: {}\n", line);
    }
  }
}

Result<void> FitForDryRun(const PrinterOptions& options, const std::stop_token& stop,
                          files::Config& config) {
  if (options.address.empty() && !config.IsSet("moonraker.address")) return {};
  constexpr double kPatience_s = 3;
  const auto printer = Connect(config.scan, stop, kPatience_s);
  if (!printer) {
    const std::string& why = printer.error().message;
    fmt::print(stderr, "  the printer was not asked what it states of itself: {}\n",
               why.substr(0, why.find('\n')));
    return {};
  }
  const procedure::Session session{**printer, stop, ShowProgress};
  TRY(FitPattern(session, config));
  const auto facts = TRY(procedure::ReadFacts(session));
  return FirstFailure(CompareFacts(facts, procedure::NeedsOf({config.pattern})),
                      ErrorKind::kSafety);
}

Result<void> PrintDryRun(pressure_advance::PatternConfig pattern,
                         const settings::ScanSettings& settings, const DryRun& shown) {
  if (shown.print) {
    TRY(trammel::settings::ValidateTemperatures(pattern));
  }
  if (shown.for_photo) {
    fmt::print("; --- print ---\n{}", WriteGcode(LayOut(pattern), pattern));
    return {};
  }
  pattern.finish = pressure_advance::Finish::kIdle;  // as printed: the scan follows
  const procedure::Reach bed = BedOf(pattern);
  if (shown.print && shown.scan) pattern = procedure::ParkedForScan(pattern, settings, bed);
  const auto layout = LayOut(pattern);
  const auto sweeps =
      TRY(procedure::PlanSweeps(MakePlan(layout, pattern, "pattern.gcode"), {}, settings, bed));
  if (shown.print) fmt::print("; --- print ---\n{}", WriteGcode(layout, pattern));
  if (shown.scan) {
    const procedure::ScanTime time =
        TimeOf(sweeps, pattern, pattern.acceleration_mm_s2, ParkPoint(pattern));
    fmt::print("; --- scan, about {:.0f} s{} ---\n{}", time.total_s(),
               settings.scan_nozzle_temperature_c > 0
                   ? fmt::format(", nozzle at {:.4g} degC", settings.scan_nozzle_temperature_c)
                   : ", nozzle off",
               procedure::DescribeSweeps(sweeps, settings, pattern.travel_speed_mm_s));
  }
  return {};
}

namespace fs = std::filesystem;

namespace {

constexpr const char* kNameThePlan =
    "Name the plan that pa pattern wrote with the G-code (--plan FILE), the slicer's file (--gcode "
    "FILE), or give the values (--pa START:END:STEP, --segments)";

fs::path PlanFileOf(const files::PatternPrint& print) {
  return fs::path(print.folder) / "pattern.plan.json";
}

Result<pressure_advance::PatternPlan> PatternOfPrint(const files::PatternPrint& print) {
  auto plan = ReadPatternPlan(PlanFileOf(print));
  if (plan) return plan;
  return Fail(fmt::format("the plan of the pattern that was printed {} cannot be read, and without "
                          "it nobody knows its values: {}; print the pattern anew, or name the "
                          "plan with --plan",
                          print.utc, plan.error().message),
              plan.error().kind);
}

std::string CannotTell(const std::string& photo) {
  return fmt::format("cannot tell which values the lines of {} were printed with: ", photo);
}

struct NamedPlan {
  std::string name;
  Result<PhotoPlan> plan;
};

bool SameLines(const PhotoPlan& a, const PhotoPlan& b) {
  const auto same = [](const pressure_advance::Segment& x, const pressure_advance::Segment& y) {
    return x.fraction == y.fraction && x.speed_mm_s == y.speed_mm_s;
  };
  return a.pressure_advance_s == b.pressure_advance_s && a.corner_mark == b.corner_mark &&
         std::equal(a.segments.begin(), a.segments.end(), b.segments.begin(), b.segments.end(),
                    same);
}

/// Returns the plan on which all readable ones agree; absent if there is none.
Result<std::optional<FoundPlan>> OnlyOne(const std::string& photo, const std::string& where,
                                         std::vector<NamedPlan> plans) {
  std::optional<Error> unreadable;
  NamedPlan* first = nullptr;
  for (NamedPlan& each : plans) {
    if (!each.plan) {
      if (!unreadable) unreadable = each.plan.error();
    } else if (first == nullptr) {
      first = &each;
    } else if (!SameLines(*first->plan, *each.plan)) {
      return Fail(fmt::format("{}{} and {}, {}, have different ones. {}", CannotTell(photo),
                              first->name, each.name, where, kNameThePlan));
    }
  }
  if (first == nullptr && unreadable) return tl::unexpected(*unreadable);
  if (first == nullptr) return std::nullopt;
  const auto& values = first->plan->pressure_advance_s;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  std::string notice =
      fmt::format("the values of the lines ({} from {:g} to {:g} s) are those of {}, {}",
                  values.size(), *least, *most, first->name, where);
  return FoundPlan{std::move(*first->plan), std::move(notice)};
}

Result<std::optional<FoundPlan>> PlanBeside(const fs::path& photo) {
  constexpr std::size_t kMaxPlans = 100;
  const fs::path folder = photo.has_parent_path() ? photo.parent_path() : fs::path(".");
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (IsPlanName(at->path().filename().string()) && at->is_regular_file(ignored)) {
      files.push_back(at->path());
    }
    if (files.size() > kMaxPlans) {
      return Fail(fmt::format("{}more than {} plans lie beside it. {}",
                              CannotTell(photo.filename().string()), kMaxPlans, kNameThePlan));
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<NamedPlan> plans;
  for (const fs::path& file : files) {
    plans.push_back({file.filename().string(), ReadPhotoPlan(file)});
  }
  return OnlyOne(photo.filename().string(), "beside the photo", std::move(plans));
}

/// Returns a file's time of storage, by this computer's clock.
std::string StoredUtc(const fs::path& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 ? UtcOf(static_cast<double>(found.st_mtim.tv_sec)) : "";
}

Result<std::optional<FoundPlan>> PlanOfLastPrint(const fs::path& photo) {
  const auto folder = TRY(files::StateFolder());
  const auto prints =
      TRY(files::LastPatternPrints(folder / files::kPatternPrintsFile, files::PrintsFor::kPhoto));
  const std::string name = photo.filename().string();
  const std::string stored = StoredUtc(photo);
  std::vector<NamedPlan> plans;
  const files::PatternPrint* older = nullptr;
  for (const auto& [printer, print] : prints) {
    if (stored < print.utc) {
      older = &print;
      continue;
    }
    plans.push_back({PlanFileOf(print).string(), PlanOfPrint(print)});
  }
  if (plans.empty() && older != nullptr) {
    return Fail(fmt::format("{}it is of {}, older than the pattern's last print ({}, {}). {}",
                            CannotTell(name), stored, older->utc, older->folder, kNameThePlan));
  }
  return OnlyOne(name, "of the last print that is noted: look whether the photo is of that print",
                 std::move(plans));
}

}  // namespace

Result<void> NotePrint(const procedure::Session& session, const procedure::CalibrationRequest& run,
                       bool ended) {
  if (ended && !run.for_photo) return {};  // a scan compares no times
  const auto folder = files::StateFolder();
  const auto server_s = run.for_photo ? procedure::ServerTime_s(session) : std::optional<double>();
  Result<void> noted;
  if (!folder) {
    noted = tl::unexpected(folder.error());
  } else if (ended && !server_s) {
    noted = Fail("the printer's server does not tell its time", ErrorKind::kMachine);
  } else {
    noted = files::NotePatternPrint(
        *folder / files::kPatternPrintsFile,
        {UtcNow(), procedure::PrinterName(run.settings.address), fs::absolute(run.folder).string(),
         run.filament, ended, server_s, run.for_photo});
  }
  if (noted) return {};
  if (!ended) {
    return Fail(fmt::format("nothing is printed, as it cannot be noted which pattern was, and "
                            "when, by which photos and scans are read: {}",
                            noted.error().message),
                noted.error().kind);
  }
  fmt::print(stderr, "  not noted when the print ended, only when it began: {}\n",
             noted.error().message);
  return {};
}

Result<std::optional<files::PatternPrint>> LastNotedPrint(const std::string& address) {
  const auto folder = TRY(files::StateFolder());
  return files::LastPatternPrint(folder / files::kPatternPrintsFile,
                                 procedure::PrinterName(address), files::PrintsFor::kPhoto);
}

Result<PhotoPlan> PlanOfPrint(const files::PatternPrint& print) {
  const auto plan = TRY(PatternOfPrint(print));
  return PhotoPlanOf(plan, PlanFileOf(print).string());
}

Result<LyingPattern> FindLyingPattern(const std::string& address) {
  const auto folder = TRY(files::StateFolder());
  const std::string printer = procedure::PrinterName(address);
  auto print = TRY(files::LastPatternPrint(folder / files::kPatternPrintsFile, printer,
                                           files::PrintsFor::kEither));
  if (!print) {
    return Fail(
        fmt::format("cannot tell which pattern lies on the bed: no print of one is noted for {}. "
                    "Name the plan that pa pattern wrote with the G-code (--plan FILE)",
                    printer));
  }
  auto plan = TRY(PatternOfPrint(*print));
  return LyingPattern{std::move(*print), std::move(plan)};
}

Result<std::optional<FoundPlan>> FindPlanOf(const fs::path& photo) {
  auto beside = TRY(PlanBeside(photo));
  return beside ? Result<std::optional<FoundPlan>>(std::move(beside)) : PlanOfLastPrint(photo);
}

Result<FoundPlan> FindUploadedPlan(const procedure::Session& session) {
  const auto uploads = TRY(procedure::ListUploads(session, IsPlanName));
  std::vector<NamedPlan> plans;
  for (const procedure::UploadedFile& upload : uploads) {
    const auto text = TRY(procedure::DownloadUpload(session, upload.name, kMaxPlanFileBytes));
    plans.push_back({upload.name, ParsePhotoPlan(text, upload.name)});
  }
  auto plan = TRY(OnlyOne("the photo", "beside it", std::move(plans)));
  if (plan) return std::move(*plan);
  return Fail(
      fmt::format("{}no print of a pattern is noted for this printer (pa print --photo, "
                  "TRAMMEL_PA_PATTERN), and no plan lies beside it. Name the *.plan.json "
                  "that pa pattern wrote with --plan, or upload it into the folder {}",
                  CannotTell("the photo"), procedure::kUploadFolder));
}

Result<std::string> CheckPhotoIsOf(const procedure::PatternPhoto& photo,
                                   const std::optional<files::PatternPrint>& print,
                                   const std::string& filament) {
  if (!print) {
    return fmt::format("{}: look whether {} is its photo", kNoPrintNoted, photo.name);
  }
  if (!MayBeSameFilament(print->filament, filament)) {
    return Fail(
        fmt::format("the pattern was printed for the filament '{}', and the photo {} would "
                    "be measured for '{}': say that filament, or name the photo (FILE=, "
                    "--file)",
                    print->filament, photo.name, filament));
  }
  if (!print->server_s || !photo.stored_s) {
    return fmt::format("{} by the clock of the printer's files: look whether {} is its photo",
                       kNoPrintNoted, photo.name);
  }
  if (*photo.stored_s >= *print->server_s) return std::string();
  return Fail(
      fmt::format("{}, the newest photo there, is of {}, and the pattern's print {} {} by "
                  "the same clock: upload a photo of this pattern, or name that one (FILE=, "
                  "--file)",
                  photo.name, UtcOf(*photo.stored_s), print->ended ? "ended" : "began",
                  UtcOf(*print->server_s)));
}

}  // namespace trammel::app
