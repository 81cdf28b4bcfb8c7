// GigE Vision and USB3 Vision cameras, through Aravis: raw pixels with their capture times.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/camera/camera.h"

namespace trammel::machine {

/// What stands behind "aravis:" in a camera's address, which may be empty; absent where the address
/// does not begin so.
[[nodiscard]] std::optional<std::string> AravisId(const std::string& address);

/// Opens the camera and starts it. Its acquisition mode becomes Continuous; all else (picture size,
/// pixel format, rate, trigger, exposure, gain) stays as the camera has it.
///
/// Frames are PNG or, with options.jpeg_quality, JPEG. captured: when the first packet of the
/// picture was here, less the exposure time that the camera stated when it was opened; its clock is
/// kOurs. A picture of which packets are missing comes with the fault kCutOff and without bytes.
///
/// @param id  as `arv-tool-0.8` lists it, a serial number, or an IP address; empty: the only
///            camera. At most 256 printable ASCII characters.
/// @returns errors that name the camera: kInput for an id that cannot be one; kMachine where it is
///          not there (with those that are), does not open or start, or has a pixel format that is
///          not read; kInterrupted. Looking for cameras takes one to a few seconds, which `stop`
///          does not shorten.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenAravisCamera(
    const std::string& id, const CameraOptions& options = {}, const std::stop_token& stop = {});

}  // namespace trammel::machine
