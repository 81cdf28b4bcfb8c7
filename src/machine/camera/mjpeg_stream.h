// MJPEG over HTTP: what ustreamer, camera-streamer, mjpg-streamer and network cameras serve.
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "machine/net/multipart.h"

namespace trammel::machine {

/// Connects, asks for the stream (with ustreamer's time headers, and without them where the server
/// refuses that), and checks that the answer is a stream of pictures. See OpenCamera().
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenMjpegStream(const std::string& address,
                                                                   const CameraOptions& options,
                                                                   const std::stop_token& stop);

/// Reads a part's times and marks from its header fields into the frame (docs/cameras.md has them).
/// Fields that are no sensible numbers count as absent.
void ReadFrameFields(const HeaderFields& fields, CapturedFrame& frame);

}  // namespace trammel::machine
