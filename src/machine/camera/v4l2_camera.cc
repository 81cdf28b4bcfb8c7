#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>
#include <utility>
#include <vector>

#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/net/host_clock.h"
#include "machine/net/wait.h"

namespace trammel::machine {
namespace {

/// A quarter of a second at 30 frames/s: the client may be blocked that long without a loss.
constexpr unsigned kBuffers = 8;

class System final : public DeviceCalls {
 public:
  int Open(const std::string& path) override {
    const int fd = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd < 0 ? -errno : fd;
  }
  int Control(int fd, unsigned long request, void* argument) override {
    for (;;) {
      const int result = ioctl(fd, request, argument);
      if (result >= 0) return result;
      if (errno != EINTR) return -errno;
    }
  }
  void* Map(int fd, std::size_t length, std::size_t offset) override {
    void* memory =
        mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, static_cast<off_t>(offset));
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void Unmap(void* memory, std::size_t length) override { munmap(memory, length); }
  void Close(int fd) override { close(fd); }
};

std::string SystemText(int code) { return std::generic_category().message(-code); }

std::string FourCharacters(std::uint32_t format) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>(format >> (8 * i) & 0x7F);
    if (c > ' ' && c < 0x7F) text += c;
  }
  return text;
}

class V4l2Camera final : public FrameSource {
 public:
  V4l2Camera(std::string path, int fd, std::shared_ptr<DeviceCalls> calls)
      : path_(std::move(path)), fd_(fd), calls_(std::move(calls)) {}
  ~V4l2Camera() override {
    if (streaming_) {
      int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      calls_->Control(fd_, VIDIOC_STREAMOFF, &type);
    }
    for (const Buffer& buffer : buffers_) calls_->Unmap(buffer.memory, buffer.length);
    calls_->Close(fd_);
  }
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

  Result<void> Start(const CameraOptions& options);
  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override {
    return fmt::format("device {}, {}x{} px MJPEG at {:g} frames/s, capture times on {}", path_,
                       width_px_, height_px_, frames_per_s_,
                       stamped_ ? ToString(CameraClock::kOurs) : "no known clock");
  }
  [[nodiscard]] bool live() const override { return true; }

 private:
  struct Buffer {
    void* memory = nullptr;
    std::size_t length = 0;
  };

  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("camera {}: {}", path_, what), ErrorKind::kMachine);
  }
  [[nodiscard]] std::string OfferedFormats() const;
  Result<void> CheckDevice();
  Result<void> SetFormat(const CameraOptions& options);
  void SetRate(double frames_per_s);
  Result<void> MapBuffers();
  Result<void> Queue(unsigned index);
  CapturedFrame FrameOf(const v4l2_buffer& buffer);

  std::string path_;
  int fd_;
  std::shared_ptr<DeviceCalls> calls_;
  std::vector<Buffer> buffers_;
  bool streaming_ = false;
  bool stamped_ = false;
  int width_px_ = 0;
  int height_px_ = 0;
  double frames_per_s_ = 0;
  FrameChecker checker_;
  std::size_t frames_ = 0;
};

std::string V4l2Camera::OfferedFormats() const {
  std::string offered;
  constexpr unsigned kMax = 32;
  for (unsigned i = 0; i < kMax; ++i) {
    v4l2_fmtdesc format{};
    format.index = i;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (calls_->Control(fd_, VIDIOC_ENUM_FMT, &format) < 0) break;
    offered += (offered.empty() ? "" : ", ") + FourCharacters(format.pixelformat);
  }
  return offered.empty() ? "nothing" : offered;
}

Result<void> V4l2Camera::CheckDevice() {
  v4l2_capability capability{};
  if (const int code = calls_->Control(fd_, VIDIOC_QUERYCAP, &capability); code < 0) {
    return Broken(fmt::format("not a video device ({}); list them with: v4l2-ctl --list-devices",
                              SystemText(code)));
  }
  const std::uint32_t able = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                 ? capability.device_caps
                                 : capability.capabilities;
  if ((able & V4L2_CAP_VIDEO_CAPTURE) == 0 || (able & V4L2_CAP_STREAMING) == 0) {
    return Broken(
        "delivers no pictures (cameras often have a second device for metadata); try "
        "the one before it");
  }
  return {};
}

Result<void> V4l2Camera::SetFormat(const CameraOptions& options) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<unsigned>(std::clamp(options.width_px, 1, 65535));
  format.fmt.pix.height = static_cast<unsigned>(std::clamp(options.height_px, 1, 65535));
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_MJPEG;
  format.fmt.pix.field = V4L2_FIELD_ANY;
  const int code = calls_->Control(fd_, VIDIOC_S_FMT, &format);
  if (code == -EBUSY) {
    return Broken(
        "in use by another program; where that is the web interface's camera server, use its "
        "http address instead");
  }
  const std::uint32_t given = format.fmt.pix.pixelformat;
  if (code < 0 || (given != V4L2_PIX_FMT_MJPEG && given != V4L2_PIX_FMT_JPEG)) {
    return Broken(fmt::format(
        "does not deliver MJPEG but {}; serve it with ustreamer or camera-streamer, which "
        "encode it, and use their http address",
        OfferedFormats()));
  }
  width_px_ = static_cast<int>(std::min(format.fmt.pix.width, 65535U));
  height_px_ = static_cast<int>(std::min(format.fmt.pix.height, 65535U));
  return {};
}

/// Sets the rate, if the device supports it; records the device's answer.
void V4l2Camera::SetRate(double frames_per_s) {
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  rate.parm.capture.timeperframe = {1000, static_cast<unsigned>(std::lround(frames_per_s * 1000))};
  calls_->Control(fd_, VIDIOC_S_PARM, &rate);
  const v4l2_fract period = rate.parm.capture.timeperframe;
  if (period.numerator > 0) {
    frames_per_s_ = static_cast<double>(period.denominator) / period.numerator;
  }
}

Result<void> V4l2Camera::Queue(unsigned index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  if (const int code = calls_->Control(fd_, VIDIOC_QBUF, &buffer); code < 0) {
    return Broken(fmt::format("takes no buffer back ({})", SystemText(code)));
  }
  return {};
}

Result<void> V4l2Camera::MapBuffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int code = calls_->Control(fd_, VIDIOC_REQBUFS, &request);
      code < 0 || request.count < 2) {
    return Broken(fmt::format("gives no buffers ({})",
                              code < 0 ? SystemText(code) : std::to_string(request.count)));
  }
  for (unsigned i = 0; i < std::min(request.count, 32U); ++i) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (const int code = calls_->Control(fd_, VIDIOC_QUERYBUF, &buffer); code < 0) {
      return Broken(fmt::format("does not say where buffer {} is ({})", i, SystemText(code)));
    }
    void* memory = calls_->Map(fd_, buffer.length, buffer.m.offset);
    if (memory == nullptr) return Broken("its buffers cannot be mapped; is memory short?");
    buffers_.push_back({memory, buffer.length});
    TRY(Queue(i));
  }
  return {};
}

Result<void> V4l2Camera::Start(const CameraOptions& options) {
  TRY(CheckDevice());
  TRY(SetFormat(options));
  SetRate(options.frames_per_s);
  TRY(MapBuffers());
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int code = calls_->Control(fd_, VIDIOC_STREAMON, &type); code < 0) {
    return Broken(fmt::format("does not start ({}); on a shared USB hub the bandwidth may be short",
                              SystemText(code)));
  }
  streaming_ = true;
  return {};
}

CapturedFrame V4l2Camera::FrameOf(const v4l2_buffer& buffer) {
  CapturedFrame frame;
  frame.arrival_s = HostNow();
  const Buffer& memory = buffers_[buffer.index];
  const auto* bytes = static_cast<const std::uint8_t*>(memory.memory);
  frame.image.assign(bytes, bytes + std::min<std::size_t>(buffer.bytesused, memory.length));
  if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    frame.captured = CameraTime{static_cast<double>(buffer.timestamp.tv_sec) +
                                    1e-6 * static_cast<double>(buffer.timestamp.tv_usec),
                                CameraClock::kOurs};
    stamped_ = true;
  }
  frame.sequence = buffer.sequence;
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    frame.fault = FrameFault::kCutOff;
    frame.fault_text = "the driver reports that the picture is damaged";
  }
  checker_.Check(frame);
  ++frames_;
  return frame;
}

Result<std::optional<CapturedFrame>> V4l2Camera::Next(double time_limit_s, std::stop_token stop) {
  const double deadline_s = HostNow() + time_limit_s;
  for (;;) {
    const Waited waited = WaitForFd(fd_, POLLIN, deadline_s, stop);
    if (waited == Waited::kStopped) {
      return Fail(fmt::format("camera {}: stopped", path_), ErrorKind::kInterrupted);
    }
    if (waited == Waited::kTimeLimit) {
      return Broken(
          fmt::format("no frame within {:g} s (after {} frames); unplug it and plug it "
                      "in again, or use a shorter cable",
                      time_limit_s, frames_));
    }
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    const int code = calls_->Control(fd_, VIDIOC_DQBUF, &buffer);
    if (code == -EAGAIN) continue;
    if (code < 0) {
      return Broken(fmt::format("gives no more frames after {} ({}); was it unplugged?", frames_,
                                SystemText(code)));
    }
    if (buffer.index >= buffers_.size()) return Broken("names a buffer that it does not have");
    CapturedFrame frame = FrameOf(buffer);
    TRY(Queue(buffer.index));
    return frame;
  }
}

}  // namespace

std::shared_ptr<DeviceCalls> SystemDeviceCalls() { return std::make_shared<System>(); }

Result<std::unique_ptr<FrameSource>> OpenV4l2Camera(const std::string& path,
                                                    const CameraOptions& options,
                                                    const std::shared_ptr<DeviceCalls>& calls) {
  const int fd = calls->Open(path);
  if (fd < 0) {
    const std::string advice = fd == -ENOENT ? "there is no such device; is the camera plugged in?"
                               : fd == -EACCES
                                   ? "may not be opened; add the user to the group 'video'"
                                   : SystemText(fd);
    return Fail(fmt::format("camera {}: {}", path, advice), ErrorKind::kMachine);
  }
  auto camera = std::make_unique<V4l2Camera>(path, fd, calls);
  TRY(camera->Start(options));
  return camera;
}

}  // namespace trammel::machine
