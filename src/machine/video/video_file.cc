#include "machine/video/video_file.h"

#include <utility>

#include "machine/module/module.h"
#include "machine/video/avi_packets.h"
#include "machine/video/mjpeg_video.h"
#include "machine/video/video_module.h"

namespace trammel::machine {

VideoFile::VideoFile(std::unique_ptr<VideoDecoder> decoder) : decoder_(std::move(decoder)) {}
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;
VideoFile::~VideoFile() = default;

Result<VideoFile> VideoFile::Open(const std::filesystem::path& path, const VideoLimits& limits) {
  const std::size_t most_bytes = 3 * limits.max_pixels;  // of a frame: as many as its pixels take
  auto packets = OpenAviPackets(path, most_bytes);
  if (!packets) return tl::unexpected(packets.error());
  if (*packets) return VideoFile(DecodeMjpeg(path, std::move(*packets), limits));
  const auto module = LoadModule<VideoModule>(kVideoModule);
  if (!module) return tl::unexpected(module.error());
  auto decoder = (*module)->open(path, limits);
  if (!decoder) return tl::unexpected(decoder.error());
  return VideoFile(std::move(*decoder));
}

Result<bool> VideoFile::Advance() { return decoder_->Advance(); }
int VideoFile::width_px() const { return decoder_->width_px(); }
int VideoFile::height_px() const { return decoder_->height_px(); }
PixelRect VideoFile::readable() const { return decoder_->readable(); }
Result<const Frame*> VideoFile::Decode(const PixelRect& part) { return decoder_->Decode(part); }

Result<const Frame*> VideoFile::Next() {
  const auto more = Advance();
  if (!more) return tl::unexpected(more.error());
  if (!*more) return nullptr;
  return Decode({0, 0, width_px(), height_px()});
}

}  // namespace trammel::machine
