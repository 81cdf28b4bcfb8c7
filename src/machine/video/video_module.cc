#include "machine/video/video_module.h"

#include "machine/module/module.h"
#include "machine/video/libav_packets.h"
#include "machine/video/libav_video.h"

namespace {
constexpr trammel::machine::VideoModule kModule = {trammel::machine::OpenLibavVideo,
                                                   trammel::machine::OpenLibavPackets};
}  // namespace

TRAMMEL_MODULE(kModule)
