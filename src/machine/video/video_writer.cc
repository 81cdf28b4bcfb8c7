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
#include "image/avi_form.h"

namespace trammel::machine {
namespace {

std::string SystemText(int error) { return std::generic_category().message(error); }

std::string_view AdviceOn(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "make room";
    case EFBIG:
      return "raise the limit on the size of files (ulimit -f), or record to another disk";
    case EMFILE:
    case ENFILE:
      return "raise the limit on open files (ulimit -n), or end what holds them";
    case EROFS:
      return "record to a disk that can be written";
    default:
      return "check the disk";
  }
}

/// A file that grows by whole records: what could not be written whole is taken away again.
class RecordFile {
 public:
  RecordFile() = default;
  RecordFile(RecordFile&& other) noexcept : fd_(std::exchange(other.fd_, -1)), size_(other.size_) {}
  RecordFile& operator=(RecordFile&& other) noexcept {
    std::swap(fd_, other.fd_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~RecordFile() {
    if (fd_ >= 0) close(fd_);
  }

  /// 0 or the error's number.
  int Create(const std::filesystem::path& path) {
    fd_ = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    return fd_ < 0 ? errno : 0;
  }
  int Append(std::span<const std::uint8_t> bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t count = write(fd_, bytes.data() + done, bytes.size() - done);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) {
        const int error = count < 0 ? errno : ENOSPC;
        ShrinkTo(size_);
        return error;
      }
      done += static_cast<std::size_t>(count);
    }
    size_ += done;
    return 0;
  }
  void ShrinkTo(std::size_t size) {
    // Where even this fails, the reader drops the last, unfinished record.
    if (ftruncate(fd_, static_cast<off_t>(size)) == 0)
      lseek(fd_, static_cast<off_t>(size), SEEK_SET);
    size_ = size;
  }
  int Overwrite(std::size_t at, std::span<const std::uint8_t> bytes) const {
    const ssize_t count = pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(at));
    return count == static_cast<ssize_t>(bytes.size()) ? 0 : (count < 0 ? errno : ENOSPC);
  }
  int Close() {
    const int fd = std::exchange(fd_, -1);
    return close(fd) == 0 ? 0 : errno;
  }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  int fd_ = -1;
  std::size_t size_ = 0;
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
  RecordFile video;
  RecordFile times;
  int width = 0;
  int height = 0;
  std::vector<image::AviEntry> index;
  std::vector<std::uint8_t> chunk;
  std::string broken;  ///< why nothing more can be written

  tl::unexpected<Error> DiskFault(int error) {
    broken = fmt::format(
        "recording '{}': writing frame {} failed ({}); {}. The {} frames before it are safe",
        path.string(), index.size(), SystemText(error), AdviceOn(error), index.size());
    return Fail(broken);
  }
  Result<void> AddTimes(const CapturedFrame& frame, std::optional<std::size_t> number) {
    const std::string line = TimesLine(frame, number);
    if (const int error = times.Append(AsBytes(line)); error != 0) return DiskFault(error);
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
  const auto create = [](RecordFile& file, const std::filesystem::path& name) -> Result<void> {
    const int error = file.Create(name);
    if (error == 0) return {};
    if (error == EEXIST) {
      return Fail(
          fmt::format("recording '{}': cannot be created (it exists already; recordings "
                      "are never overwritten)",
                      name.string()));
    }
    return Fail(fmt::format("recording '{}': cannot be created ({}); {}", name.string(),
                            SystemText(error), AdviceOn(error)));
  };
  const auto remove_both = [&] {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    std::filesystem::remove(FrameTimesPath(path), ignored);
  };
  if (auto made = create(state->video, path); !made) return tl::unexpected(made.error());
  if (auto made = create(state->times, FrameTimesPath(path)); !made) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    return tl::unexpected(made.error());
  }
  constexpr std::string_view kHead =
      "# trammel frame times, format 1\n"
      "# frame arrival_s captured_s clock sent_s clock sequence fault\n";
  if (const int error = state->times.Append(AsBytes(kHead)); error != 0) {
    remove_both();
    return state->DiskFault(error);
  }
  return VideoWriter(std::move(state));
}

Result<void> VideoWriter::State::AddImage(const CapturedFrame& frame) {
  if (index.empty() && video.size() == 0) {
    width = frame.width_px;
    height = frame.height_px;
    const auto head = image::AviHead({width, height, frames_per_s});
    if (const int error = video.Append(head); error != 0) return DiskFault(error);
  }
  const std::size_t size = frame.image.size();
  const auto head = image::AviFrameHead(size);
  chunk.assign(head.begin(), head.end());
  chunk.insert(chunk.end(), frame.image.begin(), frame.image.end());
  if (size % 2 == 1) chunk.push_back(0);
  const std::size_t before = video.size();
  if (before + chunk.size() > image::kMostAviBytes) {
    return Fail(fmt::format("recording '{}': more than {} bytes after {} frames; record one sweep "
                            "per file",
                            path.string(), image::kMostAviBytes, index.size()),
                ErrorKind::kMachine);
  }
  if (const int error = video.Append(chunk); error != 0) return DiskFault(error);
  if (auto added = AddTimes(frame, index.size()); !added) {
    video.ShrinkTo(before);
    return added;
  }
  index.push_back({before, size});
  return {};
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
  if (state->index.empty()) return {};
  const std::size_t movi_end = state->video.size();
  int error = state->video.Append(image::AviIndex(state->index));
  for (const image::AviPatch& patch :
       image::AviSizes(state->index.size(), movi_end, state->video.size())) {
    if (error == 0) error = state->video.Overwrite(patch.at, patch.bytes);
  }
  if (error == 0) error = state->video.Close();
  if (error == 0) error = state->times.Close();
  if (error != 0) return state->DiskFault(error);
  return {};
}

std::size_t VideoWriter::frames() const { return state_ ? state_->index.size() : 0; }

}  // namespace trammel::machine
