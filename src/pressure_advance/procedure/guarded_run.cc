#include "pressure_advance/procedure/guarded_run.h"

#include <fmt/format.h>

#include <utility>

#include "base/utf8.h"
#include "session/dead_run.h"
#include "session/name_stop.h"
#include "session/run_journal.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using settings::ScanSettings;

constexpr double kAsk_s = 10;
constexpr double kHome_s = 300;
constexpr double kStall_s = 5;
constexpr std::size_t kLongestCameraName = 500;
constexpr int kJpegQuality = 95;  // of pictures that a camera sends as raw pixels

Result<void> Home(const Session& session) {
  if (auto free = CheckStillFree(session); !free) return free;
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return tl::unexpected(state.error());
  for (const char axis : std::string("xyz")) {
    if (state->homed_axes.find(axis) == std::string::npos) {
      session.Tell({.text = "homing", .remaining_s = {}, .phase = "homing"});
      return session.printer.Run("G28", session.Within(kHome_s));
    }
  }
  return {};
}

// Klipper answers calls for a moment longer than it does what they ask: where it stops or restarts
// right after a failure, that is the reason.
Result<void> WithReason(const Session& session, Result<void> done) {
  constexpr double kSettle_s = 0.7;
  if (done || done.error().kind != ErrorKind::kMachine) return done;
  const auto left = session.printer.WaitUntil(
      [](const machine::PrinterState& state) {
        return state.readiness != machine::PrinterReadiness::kReady;
      },
      "the printer to settle", {kSettle_s});
  if (!left) return done;
  const std::string reason =
      fmt::format("the printer went to \"{}\" in the middle: ", ToString(left->readiness));
  if (done.error().message.starts_with(reason)) return done;
  return Fail(reason + done.error().message, ErrorKind::kMachine);
}

// A printer without a limit is used all the same, by somebody who knows that it has none.
void SayWhereThereIsNoLimit(const Session& session) {
  if (session.has_limit) return;
  session.Say(
      fmt::format("the printer has no {} (klipper/trammel.cfg): its heaters have no limit "
                  "of their own should this program die, so stay beside it",
                  kKeepAlive));
}

// Named at its cause, whatever failed in consequence.
Result<void> NameRestart(Result<void> done, bool restarted) {
  if (done || !restarted || done.error().kind == ErrorKind::kInterrupted) return done;
  return Fail("the printer was restarted in the middle: " + done.error().message,
              ErrorKind::kMachine);
}

ParkPlace ParkPlaceOf(const PatternConfig& config) {
  const auto park = settings::ParkPositionOf(config);
  return {config.park_lift_mm, park.x_mm, park.y_mm, config.z_speed_mm_s, config.travel_speed_mm_s};
}

// A camera that sends pictures, or nothing where none is wanted.
Result<Eye> OpenEye(const Session& session, const GuardedRun& run) {
  Eye eye;
  if (!run.looks) return eye;
  session.Tell({.text = "looking at the camera", .remaining_s = {}, .phase = "checking"});
  auto opened = OpenCamera(session, *run.settings);
  if (!opened) return tl::unexpected(opened.error());
  eye.camera = std::move(*opened);
  eye.recorder = std::make_unique<FrameRecorder>(*eye.camera, kStall_s);
  const auto picture = eye.recorder->NextFrame(kStall_s, session.stop);
  if (!picture) return tl::unexpected(picture.error());
  return eye;
}

// Ends what a dead run still prints, then looks at everything that can be looked at unmoved.
Result<void> Check(const Session& session, const GuardedRun& run,
                   const std::filesystem::path& state_folder) {
  session.Tell({.text = "checking the printer", .remaining_s = {}, .phase = "checking"});
  if (run.prints) {
    auto ended =
        EndDeadPrint(session, state_folder, run.settings->address, ParkPlaceOf(*run.pattern));
    if (!ended) return ended;
  }
  return run.check(session);
}

Result<void> RunBetween(const Session& session, const GuardedRun& run, PrinterStateGuard& guard,
                        const Result<Eye>& eye) {
  Result<void> ready;
  if (!eye) ready = tl::unexpected(eye.error());
  if (ready) ready = Home(session);
  if (ready) ready = guard.Begin(session);
  if (!ready) return NameStop(session.stop, std::move(ready));
  auto done = WithReason(session, NameStop(session.stop, run.steps(session, guard, *eye)));
  session.Tell(
      {.text = "bringing back what was set before", .remaining_s = {}, .phase = "restoring"});
  return done;
}

}  // namespace

std::string Eye::Describe() const {
  return camera ? Utf8OrReplaced(camera->Describe(), kLongestCameraName) : std::string();
}

GuardedOutcome RunGuarded(Session& session, const GuardedRun& run) {
  const auto state_folder = run.state_folder.empty()
                                ? files::StateFolder()
                                : Result<std::filesystem::path>(run.state_folder);
  if (!state_folder) return {tl::unexpected(state_folder.error()), {}};
  auto checked = NameStop(session.stop, Check(session, run, *state_folder));
  if (!checked) return {checked, {}};
  auto guard = PrinterStateGuard::Take(
      session, *run.settings,
      {run.run, run.started, run.settings->address, *state_folder, run.prints});
  if (!guard) return {tl::unexpected(NameStop(session.stop, guard.error())), {}};
  guard->ParkAt(ParkPlaceOf(*run.pattern));
  SayWhereThereIsNoLimit(session);
  const auto eye = OpenEye(session, run);  // open until the laser is off
  GuardedOutcome outcome;
  outcome.done = RunBetween(session, run, *guard, eye);
  outcome.unrestored = guard->Restore();
  outcome.done = NameRestart(std::move(outcome.done), guard->restarted());
  return outcome;
}

Result<std::unique_ptr<machine::FrameSource>> OpenCamera(const Session& session,
                                                         const ScanSettings& settings) {
  machine::CameraOptions options;
  options.width_px = settings.frame_width_px;
  options.height_px = settings.frame_height_px;
  options.frames_per_s = settings.frames_per_s;
  options.jpeg_quality = kJpegQuality;
  if (!settings.camera.empty()) return machine::OpenCamera(settings.camera, options, session.stop);
  const auto webcams = session.printer.Webcams(session.Within(kAsk_s));
  if (!webcams) return tl::unexpected(webcams.error());
  for (const machine::Webcam& webcam : *webcams) {
    if (webcam.enabled && (settings.webcam.empty() || settings.webcam == webcam.name)) {
      return machine::OpenCamera(webcam.stream_url, options, session.stop);
    }
  }
  return Fail(
      fmt::format("the printer's server lists no camera{}: set [camera] url to the stream's "
                  "address",
                  settings.webcam.empty() ? "" : " named " + settings.webcam),
      ErrorKind::kMachine);
}

}  // namespace trammel::procedure
