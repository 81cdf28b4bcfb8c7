// Whom a server on this computer answers: not a page of somewhere else in a browser that runs here.
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

/// Whether a request's Host names this computer (by a number, or as localhost): a name that was
/// made to point here does not. An empty one is of no browser.
[[nodiscard]] bool IsOwnHost(std::string_view host);

/// Whether a request's Origin is a page of this computer's. An empty one is of no page.
[[nodiscard]] bool IsOwnOrigin(std::string_view origin);

/// How the stream speaks of time.
enum class CameraHeaders {
  kUstreamer6,  ///< X-Timestamp; with ?extra_headers=1 X-UStreamer-Grab-Begin-Time and more
  kUstreamer4,  ///< the same with X-UStreamer-Grab-Time
  kNone,        ///< no times at all, as camera-streamer
};

/// One frame on its way to the clients. Times on the host's monotonic clock.
struct CameraPart {
  std::int64_t frame = 0;  ///< counted from the server's start, lost ones included
  std::shared_ptr<const std::vector<std::uint8_t>> jpeg;
  int width_px = 0;
  int height_px = 0;
  double stamp_s = 0;  ///< capture time as the headers say it
  bool half = false;   ///< breaks off in the middle; then the connection closes
};

/// The host's monotonic clock (CLOCK_MONOTONIC), s.
[[nodiscard]] double MonotonicNow();

/// Serves /stream, /?action=stream, /snapshot and /?action=snapshot on 127.0.0.1 from a thread of
/// its own. Safe to use from several threads.
class CameraHttp {
 public:
  /// Tells when a frame begins its way to the first client that gets it. Called from the server's
  /// thread.
  using OnSent = std::function<void(const CameraPart&, double sent_s)>;

  /// @param port  0 takes a free one.
  /// Error (kMachine): the port cannot be listened on.
  [[nodiscard]] static Result<std::unique_ptr<CameraHttp>> Listen(int port, CameraHeaders headers,
                                                                  OnSent on_sent);
  virtual ~CameraHttp() = default;

  [[nodiscard]] virtual int port() const = 0;
  /// Whether anybody waits for a frame.
  [[nodiscard]] virtual bool wanted() const = 0;
  /// Hands a frame to all clients at due_s, or at once when that has passed. REQUIRES that due_s
  /// does not decrease from call to call.
  virtual void Publish(CameraPart part, double due_s) = 0;
  /// Closed, it ends every connection and every new one at once.
  virtual void SetOpen(bool open) = 0;
};

/// What a client asked for.
struct CameraRequest {
  enum class What { kStream, kSnapshot, kUnknown };
  What what = What::kUnknown;
  bool extra_headers = false;
};

/// Understands "/stream", "/snapshot", "/?action=stream", "/?action=snapshot" and
/// "extra_headers=1"; anything else is kUnknown. Never fails.
[[nodiscard]] CameraRequest ParseTarget(std::string_view target);

/// Before the first frame.
[[nodiscard]] std::string StreamHead(CameraHeaders style);

/// Times of a frame that only its sending settles.
struct SendTimes {
  double monotonic_s = 0;
  double wall_s = 0;  ///< since 1970
};

/// Before each frame of a stream.
[[nodiscard]] std::string PartHead(CameraHeaders style, bool extra_headers, const CameraPart& part,
                                   const SendTimes& send);

/// After each frame of a stream: the boundary of the next.
[[nodiscard]] std::string PartTail(CameraHeaders style);

/// Before a snapshot.
[[nodiscard]] std::string SnapshotHead(CameraHeaders style, const CameraPart& part,
                                       const SendTimes& send);

/// A whole answer without a picture.
[[nodiscard]] std::string PlainAnswer(int status, std::string_view reason, std::string_view text);

}  // namespace trammel::sim
