#include "machine/video/video_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/check.h"
#include "files/new_file.h"
#include "image/avi_writer.h"

namespace trammel::machine {
namespace {

/// File open for writing.
class Descriptor {
 public:
  Descriptor() = default;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  /// Both return 0 or the error's number.
  int Create(const std::filesystem::path& path) {
    fd_ = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    return fd_ < 0 ? errno : 0;
  }
  int Close() { return close(std::exchange(fd_, -1)) == 0 ? 0 : errno; }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_ = -1;
};

std::string TimeText(const std::optional<CameraTime>& time) {
  if (!time) return "- -";
  constexpr std::array<std::string_view, 4> kNames = {"ours", "camera", "wall", "recording"};
  return fmt::format("{:.6f} {}", time->time_s, kNames[static_cast<std::size_t>(time->clock)]);
}

std::string TimesLine(const CapturedFrame& frame, std::optional<std::size_t> number) {
  return fmt::format("{} {:.6f} {} {} {} {}\n", number ? std::to_string(*number) : "-",
                     frame.arrival_s, TimeText(frame.captured), TimeText(frame.sent),
                     frame.sequence ? std::to_string(*frame.sequence) : "-", ToString(frame.fault));
}

std::span<const std::uint8_t> AsBytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

struct VideoWriter::State {
  std::filesystem::path path;
  double frames_per_s = 30;
  Descriptor video;
  Descriptor times;
  std::size_t times_bytes = 0;
  std::optional<image::AviWriter> avi;  ///< set at the first frame, which fixes the size
  int width = 0;
  int height = 0;
  std::string broken;  ///< error that ended the writing

  [[nodiscard]] std::size_t frames() const { return avi ? avi->frames() : 0; }
  tl::unexpected<Error> DiskFault(int error) {
    broken = fmt::format("recording {}. The {} frames before it are safe",
                         files::CannotWrite(path, error).value().message, frames());
    return Fail(broken);
  }
  Result<void> AddTimes(const CapturedFrame& frame, std::optional<std::size_t> number) {
    const int error =
        image::AppendWhole(times.get(), AsBytes(TimesLine(frame, number)), times_bytes);
    if (error != 0) return DiskFault(error);
    return {};
  }
  Result<void> AddImage(const CapturedFrame& frame);
};

std::filesystem::path FrameTimesPath(const std::filesystem::path& video) {
  return video.string() + ".times";
}

VideoWriter::VideoWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;
VideoWriter& VideoWriter::operator=(VideoWriter&&) noexcept = default;
VideoWriter::~VideoWriter() = default;

Result<VideoWriter> VideoWriter::Create(const std::filesystem::path& path,
                                        double nominal_frames_per_s) {
  TRAMMEL_CHECK(nominal_frames_per_s > 0, "nominal_frames_per_s = {}", nominal_frames_per_s);
  auto state = std::make_unique<State>();
  state->path = path;
  state->frames_per_s = nominal_frames_per_s;
  const auto create = [](Descriptor& file, const std::filesystem::path& name) -> Result<void> {
    const int error = file.Create(name);
    if (error == 0) return {};
    if (error == EEXIST) {
      return Fail(
          fmt::format("recording '{}': cannot be created (it exists already; recordings "
                      "are never overwritten)",
                      name.string()));
    }
    return Fail("recording " + files::CannotWrite(name, error).value().message);
  };
  const auto remove_both = [&] {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    std::filesystem::remove(FrameTimesPath(path), ignored);
  };
  TRY(create(state->video, path));
  if (auto made = create(state->times, FrameTimesPath(path)); !made) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    return tl::unexpected(made.error());
  }
  constexpr std::string_view kHead =
      "# trammel frame times, format 1\n"
      "# frame arrival_s captured_s clock sent_s clock sequence fault\n";
  if (const int error = image::AppendWhole(state->times.get(), AsBytes(kHead), state->times_bytes);
      error != 0) {
    remove_both();
    return state->DiskFault(error);
  }
  return VideoWriter(std::move(state));
}

Result<void> VideoWriter::State::AddImage(const CapturedFrame& frame) {
  if (!avi) {
    width = frame.width_px;
    height = frame.height_px;
    avi.emplace(video.get());
    if (const int error = avi->Begin({width, height, frames_per_s}); error != 0) {
      return DiskFault(error);
    }
  }
  const int error = avi->Add(frame.image);
  if (error == EOVERFLOW) {
    return Fail(fmt::format("recording '{}': more than 2 GB after {} frames; record one sweep "
                            "per file",
                            path.string(), frames()),
                ErrorKind::kMachine);
  }
  if (error != 0) return DiskFault(error);
  auto added = AddTimes(frame, frames() - 1);
  if (!added) avi->TakeBack();
  return added;
}

Result<void> VideoWriter::Add(const CapturedFrame& frame) {
  TRAMMEL_CHECK(state_ != nullptr, "a frame of {} bytes after the end", frame.image.size());
  State& state = *state_;
  if (!state.broken.empty()) return Fail(state.broken);
  if (frame.fault != FrameFault::kNone && frame.fault != FrameFault::kTimeJumped) {
    return state.AddTimes(frame, std::nullopt);
  }
  const auto& image = frame.image;
  const bool jpeg = image.size() > 3 && image[0] == 0xFF && image[1] == 0xD8;
  const bool fits = frame.width_px > 0 && frame.width_px < 65536 && frame.height_px > 0 &&
                    frame.height_px < 65536;
  const bool same =
      state.width == 0 || (frame.width_px == state.width && frame.height_px == state.height);
  if (!jpeg || !fits || !same) {
    return Fail(fmt::format("recording '{}': a frame of {}x{} px that is {} cannot be added to "
                            "frames of {}x{} px",
                            state.path.string(), frame.width_px, frame.height_px,
                            jpeg ? "a JPEG" : "no JPEG", state.width, state.height),
                ErrorKind::kMeasurement);
  }
  return state.AddImage(frame);
}

Result<void> VideoWriter::Finish() {
  TRAMMEL_CHECK(state_ != nullptr, "finished twice");
  const std::unique_ptr<State> state = std::move(state_);
  if (!state->broken.empty()) return Fail(state->broken);
  if (state->frames() == 0) return {};
  int error = state->avi->Finish();
  if (error == 0) error = state->video.Close();
  if (error == 0) error = state->times.Close();
  if (error != 0) return state->DiskFault(error);
  return {};
}

std::size_t VideoWriter::frames() const { return state_ ? state_->frames() : 0; }

}  // namespace trammel::machine
