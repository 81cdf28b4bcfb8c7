#include "machine/video_module.h"

#include "machine/libav_packets.h"
#include "machine/libav_video.h"
#include "machine/module.h"

namespace {
constexpr trammel::machine::VideoModule kModule = {trammel::machine::OpenLibavVideo,
                                                   trammel::machine::OpenLibavPackets};
}  // namespace

TRAMMEL_MODULE(kModule)
