// The V4L2 source against a device that exists only here, behind the seam of system calls.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

#include "machine/camera/camera_sources.h"
#include "support/matchers.h"
#include "support/test_pictures.h"

namespace trammel::machine {
namespace {

using ::testing::HasSubstr;

/// A camera as its driver shows itself. Its descriptor is ready while it has frames.
class FakeDevice final : public DeviceCalls {
 public:
  std::uint32_t format = V4L2_PIX_FMT_MJPEG;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  int open_error = 0;
  int format_error = 0;
  int dequeue_error = 0;
  unsigned buffer_bytes = 20'000;
  struct Taken {
    std::string bytes;
    double time_s = 0;
    unsigned sequence = 0;
    std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    unsigned claimed_bytes = 0;  ///< 0: as many as there are
  };
  std::deque<Taken> frames;
  int open = 0;
  int mapped = 0;
  bool streaming = false;

  int Open(const std::string&) override {
    if (open_error != 0) return -open_error;
    ++open;
    return eventfd(1, EFD_NONBLOCK);
  }
  void* Map(int, std::size_t length, std::size_t offset) override {
    ++mapped;
    memory_.resize(std::max(memory_.size(), offset / kApart + 1));
    memory_[offset / kApart].resize(length);
    return memory_[offset / kApart].data();
  }
  void Unmap(void*, std::size_t) override { --mapped; }
  void Close(int fd) override {
    --open;
    close(fd);
  }
  int Control(int fd, unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = capabilities;
        return 0;
      case VIDIOC_ENUM_FMT: {
        auto* wanted = static_cast<v4l2_fmtdesc*>(argument);
        if (wanted->index > 0) return -EINVAL;
        wanted->pixelformat = format;
        return 0;
      }
      case VIDIOC_S_FMT:
        static_cast<v4l2_format*>(argument)->fmt.pix.pixelformat = format;
        return -format_error;
      case VIDIOC_S_PARM:
        return 0;
      case VIDIOC_REQBUFS:
        static_cast<v4l2_requestbuffers*>(argument)->count = 4;
        return 0;
      case VIDIOC_QUERYBUF: {
        auto* buffer = static_cast<v4l2_buffer*>(argument);
        buffer->length = buffer_bytes;
        buffer->m.offset = static_cast<unsigned>(buffer->index * kApart);
        return 0;
      }
      case VIDIOC_QBUF:
        free_.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_STREAMON:
      case VIDIOC_STREAMOFF:
        streaming = request == VIDIOC_STREAMON;
        return 0;
      case VIDIOC_DQBUF:
        return Dequeue(fd, static_cast<v4l2_buffer*>(argument));
      default:
        return -ENOTTY;
    }
  }

 private:
  static constexpr std::size_t kApart = 1 << 20;

  int Dequeue(int fd, v4l2_buffer* buffer) {
    if (dequeue_error != 0) return -dequeue_error;
    if (frames.empty() || free_.empty()) {
      std::uint64_t count = 0;
      [[maybe_unused]] const auto drained = read(fd, &count, sizeof count);
      return -EAGAIN;
    }
    const Taken frame = frames.front();
    frames.pop_front();
    buffer->index = free_.front();
    free_.pop_front();
    std::memcpy(memory_[buffer->index].data(), frame.bytes.data(), frame.bytes.size());
    buffer->bytesused =
        frame.claimed_bytes > 0 ? frame.claimed_bytes : static_cast<unsigned>(frame.bytes.size());
    buffer->timestamp.tv_sec = static_cast<long>(frame.time_s);
    buffer->timestamp.tv_usec =
        static_cast<long>((frame.time_s - static_cast<double>(buffer->timestamp.tv_sec)) * 1e6);
    buffer->flags = frame.flags;
    buffer->sequence = frame.sequence;
    return 0;
  }

  std::vector<std::vector<char>> memory_;
  std::deque<unsigned> free_;
};

class V4l2CameraTest : public testing::Test {
 protected:
  Result<std::unique_ptr<FrameSource>> Open() { return OpenV4l2Camera("/dev/video7", {}, device_); }
  std::string OpenError() {
    auto camera = Open();
    EXPECT_FALSE(camera);
    if (camera) return "";
    EXPECT_EQ(camera.error().kind, ErrorKind::kMachine);
    EXPECT_THAT(camera.error().message, HasSubstr("/dev/video7"));
    EXPECT_EQ(device_->open, 0);
    return camera.error().message;
  }
  std::string picture_ = test::JpegOf(test::TestPicture(64, 48, 0));
  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
};

TEST_F(V4l2CameraTest, DeliversBuffersWithTheKernelsTimesAndCounts) {
  for (unsigned i = 0; i < 10; ++i) {
    device_->frames.push_back(
        {picture_, 100.25 + i, 5 + 2 * i, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, 0});
  }
  {
    auto camera = Must(Open());
    for (unsigned i = 0; i < 10; ++i) {
      const auto frame = Must(camera->Next(5, {}));
      EXPECT_EQ(std::string(frame->image.begin(), frame->image.end()), picture_);
      ASSERT_TRUE(frame->captured);
      EXPECT_EQ(frame->captured->clock, CameraClock::kOurs);
      EXPECT_NEAR(frame->captured->time_s, 100.25 + i, 1e-6);
      EXPECT_EQ(frame->sequence, 5 + 2 * i);
      EXPECT_EQ(frame->fault, FrameFault::kNone);
    }
    EXPECT_THAT(camera->Describe(), HasSubstr("our monotonic clock"));
  }
  EXPECT_FALSE(device_->streaming);
  EXPECT_EQ(device_->mapped, 0);
  EXPECT_EQ(device_->open, 0);
}

TEST_F(V4l2CameraTest, DoesNotBelieveTheDriver) {
  device_->frames.push_back({picture_, 1, 0, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, 4'000'000'000});
  device_->frames.push_back({picture_.substr(0, 200), 2, 1, 0, 0});
  device_->frames.push_back(
      {picture_, 3, 2, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_ERROR, 0});
  device_->frames.push_back({"", 4, 3, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, 0});
  auto camera = Must(Open());
  const auto huge = camera->Next(5, {});
  EXPECT_EQ((*huge)->image.size(), device_->buffer_bytes);
  const auto half = camera->Next(5, {});
  EXPECT_EQ((*half)->fault, FrameFault::kCutOff);
  EXPECT_FALSE((*half)->captured);
  EXPECT_EQ((**camera->Next(5, {})).fault, FrameFault::kCutOff);
  EXPECT_EQ((**camera->Next(5, {})).fault, FrameFault::kNotAnImage);
}

TEST_F(V4l2CameraTest, NamesWhatADeviceIsNot) {
  device_->open_error = ENOENT;
  EXPECT_THAT(OpenError(), HasSubstr("plugged in"));
  device_->open_error = EACCES;
  EXPECT_THAT(OpenError(), HasSubstr("group 'video'"));
  device_->open_error = 0;
  device_->capabilities = V4L2_CAP_STREAMING;
  EXPECT_THAT(OpenError(), HasSubstr("metadata"));
  device_->capabilities |= V4L2_CAP_VIDEO_CAPTURE;
  device_->format = V4L2_PIX_FMT_YUYV;
  EXPECT_THAT(OpenError(), Containing("YUYV", "ustreamer"));
  device_->format = V4L2_PIX_FMT_MJPEG;
  device_->format_error = EBUSY;
  EXPECT_THAT(OpenError(), HasSubstr("http address"));
}

TEST_F(V4l2CameraTest, NamesAStallAndAnUnpluggedCamera) {
  auto camera = Must(Open());
  EXPECT_THAT(camera->Next(0.05, {}), FailsWith("no frame within 0.05 s"));
  device_->dequeue_error = ENODEV;
  auto gone = Must(Open());
  EXPECT_THAT(gone->Next(5, {}), FailsWith("unplugged"));
}

}  // namespace
}  // namespace trammel::machine
