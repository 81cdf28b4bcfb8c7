// trammel-aravis.so: GigE Vision and USB3 Vision cameras, through Aravis.
#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/camera/raw_picture.h"
#include "machine/module/module.h"
#include "machine/net/host_clock.h"

namespace trammel::machine {
namespace {

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
/// Owning reference to a GObject.
template <class T>
using Held = std::unique_ptr<T, Unref>;

/// Error of one call to Aravis.
class Trouble {
 public:
  Trouble() = default;
  ~Trouble() { g_clear_error(&error_); }
  Trouble(const Trouble&) = delete;
  Trouble& operator=(const Trouble&) = delete;

  /// Clears the error and returns its address.
  [[nodiscard]] GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  [[nodiscard]] bool occurred() const { return error_ != nullptr; }
  [[nodiscard]] bool IsNotFound() const {
    return g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND) != FALSE;
  }
  [[nodiscard]] std::string text() const {
    return error_ != nullptr && error_->message != nullptr ? error_->message : "no reason given";
  }

 private:
  GError* error_ = nullptr;
};

struct OpenedArvCamera {
  Held<ArvCamera> camera;
  std::string id;  ///< requested id, or the only camera's
};

std::string TextOf(const char* text) { return text != nullptr ? text : ""; }

struct FoundCamera {
  std::string id;
  std::string line;  ///< list entry: id and type of connection
};

std::vector<FoundCamera> LookForCameras() {
  std::vector<FoundCamera> found;
  arv_update_device_list();
  constexpr unsigned kMax = 32;
  const unsigned count = std::min(arv_get_n_devices(), kMax);
  for (unsigned i = 0; i < count; ++i) {
    FoundCamera camera;
    camera.id = TextOf(arv_get_device_id(i));
    camera.line = fmt::format("aravis:{} ({}, {})", camera.id, TextOf(arv_get_device_protocol(i)),
                              TextOf(arv_get_device_address(i)));
    found.push_back(std::move(camera));
  }
  return found;
}

std::string ListOf(const std::vector<FoundCamera>& cameras) {
  std::string list;
  for (const FoundCamera& camera : cameras) list += (list.empty() ? "" : ", ") + camera.line;
  return list;
}

constexpr const char* kWhereToLook =
    "check power and cable; a GigE camera must have an address in the network of this machine's "
    "interface, and no firewall before it; a USB camera needs a udev rule that lets the user open "
    "it";

tl::unexpected<Error> NotThere(const std::string& id) {
  const std::vector<FoundCamera> cameras = LookForCameras();
  return Fail(fmt::format("camera aravis:{}: there is no such camera; {}", id,
                          cameras.empty() ? fmt::format("none was found: {}", kWhereToLook)
                                          : fmt::format("there are: {}", ListOf(cameras))),
              ErrorKind::kMachine);
}

Result<std::string> TheOnlyCamera() {
  const std::vector<FoundCamera> cameras = LookForCameras();
  if (cameras.size() == 1) return cameras.front().id;
  if (cameras.empty()) {
    return Fail(fmt::format("camera aravis: no camera was found; {}", kWhereToLook),
                ErrorKind::kMachine);
  }
  return Fail(
      fmt::format("camera aravis: several cameras are there, name one of: {}", ListOf(cameras)),
      ErrorKind::kMachine);
}

/// Searches all network interfaces and the USB, which takes one to a few seconds that `stop` does
/// not shorten.
/// @param id  as listed by arv-tool, a serial number, or an IP address; empty: the only camera.
/// @returns errors: kMachine with those found, if none has that id, or there are several
///          and no id; kMachine if it does not open; kInterrupted.
Result<OpenedArvCamera> OpenArvCamera(const std::string& id, const std::stop_token& stop) {
  std::string chosen = TRY(id.empty() ? TheOnlyCamera() : Result<std::string>(id));
  const auto stopped = [&] {
    return Fail(fmt::format("camera aravis:{}: stopped", chosen), ErrorKind::kInterrupted);
  };
  if (stop.stop_requested()) return stopped();
  Trouble trouble;
  Held<ArvCamera> camera(arv_camera_new(chosen.c_str(), trouble.out()));
  if (stop.stop_requested()) return stopped();
  if (camera && !trouble.occurred()) return OpenedArvCamera{std::move(camera), chosen};
  if (!camera && (trouble.IsNotFound() || !trouble.occurred())) return NotThere(chosen);
  return Fail(fmt::format("camera aravis:{}: does not open ({}); is it in use by another program, "
                          "or may the user not open it?",
                          chosen, trouble.text()),
              ErrorKind::kMachine);
}

constexpr std::string_view kScheme = "aravis:";
constexpr const char* kBestFormat = "Mono8";

// A quarter of a second at 30 frames/s: the client may be blocked that long without a loss.
constexpr std::size_t kMaxBuffers = 8;
constexpr std::size_t kFewestBuffers = 3;
constexpr std::size_t kMaxBufferBytes = 256'000'000;        // all buffers, beyond the minimum
constexpr std::size_t kMaxPayloadBytes = 3 * 50'000'000UL;  // 50 megapixels of RGB
constexpr std::size_t kMaxSocketBytes = 64'000'000;
constexpr double kLongestExposure_s = 60;
// Maximum delay in detecting a stop request, or the loss of the camera.
constexpr double kLook_s = 0.02;

/// Simultaneous readings of the wall clock and the monotonic one. A delay between the two readings
/// makes them disagree, so the closest pair is used.
struct Clocks {
  double wall_s = 0;
  double host_s = 0;
};
Clocks ReadClocks() {
  constexpr int kTries = 5;
  constexpr double kClose_s = 1e-4;
  Clocks best;
  double min_s = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kTries && min_s > kClose_s; ++i) {
    const double before_s = HostNow();
    const double wall_s = 1e-6 * static_cast<double>(g_get_real_time());
    const double after_s = HostNow();
    if (after_s - before_s >= min_s) continue;
    min_s = after_s - before_s;
    best = {wall_s, 0.5 * (before_s + after_s)};
  }
  return best;
}

std::string_view StatusText(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "not all of its packets came in time";
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets of it are missing: allow larger socket buffers (sysctl net.core.rmem_max) or "
             "larger packets (the MTU of the network's interface)";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "its packets came in a wrong order";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "it has another size than the camera stated";
    case ARV_BUFFER_STATUS_ABORTED:
      return "it was broken off";
    default:
      return "it did not come whole";
  }
}

using Flag = std::shared_ptr<std::atomic<bool>>;

// Called from Aravis' own threads; the closure owns its share of the flag.
void OnControlLost(ArvDevice*, gpointer flag) { (*static_cast<Flag*>(flag))->store(true); }
void DropFlag(gpointer flag, GClosure*) { delete static_cast<Flag*>(flag); }

/// Makes Aravis read a stream through the socket. As root it would bypass it, and until its filter
/// is active every packet of the interface would count as the camera's, and foreign ones would
/// become pictures.
void ReadThroughSocket(ArvCamera* camera) {
  if (arv_camera_is_gv_device(camera)) {
    arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  }
}

/// Enlarges the socket's buffer for two pictures that arrive while the program is blocked: the
/// system's usual 200 kB are less than one. The kernel silently limits it to net.core.rmem_max.
void WidenSocket(ArvStream* stream, std::size_t payload_bytes) {
  if (!ARV_IS_GV_STREAM(stream)) return;
  g_object_set(stream, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
               static_cast<gint>(std::min(2 * payload_bytes, kMaxSocketBytes)), nullptr);
}

class AravisCamera final : public FrameSource {
 public:
  AravisCamera(std::string name, Held<ArvCamera> camera, int jpeg_quality)
      : name_(std::move(name)), camera_(std::move(camera)), jpeg_quality_(jpeg_quality) {}
  ~AravisCamera() override {
    if (watch_ != 0) g_signal_handler_disconnect(arv_camera_get_device(camera_.get()), watch_);
    Trouble ignored;  // a camera that is gone cannot be told to stop, and waiting for it takes long
    if (started_ && !*lost_) arv_camera_stop_acquisition(camera_.get(), ignored.out());
  }
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  Result<void> Start();
  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override {
    return fmt::format("camera {}, {}x{} px {}, capture times on {}", name_, width_px_, height_px_,
                       PixelFormatName(pixel_format_), ToString(CameraClock::kOurs));
  }
  [[nodiscard]] bool live() const override { return true; }

 private:
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("camera {}: {}", name_, what), ErrorKind::kMachine);
  }
  Result<void> CheckFormat();
  Result<void> CheckSize();
  void ReadExposure();
  Result<void> SetContinuous();
  Result<void> StartStream();
  Result<CapturedFrame> FrameOf(ArvBuffer* buffer);
  void Stamp(ArvBuffer* buffer, CapturedFrame& frame);
  std::uint64_t Sequence(std::uint64_t id);

  std::string name_;  ///< camera's address
  Held<ArvCamera> camera_;
  Held<ArvStream> stream_;  // ends before the camera
  int jpeg_quality_ = 0;
  gulong watch_ = 0;
  Flag lost_ = std::make_shared<std::atomic<bool>>(false);
  bool started_ = false;
  std::uint32_t pixel_format_ = 0;
  int width_px_ = 0;
  int height_px_ = 0;
  std::size_t payload_bytes_ = 0;
  double exposure_s_ = 0;
  WallStamps stamps_;
  FrameChecker checker_;
  std::size_t frames_ = 0;
  std::uint64_t last_id_ = 0;
  std::uint64_t id_base_ = 0;
};

Result<void> AravisCamera::CheckFormat() {
  Trouble trouble;
  pixel_format_ = arv_camera_get_pixel_format(camera_.get(), trouble.out());
  if (trouble.occurred()) {
    return Broken(fmt::format("does not say its pixel format ({})", trouble.text()));
  }
  if (IsReadPixelFormat(pixel_format_)) return {};
  const char* text = arv_camera_get_pixel_format_as_string(camera_.get(), trouble.out());
  const std::string format = text != nullptr ? text : PixelFormatName(pixel_format_);
  unsigned count = 0;
  gint64* offered = arv_camera_dup_available_pixel_formats(camera_.get(), &count, trouble.out());
  std::vector<std::string> read;
  for (unsigned i = 0; offered != nullptr && i < count; ++i) {
    const auto code = static_cast<std::uint32_t>(offered[i]);
    if (IsReadPixelFormat(code)) read.push_back(PixelFormatName(code));
  }
  g_free(offered);
  const std::string what =
      fmt::format("delivers {}, which is not read; read are {}", format, ReadPixelFormats());
  if (read.empty()) return Broken(what + ", and it offers none of these");
  // Prefers grey: a Bayer pattern shifts edges.
  const bool grey = std::find(read.begin(), read.end(), kBestFormat) != read.end();
  return Broken(fmt::format("{}: set it with arv-tool-0.8 -n {} control PixelFormat={}", what,
                            name_.substr(kScheme.size()), grey ? kBestFormat : read.front()));
}

Result<void> AravisCamera::CheckSize() {
  Trouble trouble;
  int x = 0;
  int y = 0;
  arv_camera_get_region(camera_.get(), &x, &y, &width_px_, &height_px_, trouble.out());
  if (trouble.occurred()) {
    return Broken(fmt::format("does not say its picture's size ({})", trouble.text()));
  }
  payload_bytes_ = arv_camera_get_payload(camera_.get(), trouble.out());
  if (trouble.occurred()) {
    return Broken(fmt::format("does not say how large its pictures are ({})", trouble.text()));
  }
  if (width_px_ < 1 || height_px_ < 1 || payload_bytes_ < 1 || payload_bytes_ > kMaxPayloadBytes) {
    return Broken(
        fmt::format("states pictures of {}x{} px in {} bytes; at most {} bytes are read: "
                    "set a smaller region",
                    width_px_, height_px_, payload_bytes_, kMaxPayloadBytes));
  }
  return {};
}

/// Not every camera reports it; the capture times are then those of the first packets.
void AravisCamera::ReadExposure() {
  Trouble trouble;
  if (!arv_camera_is_exposure_time_available(camera_.get(), trouble.out())) return;
  const double exposure_s = 1e-6 * arv_camera_get_exposure_time(camera_.get(), trouble.out());
  const bool sound = !trouble.occurred() && exposure_s >= 0 && exposure_s <= kLongestExposure_s;
  if (sound) exposure_s_ = exposure_s;
}

Result<void> AravisCamera::SetContinuous() {
  Trouble trouble;
  const auto mode = arv_camera_get_acquisition_mode(camera_.get(), trouble.out());
  // A camera without the feature has no other mode.
  if (trouble.occurred() || mode == ARV_ACQUISITION_MODE_CONTINUOUS) return {};
  arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, trouble.out());
  if (!trouble.occurred()) return {};
  return Broken(
      fmt::format("does not let AcquisitionMode be set to Continuous ({}); is another "
                  "program using it?",
                  trouble.text()));
}

Result<void> AravisCamera::StartStream() {
  Trouble trouble;
  ReadThroughSocket(camera_.get());
  stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, trouble.out()));
  if (!stream_ || trouble.occurred()) {
    return Broken(
        fmt::format("gives no stream ({}); is another program using it?", trouble.text()));
  }
  WidenSocket(stream_.get(), payload_bytes_);
  const std::size_t buffers =
      std::clamp(kMaxBufferBytes / payload_bytes_, kFewestBuffers, kMaxBuffers);
  for (std::size_t i = 0; i < buffers; ++i) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload_bytes_));
  }
  watch_ = g_signal_connect_data(arv_camera_get_device(camera_.get()), "control-lost",
                                 G_CALLBACK(OnControlLost), new Flag(lost_), DropFlag,
                                 static_cast<GConnectFlags>(0));
  arv_camera_start_acquisition(camera_.get(), trouble.out());
  if (trouble.occurred()) {
    return Broken(fmt::format("does not start ({}); is another program using it?", trouble.text()));
  }
  started_ = true;
  return {};
}

Result<void> AravisCamera::Start() {
  TRY(CheckFormat());
  TRY(CheckSize());
  ReadExposure();
  TRY(SetContinuous());
  return StartStream();
}

void AravisCamera::Stamp(ArvBuffer* buffer, CapturedFrame& frame) {
  const double wall_s = 1e-9 * static_cast<double>(arv_buffer_get_system_timestamp(buffer));
  const Clocks now = ReadClocks();
  if (const auto begun_s = stamps_.OnHostClock(wall_s, now.wall_s, now.host_s)) {
    frame.captured = CameraTime{*begun_s - exposure_s_, CameraClock::kOurs};
  }
  frame.sequence = Sequence(arv_buffer_get_frame_id(buffer));
}

/// Unwraps the 16-bit counter of GigE Vision 1, which skips 0.
std::uint64_t AravisCamera::Sequence(std::uint64_t id) {
  constexpr std::uint64_t kTurn = 65535;
  if (id < last_id_ && last_id_ <= kTurn && last_id_ - id > kTurn / 2) id_base_ += kTurn;
  last_id_ = id;
  return id_base_ + id;
}

Result<CapturedFrame> AravisCamera::FrameOf(ArvBuffer* buffer) {
  CapturedFrame frame;
  frame.arrival_s = HostNow();
  ++frames_;
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  if (status != ARV_BUFFER_STATUS_SUCCESS || arv_buffer_get_n_parts(buffer) < 1) {
    frame.width_px = width_px_;
    frame.height_px = height_px_;
    frame.fault = FrameFault::kCutOff;
    frame.fault_text = StatusText(status);
    return frame;  // no time or number: the buffer's may be from an earlier picture
  }
  Stamp(buffer, frame);
  RawPicture raw;
  raw.pixel_format = arv_buffer_get_image_pixel_format(buffer);
  arv_buffer_get_image_region(buffer, nullptr, nullptr, &raw.width_px, &raw.height_px);
  int padding = 0;
  arv_buffer_get_image_padding(buffer, &padding, nullptr);
  raw.row_padding_bytes = static_cast<std::size_t>(std::max(padding, 0));
  std::size_t size = 0;
  const void* data = arv_buffer_get_image_data(buffer, &size);
  if (data != nullptr) raw.bytes = {static_cast<const std::uint8_t*>(data), size};
  auto picture = ToPicture(raw, jpeg_quality_);
  if (!picture) return Broken(fmt::format("frame {}: {}", frames_, picture.error().message));
  frame.image = std::move(*picture);
  checker_.Check(frame);
  return frame;
}

Result<std::optional<CapturedFrame>> AravisCamera::Next(double time_limit_s, std::stop_token stop) {
  const double deadline_s = HostNow() + time_limit_s;
  for (;;) {
    if (stop.stop_requested()) {
      return Fail(fmt::format("camera {}: stopped", name_), ErrorKind::kInterrupted);
    }
    const double wait_s = std::clamp(deadline_s - HostNow(), 0.0, kLook_s);
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(
        stream_.get(), static_cast<std::uint64_t>(std::llround(wait_s * 1e6)));
    if (buffer != nullptr) {
      auto frame = FrameOf(buffer);
      arv_stream_push_buffer(stream_.get(), buffer);
      if (!frame) return tl::unexpected(frame.error());
      return std::move(*frame);
    }
    if (*lost_) {
      return Broken(
          fmt::format("was lost after {} frames; check its power and cable, and whether "
                      "another program took it",
                      frames_));
    }
    if (HostNow() >= deadline_s) {
      return Broken(
          fmt::format("no frame within {:g} s (after {} frames); does it wait for a "
                      "trigger (TriggerMode), is its exposure longer than that, or does "
                      "a firewall keep its packets away?",
                      time_limit_s, frames_));
    }
  }
}

Result<std::unique_ptr<FrameSource>> Open(const std::string& id, const CameraOptions& options,
                                          const std::stop_token& stop) {
  auto opened = TRY(OpenArvCamera(id, stop));
  auto camera = std::make_unique<AravisCamera>(std::string(kScheme) + opened.id,
                                               std::move(opened.camera), options.jpeg_quality);
  TRY(camera->Start());
  return camera;
}

constexpr AravisModule kModule = {Open};

}  // namespace
}  // namespace trammel::machine

TRAMMEL_MODULE(trammel::machine::kModule)
