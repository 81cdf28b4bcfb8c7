#include "pressure_advance/procedure/setup_eye.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "files/new_file.h"
#include "machine/camera/camera.h"

namespace trammel::procedure {
namespace {

using pressure_advance::HeadPlace;

constexpr double kMove_s = 120;
constexpr double kFrame_s = 5;
constexpr int kFrames = 4;     // halves the sensor's noise
constexpr int kMostTries = 8;  // of a picture that shows motion: a busy computer's is late

void Add(const Frame& frame, std::vector<std::uint16_t>& sum) {
  sum.resize(frame.bgr.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] = static_cast<std::uint16_t>(sum[i] + frame.bgr[i]);
  }
}

// Whether the laser's stripe, or anything else as clear, stands elsewhere in the two pictures.
bool Moved(const Frame& before, const Frame& after) {
  constexpr int kClear = 24;        // levels: beyond the noise of a bright stripe and its JPEG
  constexpr double kShare = 0.001;  // of all values: a stripe of 3 px that moved, in 1280
  std::size_t moved = 0;
  for (std::size_t i = 0; i < before.bgr.size(); ++i) {
    moved += std::abs(before.bgr[i] - after.bgr[i]) > kClear;
  }
  return static_cast<double>(moved) > kShare * static_cast<double>(before.bgr.size());
}

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
  if (auto done = session_.printer.Run(gcode, session_.Within(kMove_s)); !done) return done;
  return session_.printer.FinishMoves(session_.Within(kMove_s));
}

// Again for each picture: the printer's own limit switches a forgotten laser off.
Result<void> SetupEye::Switch(SetupLight light) {
  if (light == SetupLight::kRoom) return LightRoom();
  if (auto dark = Run(settings_.lights_off_gcode); !dark) return dark;
  return Run(settings_.laser_on_gcode);
}

Result<void> SetupEye::LightRoom() {
  if (auto off = Run(settings_.laser_off_gcode); !off) return off;
  return Run(settings_.lights_on_gcode);
}

// The mean of frames that show the same; absent where something moves from the first to the last.
Result<std::optional<Frame>> SetupEye::MeanPicture(const std::string& name) {
  std::vector<std::uint16_t> sum;
  Frame first;
  for (int i = 0; i < kFrames; ++i) {
    const auto captured = recorder_.NextFrame(kFrame_s, session_.stop);
    if (!captured) return tl::unexpected(captured.error());
    auto frame = machine::DecodeFrame(*captured);
    if (!frame) return tl::unexpected(frame.error());
    if (i == 0) first = *frame;
    if (frame->bgr.size() != first.bgr.size()) {
      return Fail("the camera's pictures change their size", ErrorKind::kMachine);
    }
    if (i > 0 && Moved(first, *frame)) return std::nullopt;
    Add(*frame, sum);
    if (i + 1 < kFrames) continue;
    if (auto kept = Keep(*captured, folder_ / name); !kept) return tl::unexpected(kept.error());
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    first.bgr[i] = static_cast<std::uint8_t>((sum[i] + kFrames / 2) / kFrames);
  }
  return first;
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
  if (auto homed = CheckStillHomed(session_); !homed) return tl::unexpected(homed.error());
  for (int i = 0; i < kMostTries; ++i) {
    auto picture = MeanPicture(name);
    if (!picture) return tl::unexpected(picture.error());
    if (*picture) return std::move(**picture);
  }
  return Fail(
      fmt::format("the picture still moves while the head has stood for more than {:.1f} s: the "
                  "camera is late or shakes; lengthen [scan] settle",
                  settings_.settle_s),
      ErrorKind::kMachine);
}

}  // namespace trammel::procedure
