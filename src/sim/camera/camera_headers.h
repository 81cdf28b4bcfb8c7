// The words between the pictures of an MJPEG stream.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "sim/camera/camera_http.h"

namespace trammel::sim {

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

/// What a client was sent so far.
struct ClientCounts {
  std::int64_t dropped = 0;
  int frames_per_s = 0;
};

/// Before each frame of a stream.
[[nodiscard]] std::string PartHead(CameraHeaders style, bool extra_headers, const CameraPart& part,
                                   const SendTimes& send, const ClientCounts& counts);

/// After each frame of a stream: the boundary of the next.
[[nodiscard]] std::string PartTail(CameraHeaders style);

/// Before a snapshot.
[[nodiscard]] std::string SnapshotHead(CameraHeaders style, const CameraPart& part,
                                       const SendTimes& send);

/// A whole answer without a picture.
[[nodiscard]] std::string PlainAnswer(int status, std::string_view reason, std::string_view text);

}  // namespace trammel::sim
