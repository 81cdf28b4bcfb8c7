// The sources of frames behind OpenCamera(): a stream over HTTP, a device of this machine, an
// industrial camera, a recording.
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

/// Connects, asks for the stream (with ustreamer's time headers, and without them where the server
/// refuses that), and checks that the answer is a stream of pictures. See OpenCamera().
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenMjpegStream(const std::string& address,
                                                                   const CameraOptions& options,
                                                                   const std::stop_token& stop);

/// Reads a part's times and marks from its header fields into the frame (docs/howto/cameras.md has
/// them). Fields that are no sensible numbers count as absent.
void ReadFrameFields(const HeaderFields& fields, CapturedFrame& frame);

/// The system calls that a device needs: the seam at which tests put a device that is not there.
/// Numbers below zero are negated error codes.
class DeviceCalls {
 public:
  virtual ~DeviceCalls() = default;
  virtual int Open(const std::string& path) = 0;
  virtual int Control(int fd, unsigned long request, void* argument) = 0;
  virtual void* Map(int fd, std::size_t length, std::size_t offset) = 0;  ///< null where it fails
  virtual void Unmap(void* memory, std::size_t length) = 0;
  virtual void Close(int fd) = 0;
};

/// The kernel's.
[[nodiscard]] std::shared_ptr<DeviceCalls> SystemDeviceCalls();

/// Asks the device for MJPEG in the options' size and rate and starts it. A device that gives
/// another size is taken as it is; Describe() says which. A device without MJPEG is an error that
/// names what it offers: encoding 1280x720 pictures would cost more than a core of a small printer
/// host.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenV4l2Camera(
    const std::string& path, const CameraOptions& options,
    const std::shared_ptr<DeviceCalls>& calls = SystemDeviceCalls());

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

struct AravisModule {
  /// OpenAravisCamera()'s contract, for an id that can be one.
  Result<std::unique_ptr<FrameSource>> (*open)(const std::string& id, const CameraOptions& options,
                                               const std::stop_token& stop);
};

/// MJPEG in AVI, whose frames come out as they are stored. Another video is an error with the
/// command that converts it. Errors are kMeasurement. A recording that was killed ends where it was
/// cut.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenVideoFrames(
    const std::filesystem::path& path, const CameraOptions& options);

/// The files *.jpg, *.jpeg and *.png of a folder in the order of their names, in which numbers
/// count as numbers (frame9 before frame10). The sequence is the place in that order; there are no
/// times.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenImageFolder(
    const std::filesystem::path& folder, const CameraOptions& options);

}  // namespace trammel::machine
