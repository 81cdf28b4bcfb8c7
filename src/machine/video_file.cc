#include "machine/video_file.h"

#include <utility>

#include "machine/module.h"
#include "machine/video_module.h"

namespace trammel::machine {

VideoFile::VideoFile(std::unique_ptr<VideoDecoder> decoder) : decoder_(std::move(decoder)) {}
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;
VideoFile::~VideoFile() = default;

Result<VideoFile> VideoFile::Open(const std::filesystem::path& path, const VideoLimits& limits) {
  const auto module = LoadModule<VideoModule>(kVideoModule);
  if (!module) return tl::unexpected(module.error());
  auto decoder = (*module)->open(path, limits);
  if (!decoder) return tl::unexpected(decoder.error());
  return VideoFile(std::move(*decoder));
}

Result<const Frame*> VideoFile::Next() { return decoder_->Next(); }

}  // namespace trammel::machine
