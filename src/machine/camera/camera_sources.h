// Sources of frames behind OpenCamera(): a stream over HTTP, a local device, an industrial camera,
// a recording.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "machine/net/http.h"

namespace trammel::machine {

/// Connects, requests the stream (with ustreamer's time headers, and without them if the server
/// rejects these), and checks that the answer is a stream of pictures. See OpenCamera().
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenMjpegStream(const std::string& address,
                                                                   const CameraOptions& options,
                                                                   const std::stop_token& stop);

/// Reads a part's times and marks from its header fields into the frame (listed in
/// docs/howto/cameras.md). Implausible numbers count as absent.
void ReadFrameFields(const HeaderFields& fields, CapturedFrame& frame);

/// System calls for a device: the interface at which tests simulate a device. Negative numbers are
/// negated error codes.
class DeviceCalls {
 public:
  virtual ~DeviceCalls() = default;
  virtual int Open(const std::string& path) = 0;
  virtual int Control(int fd, unsigned long request, void* argument) = 0;
  virtual void* Map(int fd, std::size_t length, std::size_t offset) = 0;  ///< null where it fails
  virtual void Unmap(void* memory, std::size_t length) = 0;
  virtual void Close(int fd) = 0;
};

/// Returns the kernel's system calls.
[[nodiscard]] std::shared_ptr<DeviceCalls> SystemDeviceCalls();

/// Requests MJPEG in the options' size and rate and starts the device. A device's other size is
/// accepted; Describe() names it. A device without MJPEG is an error that lists its formats:
/// encoding 1280x720 pictures would cost more than a core of a small printer host.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenV4l2Camera(
    const std::string& path, const CameraOptions& options,
    const std::shared_ptr<DeviceCalls>& calls = SystemDeviceCalls());

/// Returns the part after "aravis:" of a camera's address, which may be empty; absent if the
/// address has another prefix.
[[nodiscard]] std::optional<std::string> AravisId(const std::string& address);

/// Opens the camera and starts it. Sets its acquisition mode to Continuous; other settings (picture
/// size, pixel format, rate, trigger, exposure, gain) are unchanged.
///
/// Frames are PNG or, with options.jpeg_quality, JPEG. captured: arrival of the picture's first
/// packet, minus the exposure time that the camera stated at opening; its clock is kOurs. A picture
/// with missing packets has the fault kCutOff and no bytes.
///
/// @param id  as listed by `arv-tool-0.8`, a serial number, or an IP address; empty: the only
///            camera. At most 256 printable ASCII characters.
/// @returns errors that name the camera: kInput for an invalid id; kMachine if it is missing
///          (lists those found), does not open or start, or has an unsupported pixel format;
///          kInterrupted. The search for cameras takes one to a few seconds, which `stop`
///          does not shorten.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenAravisCamera(
    const std::string& id, const CameraOptions& options = {}, const std::stop_token& stop = {});

struct AravisModule {
  /// Contract of OpenAravisCamera(), for a valid id.
  Result<std::unique_ptr<FrameSource>> (*open)(const std::string& id, const CameraOptions& options,
                                               const std::stop_token& stop);
};

/// Reads MJPEG in AVI, whose frames are returned as stored. Another video is an error with the
/// command that converts it. Errors are kMeasurement. A killed recording ends where it was
/// truncated.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenVideoFrames(
    const std::filesystem::path& path, const CameraOptions& options);

/// Reads the files *.jpg, *.jpeg and *.png of a folder, sorted by name with numeric order (frame9
/// before frame10). The sequence number is the position in that order; there are no times.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenImageFolder(
    const std::filesystem::path& folder, const CameraOptions& options);

}  // namespace trammel::machine
