#include "machine/video/video_cutter.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/check.h"
#include "image/avi_writer.h"
#include "image/jpeg_cutter.h"
#include "machine/video/avi_reader.h"
#include "machine/video/video_file.h"

namespace trammel::machine {
namespace {

using Bytes = std::vector<std::uint8_t>;

tl::unexpected<Error> NotCut(const std::filesystem::path& video, const std::string& why) {
  return Fail(fmt::format("video '{}' stays whole: {}", video.string(), why),
              ErrorKind::kMeasurement);
}

/// Copies all frames, cut where possible.
Result<void> Fill(const std::filesystem::path& video, AviReader& reader, const VideoCut& cut,
                  const std::stop_token& stop, image::AviWriter& avi) {
  const VideoLimits limits;
  AviFrame frame;
  Bytes part;
  for (;;) {
    if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
    const auto more = TRY(reader.Next(frame));
    if (!more) return {};
    TRY(CheckMjpegFrame(frame.bytes, limits.max_pixels));
    const bool whole = avi.frames() % cut.whole_every == 0;
    const bool smaller =
        !whole && image::CutJpeg(frame.bytes, cut.part, part) && part.size() < frame.bytes.size();
    if (const int error = avi.Add(smaller ? part : frame.bytes); error != 0) {
      return files::CannotWrite(video, error);
    }
    if (avi.frames() > limits.max_frames) return Fail("it has more frames than are read");
  }
}

}  // namespace

Result<CutVideo> CutVideo::Write(const std::filesystem::path& video, const VideoCut& cut,
                                 const std::stop_token& stop) {
  TRAMMEL_CHECK(cut.whole_every >= 1 && cut.frames_per_s > 0, "every {} frames, {} frames/s",
                cut.whole_every, cut.frames_per_s);
  constexpr std::size_t kMaxBytes = std::size_t{3} * VideoLimits{}.max_pixels;
  auto reader = TRY(AviReader::Open(video, kMaxBytes));
  const image::AviForm form{reader.width_px(), reader.height_px(), cut.frames_per_s};
  if (form.width_px < 1 || form.width_px > 65535 || form.height_px < 1 || form.height_px > 65535) {
    return NotCut(video, fmt::format("its head states {}x{} px", form.width_px, form.height_px));
  }
  auto file = TRY(files::NewFile::Create(video, files::IfThere::kReplace));
  image::AviWriter avi(file.fd());
  if (const int error = avi.Begin(form); error != 0) return files::CannotWrite(video, error);
  TRY(Fill(video, reader, cut, stop, avi));
  if (const int error = avi.Finish(); error != 0) return files::CannotWrite(video, error);
  return CutVideo(video, std::move(file));
}

Result<void> CutVideo::TakePlace() {
  struct stat status {};
  if (stat(video_.c_str(), &status) != 0) return NotCut(video_, "it is gone");
  const timespec times[] = {status.st_atim, status.st_mtim};
  if (futimens(file_.fd(), times) != 0) return NotCut(video_, "its time cannot be kept");
  return file_.Commit();
}

}  // namespace trammel::machine
