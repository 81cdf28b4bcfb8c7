#include "sim/camera/camera_headers.h"

#include <fmt/format.h>

namespace trammel::sim {
namespace {

constexpr std::string_view kNoCache =
    "Cache-Control: no-store, no-cache, must-revalidate, proxy-revalidate, pre-check=0, "
    "post-check=0, max-age=0\r\nPragma: no-cache\r\nExpires: Mon, 3 Jan 2000 12:34:56 GMT\r\n";

std::string_view Boundary(CameraHeaders style) {
  return style == CameraHeaders::kNone ? "123456789000000000000987654321" : "boundarydonotcross";
}

}  // namespace

CameraRequest ParseTarget(std::string_view target) {
  CameraRequest request;
  const std::size_t mark = target.find('?');
  const std::string_view path = target.substr(0, mark);
  std::string_view action;
  std::string_view rest = mark == target.npos ? std::string_view() : target.substr(mark + 1);
  while (!rest.empty()) {
    const std::size_t end = rest.find('&');
    const std::string_view pair = rest.substr(0, end);
    if (pair.starts_with("action=")) action = pair.substr(7);
    if (pair == "extra_headers=1" || pair == "extra_headers=true") request.extra_headers = true;
    rest = end == rest.npos ? std::string_view() : rest.substr(end + 1);
  }
  if (path == "/stream" || (path == "/" && action == "stream")) {
    request.what = CameraRequest::What::kStream;
  } else if (path == "/snapshot" || (path == "/" && action == "snapshot")) {
    request.what = CameraRequest::What::kSnapshot;
  }
  return request;
}

std::string StreamHead(CameraHeaders style) {
  return fmt::format(
      "HTTP/1.0 200 OK\r\n{}Content-Type: multipart/x-mixed-replace;boundary={}\r\n\r\n--{}\r\n",
      style == CameraHeaders::kNone ? std::string_view("Connection: close\r\n") : kNoCache,
      Boundary(style), Boundary(style));
}

std::string PartHead(CameraHeaders style, bool extra_headers, const CameraPart& part,
                     const SendTimes& send, const ClientCounts& counts) {
  std::string head =
      fmt::format("Content-Type: image/jpeg\r\nContent-Length: {}\r\n", part.jpeg->size());
  if (style == CameraHeaders::kNone) return head + "\r\n";
  head += fmt::format("X-Timestamp: {:.6f}\r\n", send.wall_s);
  if (!extra_headers) return head + "\r\n";
  head += fmt::format(
      "X-UStreamer-Online: true\r\nX-UStreamer-Dropped: {}\r\nX-UStreamer-Width: {}\r\n"
      "X-UStreamer-Height: {}\r\nX-UStreamer-Client-FPS: {}\r\n",
      counts.dropped, part.width_px, part.height_px, counts.frames_per_s);
  if (style == CameraHeaders::kUstreamer6) {
    head +=
        fmt::format("X-UStreamer-Grab-Begin-Time: {:.6f}\r\nX-UStreamer-Grab-End-Time: {:.6f}\r\n",
                    part.stamp_s, part.grab_end_s);
  } else {
    head += fmt::format("X-UStreamer-Grab-Time: {:.6f}\r\n", part.stamp_s);
  }
  head += fmt::format(
      "X-UStreamer-Encode-Begin-Time: {:.6f}\r\nX-UStreamer-Encode-End-Time: {:.6f}\r\n",
      part.encode_begin_s, part.encode_end_s);
  head += fmt::format(
      "X-UStreamer-Expose-Begin-Time: {0:.6f}\r\nX-UStreamer-Expose-Cmp-Time: {0:.6f}\r\n"
      "X-UStreamer-Expose-End-Time: {0:.6f}\r\nX-UStreamer-Send-Time: {1:.6f}\r\n"
      "X-UStreamer-Latency: {2:.6f}\r\n\r\n",
      part.encode_end_s, send.monotonic_s, send.monotonic_s - part.stamp_s);
  return head;
}

std::string PartTail(CameraHeaders style) { return fmt::format("\r\n--{}\r\n", Boundary(style)); }

std::string SnapshotHead(CameraHeaders style, const CameraPart& part, const SendTimes& send) {
  std::string head = "HTTP/1.1 200 OK\r\nConnection: close\r\n";
  if (style != CameraHeaders::kNone) {
    head += kNoCache;
    head += fmt::format(
        "X-Timestamp: {:.6f}\r\nX-UStreamer-Online: true\r\nX-UStreamer-Width: {}\r\n"
        "X-UStreamer-Height: {}\r\n",
        send.wall_s, part.width_px, part.height_px);
    if (style == CameraHeaders::kUstreamer6) {
      head += fmt::format(
          "X-UStreamer-Grab-Begin-Timestamp: {:.6f}\r\nX-UStreamer-Grab-End-Timestamp: {:.6f}\r\n",
          part.stamp_s, part.grab_end_s);
    } else {
      head += fmt::format("X-UStreamer-Grab-Timestamp: {:.6f}\r\n", part.stamp_s);
    }
    head += fmt::format(
        "X-UStreamer-Encode-Begin-Timestamp: {:.6f}\r\n"
        "X-UStreamer-Encode-End-Timestamp: {:.6f}\r\nX-UStreamer-Send-Timestamp: {:.6f}\r\n",
        part.encode_begin_s, part.encode_end_s, send.monotonic_s);
  }
  return head +
         fmt::format("Content-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n", part.jpeg->size());
}

std::string PlainAnswer(int status, std::string_view reason, std::string_view text) {
  return fmt::format(
      "HTTP/1.1 {} {}\r\nConnection: close\r\nContent-Type: text/plain\r\n"
      "Content-Length: {}\r\n\r\n{}",
      status, reason, text.size(), text);
}

}  // namespace trammel::sim
