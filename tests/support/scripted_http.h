// An HTTP server on loopback that says exactly what a test wrote down.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace trammel::test {

/// Actions of a script on one connection, after the request was read.
class HttpPeer {
 public:
  explicit HttpPeer(int fd) : fd_(fd) {}
  /// False once the client has gone.
  bool Send(std::string_view bytes);
  /// Blocks until the client closes (or for 10 s).
  void WaitForClose();

 private:
  int fd_;
};

/// Serves each connection in turn with the script, on a free port of 127.0.0.1.
class ScriptedHttp {
 public:
  using Script = std::function<void(const std::string& request, HttpPeer& peer)>;
  explicit ScriptedHttp(Script script);
  ~ScriptedHttp();
  ScriptedHttp(const ScriptedHttp&) = delete;
  ScriptedHttp& operator=(const ScriptedHttp&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// "http://127.0.0.1:port" and the path.
  [[nodiscard]] std::string Url(const std::string& path) const;
  /// The requests so far: their heads, with bodies of a stated length.
  [[nodiscard]] std::vector<std::string> requests() const;

 private:
  void Serve();

  Script script_;
  std::uint16_t port_ = 0;
  int listener_ = -1;
  int wake_ = -1;
  mutable std::mutex mutex_;
  std::vector<std::string> requests_;
  std::thread thread_;
};

/// A port of 127.0.0.1 on which nothing listens.
[[nodiscard]] std::uint16_t UnusedPort();

/// "HTTP/1.0 200 OK" with an MJPEG content type.
[[nodiscard]] std::string MjpegHead(const std::string& boundary = "frame");

/// One part: delimiter, fields, length, body.
[[nodiscard]] std::string MjpegPart(const std::string& jpeg, const std::string& fields = "",
                                    const std::string& boundary = "frame");

}  // namespace trammel::test
