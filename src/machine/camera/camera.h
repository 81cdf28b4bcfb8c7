// Cameras: one interface to all sources of a sweep's frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/frame.h"
#include "base/result.h"

namespace trammel::machine {

/// Clock of a source's time stamps.
enum class CameraClock {
  kOurs,             ///< CLOCK_MONOTONIC of this machine (a V4L2 device here)
  kCameraMonotonic,  ///< CLOCK_MONOTONIC of the machine that the camera hangs on; it may be this
                     ///< one
  kCameraWall,       ///< wall clock of that machine, s since 1970; it can be set and so jump
  kRecording,        ///< a recording's own time, from its beginning
};

/// "our monotonic clock" and so on, for messages.
[[nodiscard]] std::string_view ToString(CameraClock clock);

struct CameraTime {
  double time_s = 0;
  CameraClock clock = CameraClock::kCameraMonotonic;
};

/// Fault of a frame. Such a frame is delivered, to be counted and timed, but must be neither stored
/// with the others nor scored.
enum class FrameFault {
  kNone,
  kNotAnImage,  ///< the bytes do not begin like a JPEG, or state no size
  kCutOff,      ///< a JPEG without its end, raw pixels of which some are missing
  kOtherSize,   ///< size differs from the first valid frame's
  kNoSignal,    ///< the server says that its camera is not there and sends a placeholder
  kTimeJumped,  ///< a sound picture, whose capture time is not after the one before
};

/// "cut_off" and so on, as written beside recordings.
[[nodiscard]] std::string_view ToString(FrameFault fault);

/// Picture as delivered by the source: neither decoded nor re-encoded. (Raw pixels are encoded
/// once.)
struct CapturedFrame {
  std::vector<std::uint8_t> image;  ///< JPEG or PNG; see DecodeFrame()
  int width_px = 0;                 ///< >= 1 unless fault is kNotAnImage
  int height_px = 0;                ///< >= 1 unless fault is kNotAnImage
  /// Arrival of its last byte or, from an industrial camera, its fetch; our CLOCK_MONOTONIC.
  double arrival_s = 0;
  std::optional<CameraTime> captured;     ///< capture time, if known (see docs/howto/cameras.md)
  std::optional<CameraTime> sent;         ///< start of transmission by the server, if known
  std::optional<std::uint64_t> sequence;  ///< counts the camera's frames, so that a gap is a loss
  FrameFault fault = FrameFault::kNone;
  std::string fault_text;  ///< exact fault; empty if none
};

/// Camera, or a substitute for one.
///
/// A live camera does not wait: call Next() from a thread that does little else, or the arrival
/// times of frames are those of fetching.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Returns the next frame; absent after the last one of a file or folder (a live camera has no
  /// last one). A damaged frame is a frame with a fault, not an error.
  /// @param time_limit_s  > 0; maximum wait for a complete frame.
  /// @param stop          ends the wait at once.
  /// @returns errors: kMachine if the camera is gone, the stream ended, stalled for the time limit
  ///          or violates the protocol irrecoverably (the source is then unusable, except
  ///          after a stall); kMeasurement if a recording cannot be read; kInterrupted by
  ///          `stop`.
  [[nodiscard]] virtual Result<std::optional<CapturedFrame>> Next(double time_limit_s,
                                                                  std::stop_token stop) = 0;

  /// Returns one line for logs: kind of source, frame size if known, and clock.
  [[nodiscard]] virtual std::string Describe() const = 0;

  /// True if frames arrive at the camera's own pace: one that is not fetched is lost or late.
  [[nodiscard]] virtual bool live() const = 0;
};

struct CameraOptions {
  int width_px = 1280;       ///< asked of a V4L2 device; others send what they are configured to
  int height_px = 720;       ///< likewise
  double frames_per_s = 30;  ///< likewise
  double connect_time_limit_s = 5;  ///< > 0; name look-up, connection, TLS and first answer
  std::size_t max_frame_bytes = 16'000'000;  ///< of one picture; not for a camera without MJPEG
  /// Encoding of the pictures of a camera with raw pixels: 1 … 100 as JPEG; 0 as lossless PNG.
  int jpeg_quality = 0;
  bool verify_certificate = true;  ///< HTTPS servers only
  std::filesystem::path ca_file;   ///< certificates to trust besides the system's; may be empty
};

/// Opens a camera by its address:
///   http://[user:password@]host[:port]/path?query   an MJPEG stream; https:// likewise, with TLS
///   /dev/videoN                                     a V4L2 device that delivers MJPEG
///   aravis:  or  aravis:<id>                        the only GigE Vision or USB3 Vision camera, or
///                                                   the one of that id, serial number or address
///   a file                                          an MJPEG video
///   a folder                                        its JPEG and PNG files, in the order of names
/// @returns errors that state the address, the cause and the remedy: kMachine for cameras,
///          kMeasurement for a file or folder, kInput for an address that is none of these.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenCamera(const std::string& address,
                                                              const CameraOptions& options = {},
                                                              std::stop_token stop = {});

/// Decodes a frame to 8-bit BGR, in the sensor's pixels, ignoring EXIF. Errors (kMeasurement):
/// damaged, or larger than 50 megapixels.
[[nodiscard]] Result<Frame> DecodeFrame(const CapturedFrame& frame);

/// Checks size and time from one frame of a source to the next. Does not decode.
class FrameChecker {
 public:
  /// Fills in width, height, fault and fault_text. A fault that is already set is unchanged.
  void Check(CapturedFrame& frame);

  /// Width of the first sound frame; 0 before it.
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

 private:
  int width_px_ = 0;
  int height_px_ = 0;
  std::optional<CameraTime> last_;
};

}  // namespace trammel::machine
