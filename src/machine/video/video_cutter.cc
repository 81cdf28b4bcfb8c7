#include "machine/video/video_cutter.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/check.h"
#include "image/avi_form.h"
#include "image/jpeg_cutter.h"
#include "machine/video/avi_reader.h"
#include "machine/video/video_budget.h"

namespace trammel::machine {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string_view TextOf(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

tl::unexpected<Error> NotCut(const std::filesystem::path& video, const std::string& why) {
  return Fail(fmt::format("video '{}' stays whole: {}", video.string(), why),
              ErrorKind::kMeasurement);
}

/// An AVI that grows frame by frame.
class AviFile {
 public:
  explicit AviFile(const files::NewFile& file) : file_(file) {}

  Result<void> Begin(const image::AviForm& form) { return Append(image::AviHead(form)); }

  Result<void> Add(std::span<const std::uint8_t> jpeg) {
    const auto head = image::AviFrameHead(jpeg.size());
    index_.push_back({size_, jpeg.size()});
    if (auto done = Append(head); !done) return done;
    if (auto done = Append(jpeg); !done) return done;
    constexpr std::uint8_t kPadding = 0;
    return jpeg.size() % 2 == 1 ? Append({&kPadding, 1}) : Result<void>();
  }

  Result<void> Finish() {
    const std::size_t frames_end = size_;
    if (auto done = Append(image::AviIndex(index_)); !done) return done;
    for (const image::AviPatch& patch : image::AviSizes(index_.size(), frames_end, size_)) {
      const ssize_t count =
          pwrite(file_.fd(), patch.bytes.data(), patch.bytes.size(), static_cast<off_t>(patch.at));
      if (count != static_cast<ssize_t>(patch.bytes.size())) {
        return Fail("its head could not be written; check the disk");
      }
    }
    return {};
  }

  [[nodiscard]] std::size_t frames() const { return index_.size(); }

 private:
  Result<void> Append(std::span<const std::uint8_t> bytes) {
    size_ += bytes.size();
    return file_.Write(TextOf(bytes));
  }

  const files::NewFile& file_;
  std::vector<image::AviEntry> index_;
  std::size_t size_ = 0;
};

/// Copies all frames, those that are to be cut as their cuts.
Result<void> Fill(AviReader& reader, const VideoCut& cut, const std::stop_token& stop,
                  AviFile& avi) {
  const VideoLimits limits;
  AviFrame frame;
  Bytes part;
  for (;;) {
    if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
    const auto more = reader.Next(frame);
    if (!more) return tl::unexpected(more.error());
    if (!*more) return {};
    if (auto fits = CheckMjpegFrame(frame.bytes, limits.max_pixels); !fits) return fits;
    const bool whole = avi.frames() % cut.whole_every == 0;
    const bool smaller =
        !whole && image::CutJpeg(frame.bytes, cut.part, part) && part.size() < frame.bytes.size();
    if (auto added = avi.Add(smaller ? part : frame.bytes); !added) return added;
    if (avi.frames() > limits.max_frames) return Fail("it has more frames than are read");
  }
}

}  // namespace

Result<CutVideo> CutVideo::Write(const std::filesystem::path& video, const VideoCut& cut,
                                 const std::stop_token& stop) {
  TRAMMEL_CHECK(cut.whole_every >= 1 && cut.frames_per_s > 0, "every {} frames, {} frames/s",
                cut.whole_every, cut.frames_per_s);
  constexpr std::size_t kMostBytes = std::size_t{3} * VideoLimits{}.max_pixels;
  auto reader = AviReader::Open(video, kMostBytes);
  if (!reader) return tl::unexpected(reader.error());
  const image::AviForm form{reader->width_px(), reader->height_px(), cut.frames_per_s};
  if (form.width_px < 1 || form.width_px > 65535 || form.height_px < 1 || form.height_px > 65535) {
    return NotCut(video, fmt::format("its head states {}x{} px", form.width_px, form.height_px));
  }
  auto file = files::NewFile::Create(video, files::IfThere::kReplace);
  if (!file) return tl::unexpected(file.error());
  AviFile avi(*file);
  auto written = avi.Begin(form);
  if (written) written = Fill(*reader, cut, stop, avi);
  if (written) written = avi.Finish();
  if (!written) return tl::unexpected(written.error());
  return CutVideo(video, std::move(*file));
}

Result<void> CutVideo::TakePlace() {
  struct stat status {};
  if (stat(video_.c_str(), &status) != 0) return NotCut(video_, "it is gone");
  const timespec times[] = {status.st_atim, status.st_mtim};
  if (futimens(file_.fd(), times) != 0) return NotCut(video_, "its time cannot be kept");
  return file_.Commit();
}

}  // namespace trammel::machine
