#include "machine/video_file.h"

#include <utility>

#include "machine/avi_packets.h"
#include "machine/mjpeg_video.h"
#include "machine/module.h"
#include "machine/video_module.h"

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

Result<const Frame*> VideoFile::Next() { return decoder_->Next(); }

}  // namespace trammel::machine
