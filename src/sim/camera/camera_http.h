// Clients that a local server accepts: not a foreign web page in a browser on this computer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::sim {

/// True if a request's Host names this computer (by a number, or as localhost): a name made to
/// resolve to it does not. An empty one is of no browser.
[[nodiscard]] bool IsOwnHost(std::string_view host);

/// True if a request's Origin is a page of this computer. An empty one is of no page.
[[nodiscard]] bool IsOwnOrigin(std::string_view origin);

/// Time headers of the stream.
enum class CameraHeaders {
  kUstreamer6,  ///< X-Timestamp; with ?extra_headers=1 X-UStreamer-Grab-Begin-Time and more
  kUstreamer4,  ///< the same with X-UStreamer-Grab-Time
  kNone,        ///< no times at all, as camera-streamer
};

/// Frame on its way to the clients. Times on the host's monotonic clock.
struct CameraPart {
  std::int64_t frame = 0;  ///< counted from the server's start, lost ones included
  std::shared_ptr<const std::vector<std::uint8_t>> jpeg;
  int width_px = 0;
  int height_px = 0;
  double stamp_s = 0;  ///< capture time as the headers say it
  bool half = false;   ///< breaks off in the middle; then the connection closes
};

/// Returns the host's monotonic clock (CLOCK_MONOTONIC), s.
[[nodiscard]] double MonotonicNow();

/// Serves /stream, /?action=stream, /snapshot and /?action=snapshot on 127.0.0.1 from its own
/// thread. Thread-safe.
class CameraHttp {
 public:
  /// Called from the server's thread when sending of a frame to its first client begins.
  using OnSent = std::function<void(const CameraPart&, double sent_s)>;

  /// @param port  0 takes a free one.
  /// Error (kMachine): the port cannot be listened on.
  [[nodiscard]] static Result<std::unique_ptr<CameraHttp>> Listen(int port, CameraHeaders headers,
                                                                  OnSent on_sent);
  virtual ~CameraHttp() = default;

  [[nodiscard]] virtual int port() const = 0;
  /// True if any client waits for a frame.
  [[nodiscard]] virtual bool wanted() const = 0;
  /// Sends a frame to all clients at due_s, or at once if that has passed. REQUIRES that due_s does
  /// not decrease from call to call.
  virtual void Publish(CameraPart part, double due_s) = 0;
  /// If closed, ends every connection, and every new one at once.
  virtual void SetOpen(bool open) = 0;
};

struct CameraRequest {
  enum class What { kStream, kSnapshot, kUnknown };
  What what = What::kUnknown;
  bool extra_headers = false;
};

/// Parses "/stream", "/snapshot", "/?action=stream", "/?action=snapshot" and "extra_headers=1";
/// other targets are kUnknown. Never fails.
[[nodiscard]] CameraRequest ParseTarget(std::string_view target);

/// Returns the header before the first frame.
[[nodiscard]] std::string StreamHead(CameraHeaders style);

/// Times of a frame that are known only when it is sent.
struct SendTimes {
  double monotonic_s = 0;
  double wall_s = 0;  ///< since 1970
};

/// Returns the header before each frame of a stream.
[[nodiscard]] std::string PartHead(CameraHeaders style, bool extra_headers, const CameraPart& part,
                                   const SendTimes& send);

/// Returns the trailer after each frame of a stream: the boundary of the next.
[[nodiscard]] std::string PartTail(CameraHeaders style);

/// Returns the header of a snapshot.
[[nodiscard]] std::string SnapshotHead(CameraHeaders style, const CameraPart& part,
                                       const SendTimes& send);

/// Returns a complete answer without a picture.
[[nodiscard]] std::string PlainAnswer(int status, std::string_view reason, std::string_view text);

}  // namespace trammel::sim
