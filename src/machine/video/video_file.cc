#include "machine/video/video_file.h"

#include <fmt/format.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "base/frame.h"
#include "image/jpeg_reader.h"
#include "machine/video/avi_reader.h"
#include "machine/video/video_budget.h"

namespace trammel::machine {
namespace {

using Clock = std::chrono::steady_clock;

tl::unexpected<Error> Damaged(std::size_t number, const Error& error) {
  return Fail(fmt::format("frame {} is damaged or cut off ({}); record the line again", number,
                          error.message));
}

}  // namespace

struct VideoFile::State {
  State(std::filesystem::path of, AviReader frames, const VideoLimits& limits)
      : path(std::move(of)), avi(std::move(frames)), budget(limits) {}

  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path.string(), what), ErrorKind::kMeasurement);
  }
  [[nodiscard]] PixelRect readable() const {
    return image::ExactPart(place, jpeg->header().grid());
  }
  Result<void> OpenFrame();
  Result<void> DecodeFrame(const PixelRect& part);

  std::filesystem::path path;
  AviReader avi;
  VideoBudget budget;
  AviFrame stored;
  std::optional<image::JpegReader> jpeg;  // of `stored`
  image::JpegPlace place;                 // of what is stored in the frame
  Frame frame;
};

/// Opens `stored`. Messages of this and the next do not name the file.
Result<void> VideoFile::State::OpenFrame() {
  const std::size_t number = budget.frames() + 1;
  if (auto cost = CheckMjpegFrame(stored.bytes, budget.limits().max_pixels); !cost) {
    return Fail(fmt::format("frame {}: {}", number, cost.error().message));
  }
  auto reader = image::JpegReader::Open(stored.bytes, image::JpegDamage::kRefuse);
  if (!reader) return Damaged(number, reader.error());
  jpeg = std::move(*reader);
  const image::JpegHeader& header = jpeg->header();
  place = header.place.value_or(image::JpegPlace{0, 0, header.width_px, header.height_px});
  return budget.AddFrame(place.whole_width, place.whole_height,
                         static_cast<double>(header.width_px) * header.height_px);
}

/// Fills `frame`.
Result<void> VideoFile::State::DecodeFrame(const PixelRect& part) {
  const std::size_t number = budget.frames();
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
  const std::size_t most_bytes = 3 * limits.max_pixels;  // of a frame: as many as its pixels take
  auto avi = TRY(AviReader::Open(path, most_bytes));
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
  if (opened) opened = state_->budget.AddTime(Clock::now() - begin);
  if (!opened) return state_->Broken(opened.error().message);
  return true;
}

Result<const Frame*> VideoFile::Decode(const PixelRect& part) {
  const Clock::time_point begin = Clock::now();
  auto decoded = state_->DecodeFrame(part);
  if (decoded) decoded = state_->budget.AddTime(Clock::now() - begin);
  if (!decoded) return state_->Broken(decoded.error().message);
  return &state_->frame;
}

Result<const Frame*> VideoFile::Next() {
  const auto more = TRY(Advance());
  if (!more) return nullptr;
  return Decode({0, 0, width_px(), height_px()});
}

}  // namespace trammel::machine
