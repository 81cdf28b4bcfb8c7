// A small MJPEG client for tests, which shares nothing with the one under src/machine.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "base/frame.h"

namespace trammel::sim {

/// A blocking HTTP connection to 127.0.0.1. Every wait ends after five seconds with an exception
/// that names what was waited for.
class CameraTestClient {
 public:
  /// Connects and sends "GET target".
  CameraTestClient(int port, const std::string& target, const std::string& method = "GET",
                   const std::string& headers = "Host: 127.0.0.1\r\n");
  ~CameraTestClient();
  CameraTestClient(const CameraTestClient&) = delete;
  CameraTestClient& operator=(const CameraTestClient&) = delete;

  struct Part {
    std::map<std::string, std::string> headers;
    std::string body;
    [[nodiscard]] double number(const std::string& header) const;
  };

  /// Status line and headers of the answer.
  [[nodiscard]] std::string ReadHead();
  /// The next frame of a stream; nothing where the connection ends first. `body` then holds what
  /// arrived of it.
  [[nodiscard]] std::optional<Part> ReadPart();
  /// Returns the incomplete part at the connection's end.
  [[nodiscard]] const std::string& rest() const { return buffer_; }
  /// Everything until the connection ends.
  [[nodiscard]] std::string ReadAll();

 private:
  [[nodiscard]] bool Fill(const char* what);  // false at the end of the connection

  int socket_ = -1;
  std::string buffer_;
};

/// Throws on what is no JPEG.
[[nodiscard]] Frame DecodeJpeg(const std::string& jpeg);

}  // namespace trammel::sim
