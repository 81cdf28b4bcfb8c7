// A camera on this machine, through the kernel's V4L2: MJPEG buffers with their capture times.
#pragma once

#include <cstddef>
#include <memory>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/camera/camera.h"

namespace trammel::machine {

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

}  // namespace trammel::machine
