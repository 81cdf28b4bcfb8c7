#include "pressure_advance/procedure/guarded_run.h"

#include <fmt/format.h>

#include <utility>

#include "base/utf8.h"
#include "machine/moonraker/webcam_list.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using settings::ScanSettings;

constexpr double kAsk_s = 10;
constexpr double kStall_s = 5;
constexpr std::size_t kLongestCameraName = 500;
constexpr int kJpegQuality = 95;  // of pictures that a camera sends as raw pixels

ParkPlace ParkPlaceOf(const PatternConfig& config) {
  const auto park = settings::ParkPositionOf(config);
  return {config.park_lift_mm, park.x_mm, park.y_mm, config.z_speed_mm_s, config.travel_speed_mm_s};
}

// A camera that sends pictures, or nothing where none is wanted.
Result<Eye> OpenEye(const Session& session, const GuardedRun& run) {
  Eye eye;
  if (!run.looks) return eye;
  session.Tell({.text = "looking at the camera", .remaining_s = {}, .phase = "checking"});
  auto opened = TRY(OpenCamera(session, *run.settings));
  eye.camera = std::move(opened);
  eye.recorder = std::make_unique<FrameRecorder>(*eye.camera, kStall_s);
  TRY(eye.recorder->NextFrame(kStall_s, session.stop));
  return eye;
}

}  // namespace

std::string Eye::Describe() const {
  return camera ? Utf8OrReplaced(camera->Describe(), kLongestCameraName) : std::string();
}

GuardedOutcome RunGuarded(Session& session, const GuardedRun& run) {
  Eye eye;  // open until the laser is off
  GuardedSteps guarded;
  guarded.settings = run.settings;
  guarded.identity.run = run.run;
  guarded.identity.started = run.started;
  guarded.identity.state_folder = run.state_folder;
  guarded.identity.prints = run.prints;
  guarded.identity.without_laser = run.for_photo;
  guarded.identity.may_unhome = run.for_photo;
  guarded.identity.heaters_end_off = run.for_photo;
  guarded.park = ParkPlaceOf(*run.pattern);
  guarded.check = run.check;
  guarded.steps = [&](const Session& taken, PrinterStateGuard& guard) -> Result<void> {
    auto opened = TRY(OpenEye(taken, run));
    eye = std::move(opened);
    TRY(HomeWhereItIsNot(taken));
    TRY(guard.Begin(taken));
    return run.steps(taken, guard, eye);
  };
  return RunGuarded(session, guarded);
}

Result<std::unique_ptr<machine::FrameSource>> OpenCamera(const Session& session,
                                                         const ScanSettings& settings) {
  machine::CameraOptions options;
  options.width_px = settings.frame_width_px;
  options.height_px = settings.frame_height_px;
  options.frames_per_s = settings.frames_per_s;
  options.jpeg_quality = kJpegQuality;
  if (!settings.camera.empty()) return machine::OpenCamera(settings.camera, options, session.stop);
  const auto webcams = TRY(session.printer.Webcams(session.Within(kAsk_s)));
  const auto webcam = TRY(machine::ChooseWebcam(webcams, settings.webcam));
  return machine::OpenCamera(webcam.stream_url, options, session.stop);
}

}  // namespace trammel::procedure
