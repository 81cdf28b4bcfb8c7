#include "machine/video/video_file.h"

#include <fmt/format.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "base/frame.h"
#include "image/jpeg_outline.h"
#include "image/jpeg_reader.h"
#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/net/host_clock.h"
#include "machine/video/avi_reader.h"

namespace trammel::machine {
Result<void> CheckMjpegFrame(std::span<const std::uint8_t> jpeg, std::size_t most_pixels) {
  const auto outline = TRY(image::OutlineOf(jpeg));
  if (static_cast<double>(outline.width_px) * outline.height_px >
      static_cast<double>(most_pixels)) {
    return Fail(fmt::format("it has {}x{} px; at most {} megapixels are read", outline.width_px,
                            outline.height_px, most_pixels / 1'000'000));
  }
  return CheckCost(outline, jpeg.size());
}

namespace {

using Clock = std::chrono::steady_clock;

tl::unexpected<Error> Damaged(std::size_t number, const Error& error) {
  return Fail(fmt::format("frame {} is damaged or cut off ({}); record the line again", number,
                          error.message));
}

}  // namespace

struct VideoFile::State {
  State(std::filesystem::path of, AviReader reader, const VideoLimits& bounds)
      : path(std::move(of)), avi(std::move(reader)), limits(bounds) {}

  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path.string(), what), ErrorKind::kMeasurement);
  }
  [[nodiscard]] PixelRect readable() const {
    return image::ExactPart(place, jpeg->header().grid());
  }
  // Messages of these do not name the file.
  Result<void> AddFrame(int width_px, int height_px, double stored_pixels);
  Result<void> AddTime(Clock::time_point begin);
  Result<void> OpenFrame();
  Result<void> DecodeFrame(const PixelRect& part);

  std::filesystem::path path;
  AviReader avi;
  VideoLimits limits;
  std::size_t frames = 0;  // accepted so far
  int first_width_px = 0;
  int first_height_px = 0;
  double pixels = 0;  // total of all frames so far
  Clock::duration decoding{};
  AviFrame stored;
  std::optional<image::JpegReader> jpeg;  // reads `stored`
  image::JpegPlace place;                 // stored part's place in the frame
  Frame frame;
};

Result<void> VideoFile::State::AddFrame(int width_px, int height_px, double stored_pixels) {
  if (frames == limits.max_frames) {
    return Fail(fmt::format("more than {} frames; record one sweep per file", limits.max_frames));
  }
  pixels += stored_pixels;
  if (pixels > limits.max_pixels_in_all) {
    return Fail(
        fmt::format("its first {} frames have more than {:.0f} megapixels in all; record "
                    "one sweep per file, or with smaller frames",
                    frames + 1, limits.max_pixels_in_all / 1e6));
  }
  if (width_px < 1 || height_px < 1 || width_px > limits.max_width_px ||
      height_px > limits.max_height_px ||
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) >
          limits.max_pixels) {
    return Fail(fmt::format("frame {} has {}x{} px; at most {}x{} and {} in all are read",
                            frames + 1, width_px, height_px, limits.max_width_px,
                            limits.max_height_px, limits.max_pixels));
  }
  if (frames > 0 && (width_px != first_width_px || height_px != first_height_px)) {
    return Fail(
        fmt::format("frame {} has {}x{} px, those before it {}x{}; record the line again "
                    "with one camera mode",
                    frames + 1, width_px, height_px, first_width_px, first_height_px));
  }
  first_width_px = width_px;
  first_height_px = height_px;
  ++frames;
  return {};
}

Result<void> VideoFile::State::AddTime(Clock::time_point begin) {
  decoding += Clock::now() - begin;
  if (decoding <= std::chrono::duration<double>(limits.max_decoding_s)) return {};
  return Fail(
      fmt::format("decoding the first {} frames took over {:g} s; record one sweep per file",
                  frames + 1, limits.max_decoding_s));
}

/// Opens `stored`.
Result<void> VideoFile::State::OpenFrame() {
  const std::size_t number = frames + 1;
  if (auto cost = CheckMjpegFrame(stored.bytes, limits.max_pixels); !cost) {
    return Fail(fmt::format("frame {}: {}", number, cost.error().message));
  }
  auto reader = image::JpegReader::Open(stored.bytes, image::JpegDamage::kRefuse);
  if (!reader) return Damaged(number, reader.error());
  jpeg = std::move(*reader);
  const image::JpegHeader& header = jpeg->header();
  place = header.place.value_or(image::JpegPlace{0, 0, header.width_px, header.height_px});
  return AddFrame(place.whole_width, place.whole_height,
                  static_cast<double>(header.width_px) * header.height_px);
}

/// Fills `frame`.
Result<void> VideoFile::State::DecodeFrame(const PixelRect& part) {
  const std::size_t number = frames;
  const PixelRect held = readable();
  if (!Contains(held, part)) {
    return Fail(fmt::format(
        "frame {} was cut: {}x{} px at ({}, {}) of it can be read, not {}x{} "
        "at ({}, {})",
        number, held.width, held.height, held.x, held.y, part.width, part.height, part.x, part.y));
  }
  if (frame.width != part.width || frame.height != part.height) {
    frame = Frame(part.width, part.height);
  }
  frame.time_s = stored.time_s;
  auto read = jpeg->StartPart(image::JpegPixels::kBgr,
                              {part.x - place.x, part.y - place.y, part.width, part.height});
  for (int y = 0; read && y < part.height; ++y) read = jpeg->ReadRow(frame.row(y));
  if (read) read = jpeg->ReadRest();
  return read ? read : Damaged(number, read.error());
}

VideoFile::VideoFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;
VideoFile::~VideoFile() = default;

Result<VideoFile> VideoFile::Open(const std::filesystem::path& path, const VideoLimits& limits) {
  const std::size_t max_bytes = 3 * limits.max_pixels;  // per frame: as many as its pixels need
  auto avi = TRY(AviReader::Open(path, max_bytes));
  return VideoFile(std::make_unique<State>(path, std::move(avi), limits));
}

int VideoFile::width_px() const { return state_->place.whole_width; }
int VideoFile::height_px() const { return state_->place.whole_height; }
PixelRect VideoFile::readable() const { return state_->readable(); }

Result<bool> VideoFile::Advance() {
  const auto more = state_->avi.Next(state_->stored);
  if (!more || !*more) return more;
  const Clock::time_point begin = Clock::now();
  auto opened = state_->OpenFrame();
  if (opened) opened = state_->AddTime(begin);
  if (!opened) return state_->Broken(opened.error().message);
  return true;
}

Result<const Frame*> VideoFile::Decode(const PixelRect& part) {
  const Clock::time_point begin = Clock::now();
  auto decoded = state_->DecodeFrame(part);
  if (decoded) decoded = state_->AddTime(begin);
  if (!decoded) return state_->Broken(decoded.error().message);
  return &state_->frame;
}

Result<const Frame*> VideoFile::Next() {
  const auto more = TRY(Advance());
  if (!more) return nullptr;
  return Decode({0, 0, width_px(), height_px()});
}

namespace {

class VideoFrames final : public FrameSource {
 public:
  VideoFrames(std::filesystem::path path, AviReader avi)
      : path_(std::move(path)), avi_(std::move(avi)) {}

  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override {
    return fmt::format("video {}, {}x{} px", path_.string(), avi_.width_px(), avi_.height_px());
  }
  [[nodiscard]] bool live() const override { return false; }

 private:
  std::filesystem::path path_;
  AviReader avi_;
  std::uint64_t frames_ = 0;
  FrameChecker checker_;
};

Result<std::optional<CapturedFrame>> VideoFrames::Next(double, std::stop_token stop) {
  if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
  AviFrame stored;
  const auto more = TRY(avi_.Next(stored));
  if (!more) return std::nullopt;
  CapturedFrame frame;
  frame.arrival_s = HostNow();
  frame.image = std::move(stored.bytes);
  if (const auto time_s = stored.time_s) {
    frame.captured = CameraTime{*time_s, CameraClock::kRecording};
  }
  frame.sequence = frames_++;
  checker_.Check(frame);
  return frame;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenVideoFrames(const std::filesystem::path& path,
                                                     const CameraOptions& options) {
  auto avi = TRY(AviReader::Open(path, options.max_frame_bytes));
  return std::make_unique<VideoFrames>(path, std::move(avi));
}

}  // namespace trammel::machine
