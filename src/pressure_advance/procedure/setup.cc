#include "pressure_advance/procedure/setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "files/new_file.h"
#include "pressure_advance/procedure/calibrate.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "pressure_advance/procedure/setup_route.h"
#include "pressure_advance/setup/stripe_reading.h"
#include "session/checks.h"
#include "session/print.h"
#include "settings/material.h"
#include "vision/laser_line.h"

namespace trammel::procedure {
namespace {

using pressure_advance::HeadPlace;
using pressure_advance::MarkReading;
using pressure_advance::PlacedStripe;
using pressure_advance::SetupResult;
using pressure_advance::StripeSweep;

constexpr double kAsk_s = 10;
constexpr const char* kMarkGcode = "mark.gcode";
constexpr double kWideHalf_mm = 4, kWideStep_mm = 1;    // a focus guessed by 1 mm is well inside
constexpr double kFineHalf_mm = 4, kFineStep_mm = 0.5;  // a halo hides how the width bends nearby
constexpr int kMaxSweeps = 4;                           // to find the focus
constexpr double kStep_mm = 1.5;  // of the head, to learn the mark's motion in the picture
constexpr double kStop_s = 2;     // about, from one picture to the next

struct Run {
  const SetupRequest& request;
  SetupReader& reader;
  SetupRecord& record;
  vision::LaserLineWorkspace workspace;
};

void ReportPictures(const Session& session, std::string text, std::size_t pictures) {
  session.Report({.text = std::move(text),
                  .remaining_s = kStop_s * static_cast<double>(pictures),
                  .phase = "scanning",
                  .done = {}});
}

// Reads the stripe at each height; its direction comes from the first picture that shows it.
Result<std::vector<PlacedStripe>> SweepStripe(Run& run, const std::vector<HeadPlace>& places,
                                              const std::string& name) {
  std::vector<PlacedStripe> stripes;
  std::optional<bool> down;
  for (std::size_t i = 0; i < places.size(); ++i) {
    auto picture =
        TRY(run.reader.Look(places[i], SetupLight::kLaser, fmt::format("{}-{:02}", name, i + 1)));
    const bool runs_down = down ? *down : pressure_advance::StripeRunsDown(picture.view());
    auto reading = pressure_advance::ReadStripe(picture.view(), runs_down, run.workspace);
    if (reading.fault.empty()) down = runs_down;
    stripes.push_back({places[i], std::move(reading)});
    run.record.seen.picture = {picture.width, picture.height};
  }
  return stripes;
}

// Sets the same reason for every missing value.
void EndWith(const Measured& why, SetupResult& result) {
  result.focus_mm = result.scale.px_per_mm = result.scale.rotation_rad =
      result.scale.backlash_x_mm = result.scale.backlash_y_mm = result.offset.x_mm =
          result.offset.y_mm = why;
  result.height.px_per_height_mm = result.height.laser_angle_rad = result.height.backlash_z_mm =
      why;
  result.scan_angle_rad = result.laser_turn_rad = why;
}

// Returns the middle of the next sweep, if the stripe became sharper towards this one's end.
std::optional<double> LookFurther(const StripeSweep& sweep, double middle_mm,
                                  const ClearHeights& clear) {
  if (sweep.focus_mm.good() || !sweep.sharpest_mm) return std::nullopt;
  constexpr double kMin_mm = 1.5;
  const double half_mm = kWideHalf_mm + kApproach_mm;
  const double next_mm =
      clear.high_mm - clear.low_mm < 2 * half_mm
          ? middle_mm
          : std::clamp(*sweep.sharpest_mm, clear.low_mm + half_mm, clear.high_mm - half_mm);
  if (std::abs(next_mm - middle_mm) < kMin_mm) return std::nullopt;
  return next_mm;
}

Measured WithClearHeights(const Measured& focus, const ClearHeights& clear) {
  if (focus.good() || focus.verdict() != Verdict::kCannotTell) return focus;
  return Measured::CannotTell(
      fmt::format("{}; --clear-z lets the nozzle go from {:.4g} to {:.4g} mm: name a greater range "
                  "if there is room, or mount the camera so that it is sharp within it",
                  focus.reason(), clear.low_mm, clear.high_mm));
}

// Searches the focus over the empty plate. Good: a height; else the record has the reason.
Result<std::optional<double>> FindFocus(Run& run, HeadPlace at) {
  const Session& session = run.reader.session();
  Measured focus;
  for (int sweep = 1; sweep <= kMaxSweeps; ++sweep) {
    const auto places = SweepHeights(at, kWideHalf_mm, kWideStep_mm, run.reader.clear());
    ReportPictures(session,
                   fmt::format("looking at the laser from {:.1f} to {:.1f} mm, {} pictures",
                               places.front().z_mm, places[places.size() / 2].z_mm, places.size()),
                   places.size());
    auto stripes = TRY(SweepStripe(run, places, fmt::format("plate-{}", sweep)));
    const StripeSweep solved = SolveSweep(stripes);
    run.record.first_sweep = std::move(stripes);
    if (solved.focus_mm.good()) return solved.focus_mm.quantity().value;
    focus = solved.focus_mm;
    const auto next_mm = LookFurther(solved, at.z_mm, run.reader.clear());
    if (!next_mm) break;
    at.z_mm = *next_mm;
  }
  run.record.seen.stripes = run.record.first_sweep;
  EndWith(WithClearHeights(focus, run.reader.clear()), run.record.result);
  return std::nullopt;
}

Result<void> PrintMark(const Run& run, const machine::PrinterState& before) {
  const Session& session = run.reader.session();
  const SetupRequest& request = run.request;
  const std::string gcode = WriteMarkGcode(run.record.mark, request.pattern);
  TRY(files::WriteWholeFile(request.folder / kMarkGcode, gcode, files::IfThere::kRefuse));
  PrintOptions options;
  options.heat_time_limit_s = request.settings.heat_time_limit_s;
  options.print_time_s = MarkTime_s(run.record.mark, request.pattern);
  session.Report("to be heated to " + settings::DescribeTemperatures(request.pattern));
  const auto temperatures = settings::TemperaturesOf(request.pattern);
  options.nozzle_temperature_c = temperatures.nozzle_c;
  options.bed_temperature_c = temperatures.bed_c;
  TRY(Print(session, gcode, options));
  TRY(KeepAlive(session));
  return CoolForScan(session, before, request.settings.scan_nozzle_temperature_c,
                     request.settings.heat_time_limit_s);
}

struct FoundMark {
  HeadPlace head;
  MarkReading reading;
};

Result<MarkReading> LookAtMark(Run& run, const HeadPlace& place, const std::string& name) {
  auto picture = TRY(run.reader.Look(place, SetupLight::kRoom, name));
  return ReadMark(picture.view(), run.record.mark.shape);
}

// Searches the mark around its expected position. If it is missing, the record has the reason.
Result<std::optional<FoundMark>> SearchMark(Run& run, const HeadPlace& expected) {
  const auto& size = run.record.seen.picture;
  // Two thirds of the typical field of view, so that the mark is whole in one of two pictures.
  constexpr double kPx_per_mm = 45;
  const auto step = [](int px) { return std::clamp(0.6 * px / kPx_per_mm, 2.0, 8.0); };
  const auto places = SearchPlaces(expected, step(size.width_px), step(size.height_px));
  std::string first_fault;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!CheckPlace(places[i], run.reader.clear(), run.reader.reach())) continue;
    const auto seen = TRY(LookAtMark(run, places[i], fmt::format("search-{:02}", i + 1)));
    if (seen.fault.empty()) return FoundMark{places[i], seen};
    if (first_fault.empty()) first_fault = seen.fault;
    if (seen.blind) break;
    if (i == 0)
      ReportPictures(run.reader.session(), "looking for the mark round about", places.size());
  }
  run.record.seen.mark_fault = fmt::format(
      "the mark was not found where the camera looks, nor round about: {}; take filament of "
      "another colour than the plate, give more light, or compare the pictures in the "
      "folder with [camera] offset_x and offset_y",
      first_fault);
  return std::nullopt;
}

// Moves the head by one step, to whichever side keeps the mark in the picture.
Result<std::optional<FoundMark>> StepAside(Run& run, const FoundMark& from, double x, double y,
                                           const std::string& name) {
  for (const double side : {1.0, -1.0}) {
    HeadPlace place = from.head;
    place.x_mm += side * x * kStep_mm;
    place.y_mm += side * y * kStep_mm;
    if (!CheckPlace(place, run.reader.clear(), run.reader.reach())) continue;
    const auto seen =
        TRY(LookAtMark(run, place, fmt::format("{}-{}", name, side > 0 ? "up" : "down")));
    if (seen.fault.empty()) return FoundMark{place, seen};
  }
  return std::nullopt;
}

// Moves the mark to the picture's centre, whatever the camera's rotation or mirroring.
Result<std::optional<FoundMark>> CentreMark(Run& run, const FoundMark& found) {
  const auto along_x = TRY(StepAside(run, found, 1, 0, "step-x"));
  const auto along_y = TRY(StepAside(run, found, 0, 1, "step-y"));
  auto& fault = run.record.seen.mark_fault;
  if (!along_x || !along_y) {
    fault = fmt::format(
        "the mark leaves the picture when the head moves by {:.2g} mm: the camera "
        "shows too little of the plate; move it away, or let it send larger "
        "pictures",
        kStep_mm);
    return std::nullopt;
  }
  const double dx = along_x->head.x_mm - found.head.x_mm;
  const double dy = along_y->head.y_mm - found.head.y_mm;
  const MarkMotion motion{(along_x->reading.column_px - found.reading.column_px) / dx,
                          (along_x->reading.row_px - found.reading.row_px) / dx,
                          (along_y->reading.column_px - found.reading.column_px) / dy,
                          (along_y->reading.row_px - found.reading.row_px) / dy};
  const double px_per_mm = found.reading.side_px / run.record.mark.shape.side_mm;
  constexpr double kMin = 0.25;  // of the expected determinant if both axes are followed
  if (std::abs(motion.determinant()) < kMin * px_per_mm * px_per_mm) {
    fault = fmt::format(
        "the mark does not follow the head: a millimetre of x moves it by ({:+.1f}, {:+.1f}) px, "
        "one of y by ({:+.1f}, {:+.1f}) px, and the mark's own size says {:.1f} px; the camera "
        "hangs loose, an axis does not move, or something else was taken for the mark",
        motion.column_per_x, motion.row_per_x, motion.column_per_y, motion.row_per_y, px_per_mm);
    return std::nullopt;
  }
  const auto& size = run.record.seen.picture;
  const HeadPlace middle = BringMark(found.head, found.reading, 0.5 * (size.width_px - 1),
                                     0.5 * (size.height_px - 1), motion);
  const auto seen = TRY(LookAtMark(run, middle, "middle"));
  if (seen.fault.empty()) {
    return FoundMark{
        BringMark(middle, seen, 0.5 * (size.width_px - 1), 0.5 * (size.height_px - 1), motion),
        seen};
  }
  fault = "the mark was to come to the picture's middle, and is not there: " + seen.fault;
  return std::nullopt;
}

// Photographs the mark from sixteen positions.
Result<void> LookFromGrid(Run& run, const FoundMark& middle) {
  auto& seen = run.record.seen;
  const double half_mm = GridHalf_mm(middle.reading, run.record.mark.shape, seen.picture);
  constexpr double kMin_mm = 1;
  if (half_mm < kMin_mm) {
    seen.mark_fault = fmt::format(
        "a picture of {}x{} px, in which a side of the mark has {:.0f} px, leaves {:.1f} mm to "
        "move it about, {:.0f} mm are needed: let the camera send larger pictures",
        seen.picture.width_px, seen.picture.height_px, middle.reading.side_px,
        std::max(0.0, half_mm), kMin_mm);
    return {};
  }
  const auto places = GridPlaces(middle.head, half_mm);
  ReportPictures(run.reader.session(),
                 fmt::format("looking at the mark from {} places", places.size()), places.size());
  std::string fault;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto mark = TRY(LookAtMark(run, places[i], fmt::format("mark-{:02}", i + 1)));
    if (mark.fault.empty()) {
      seen.marks.push_back({places[i], mark.column_px, mark.row_px});
    } else {
      fault = mark.fault;
    }
  }
  if (seen.marks.size() < places.size()) {
    seen.mark_fault = fmt::format("the mark was read from {} of {} places: {}", seen.marks.size(),
                                  places.size(), fault);
  }
  return {};
}

Result<void> LookAtMarks(Run& run) {
  const auto& settings = run.request.settings;
  HeadPlace expected;
  expected.x_mm = run.record.mark.x_mm - settings.camera_offset_x_mm;
  expected.y_mm = run.record.mark.y_mm - settings.camera_offset_y_mm;
  expected.z_mm = run.record.seen.height_mm;
  ReportPictures(run.reader.session(), "looking for the mark", 4);
  const auto found = TRY(SearchMark(run, expected));
  if (!found) return {};
  const auto middle = TRY(CentreMark(run, *found));
  if (!middle) return {};
  return LookFromGrid(run, *middle);
}

// Reads the stripe beside the mark, on the plate after heating.
Result<void> SweepBesideMark(Run& run, HeadPlace at, double focus_mm) {
  const auto& clear = run.reader.clear();
  const auto rounded = [](double mm) { return std::round(100 * mm) / 100; };
  at.z_mm = rounded(focus_mm);
  const auto places = SweepHeights(at, kFineHalf_mm, kFineStep_mm, clear);
  ReportPictures(run.reader.session(),
                 fmt::format("looking at the laser beside the mark, {} pictures", places.size()),
                 places.size());
  auto stripes = TRY(SweepStripe(run, places, "stripe"));
  auto& seen = run.record.seen;
  seen.stripes = std::move(stripes);
  const Measured focus = SolveSweep(seen.stripes).focus_mm;
  seen.height_mm = focus.good() ? rounded(focus.quantity().value) : at.z_mm;
  if (!focus.good()) {
    seen.mark_fault = "the mark was not looked at, because the laser was not: " + focus.reason();
  }
  return {};
}

// Photographs the mark under the laser, in both lights.
Result<void> TryOffset(Run& run) {
  SetupRecord& record = run.record;
  const auto& offset = record.result.offset;
  if (!offset.x_mm.good() || !offset.y_mm.good()) return {};
  HeadPlace place;
  place.x_mm = record.mark.x_mm - offset.x_mm.quantity().value;
  place.y_mm = record.mark.y_mm - offset.y_mm.quantity().value;
  place.z_mm = record.seen.height_mm;
  place.from_x = place.from_y = 1;
  ReportPictures(run.reader.session(), "bringing the mark to the laser, as a trial", 2);
  const auto reading = TRY(LookAtMark(run, place, "lit"));
  CheckSpot(reading, record.result);
  TRY(run.reader.Look(place, SetupLight::kLaser, "laser"));
  return run.reader.LightRoom();
}

Result<void> RunSetup(const Session& session, const SetupRequest& request, PrinterStateGuard& guard,
                      const OpenedCamera& opened, SetupRecord& record) {
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  const auto reach = TRY(ReachOf(session));
  record.camera = opened.Describe();
  SetupReader reader(session, opened, request.pattern, request.settings, request.clear, reach,
                     request.folder);
  Run run{request, reader, record, {}};
  auto beside = TRY(PlaceBesideMark(record.mark, request.settings, reader.reach()));
  guard.ExpectLaser();
  const auto focus_mm = TRY(FindFocus(run, beside));
  if (!focus_mm) return {};
  TRY(reader.LightRoom());
  TRY(PrintMark(run, state));
  TRY(SweepBesideMark(run, beside, *focus_mm));
  if (record.seen.mark_fault.empty()) {
    TRY(LookAtMarks(run));
  }
  record.result = SolveSetup(record.seen);
  return TryOffset(run);
}

Result<pressure_advance::MarkPlan> MarkOf(const SetupRequest& request) {
  return PlanMark(request.pattern, request.mark, request.settings.camera_offset_x_mm,
                  request.settings.camera_offset_y_mm);
}

// That the printer can do what the request asks for. Moves nothing.
Result<void> CheckSetup(const Session& session, const SetupRequest& request) {
  TRY(settings::ValidateTemperatures(request.pattern));
  const auto mark = TRY(MarkOf(request));
  auto checks = CheckLaserCommands(session, request.pattern, request.settings);
  TRY(FirstFailure(checks, ErrorKind::kMachine));
  const auto facts = TRY(ReadFacts(session));
  PrintNeeds needs = NeedsOf({request.pattern});
  needs.motions.clear();  // those of the pattern's lines
  needs.sets_pressure_advance = false;
  checks = CompareFacts(facts, needs);
  checks.push_back(CompareTemperatures(facts, request.pattern));
  TRY(FirstFailure(checks, ErrorKind::kSafety));
  const Reach& reach = facts.reach;
  TRY(CheckClearHeights(request.clear, request.settings, reach));
  const auto beside = TRY(PlaceBesideMark(mark, request.settings, reach));
  HeadPlace middle = beside;
  middle.y_mm = mark.y_mm - request.settings.camera_offset_y_mm;
  for (const double side : {-1.0, 1.0}) {  // sixteen places about a camera that sits elsewhere
    constexpr double kAbout_mm = 9;
    HeadPlace place = middle;
    place.x_mm += side * kAbout_mm;
    place.y_mm += side * kAbout_mm;
    TRY(CheckPlace(place, request.clear, reach));
  }
  constexpr double kPictures = 100;
  return FirstFailure({CheckDisk(request.folder, kPictures / request.settings.frames_per_s,
                                 request.settings.frames_per_s)},
                      ErrorKind::kInput);
}

}  // namespace

SetupOutcome SetUpCamera(const Session& asked, const SetupRequest& request) {
  SetupOutcome outcome;
  Session session = asked;
  SetupRecord& record = outcome.record;
  EndWith(Measured::Refused("nothing was looked at"), record.result);
  if (auto mark = MarkOf(request); mark) record.mark = *mark;
  record.seen.mark_x_mm = record.mark.x_mm;
  record.seen.mark_y_mm = record.mark.y_mm;
  record.seen.line_width_mm = request.pattern.line_width_mm;
  record.seen.layer_height_mm = request.pattern.layer_height_mm;
  record.seen.height_mm = request.settings.focus_height_mm;
  GuardedRun run;
  run.pattern = &request.pattern;
  run.settings = &request.settings;
  run.identity = request.identity;
  run.check = [&](const Session& taken) { return CheckSetup(taken, request); };
  run.steps = [&](const Session& taken, PrinterStateGuard& guard, const OpenedCamera& reader) {
    return RunSetup(taken, request, guard, reader, record);
  };
  static_cast<GuardedOutcome&>(outcome) = RunGuarded(session, run);
  return outcome;
}

}  // namespace trammel::procedure
