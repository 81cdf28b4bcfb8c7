#include "pressure_advance/procedure/setup_eye.h"

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "files/new_file.h"
#include "machine/camera/camera.h"
#include "vision/still_picture.h"

namespace trammel::procedure {
namespace {

using pressure_advance::HeadPlace;

constexpr double kMove_s = 120;
constexpr double kFrame_s = 5;
constexpr int kFrames = 4;     // halves the sensor's noise
constexpr int kMostTries = 8;  // of a picture that shows motion: a busy computer's is late

Result<void> Keep(const machine::CapturedFrame& frame, const std::filesystem::path& stem) {
  const std::string_view bytes(reinterpret_cast<const char*>(frame.image.data()),
                               frame.image.size());
  const bool png = bytes.starts_with("\x89PNG");
  return files::WriteWholeFile(stem.string() + (png ? ".png" : ".jpg"), bytes,
                               files::IfThere::kRefuse);
}

}  // namespace

SetupEye::SetupEye(const Session& session, const Eye& eye,
                   const pressure_advance::PatternConfig& config,
                   const settings::ScanSettings& settings, const ClearHeights& clear,
                   const Reach& reach, std::filesystem::path folder)
    : session_(session),
      recorder_(*eye.recorder),
      config_(config),
      settings_(settings),
      clear_(clear),
      reach_(reach),
      folder_(std::move(folder)) {}

Result<void> SetupEye::Run(const std::string& gcode) {
  if (gcode.empty()) return {};
  TRY(RunNoted(session_, gcode, kMove_s));
  return session_.printer.FinishMoves(session_.Within(kMove_s));
}

// Again for each picture: the printer's own limit switches a forgotten laser off.
Result<void> SetupEye::Switch(SetupLight light) {
  if (light == SetupLight::kRoom) return LightRoom();
  TRY(Run(settings_.lights_off_gcode));
  return Run(settings_.laser_on_gcode);
}

Result<void> SetupEye::LightRoom() {
  TRY(Run(settings_.laser_off_gcode));
  return Run(settings_.lights_on_gcode);
}

// The mean of frames that show the same; absent where something moves from the first to the last.
Result<std::optional<Frame>> SetupEye::MeanPicture(const std::string& name) {
  vision::StillPicture picture;
  while (true) {
    const auto captured = TRY(recorder_.NextFrame(kFrame_s, session_.stop));
    const auto frame = TRY(machine::DecodeFrame(captured));
    const auto added = picture.Add(frame);
    if (added == vision::StillPicture::Added::kMoved) return std::nullopt;
    if (added == vision::StillPicture::Added::kOtherSize) {
      return Fail("the camera's pictures change their size", ErrorKind::kMachine);
    }
    if (picture.frames() < kFrames) continue;
    TRY(Keep(captured, folder_ / name));
    return picture.Mean();
  }
}

Result<Frame> SetupEye::Look(const HeadPlace& place, SetupLight light, const std::string& name) {
  auto done = CheckPlace(place, clear_, reach_);
  if (done) done = CheckStillFree(session_);
  if (done) done = KeepAlive(session_);
  if (done) done = Run(GcodeTo(place, config_));
  if (done) done = Switch(light);
  if (!done) return tl::unexpected(done.error());
  if (!Pause(settings_.settle_s, session_.stop)) {
    return Fail("stopped while the camera was set up", ErrorKind::kInterrupted);
  }
  TRY(CheckStillHomed(session_));
  for (int i = 0; i < kMostTries; ++i) {
    auto picture = TRY(MeanPicture(name));
    if (picture) return std::move(*picture);
  }
  return Fail(
      fmt::format("the picture still moves while the head has stood for more than {:.1f} s: the "
                  "camera is late or shakes; lengthen [scan] settle",
                  settings_.settle_s),
      ErrorKind::kMachine);
}

}  // namespace trammel::procedure
