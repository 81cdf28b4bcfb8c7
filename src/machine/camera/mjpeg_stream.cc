#include <fmt/format.h>
#include <openssl/evp.h>

#include <charconv>
#include <cmath>
#include <mutex>
#include <random>
#include <utility>

#include "base/url_secrets.h"
#include "base/utf8.h"
#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/camera/camera_url.h"
#include "machine/camera/digest_auth.h"
#include "machine/net/host_clock.h"
#include "machine/net/http_client.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kLongestShown = 300;  // excerpt of a server's message
constexpr std::size_t kReadBytes = 64 * 1024;
/// Threshold of wall-clock times: 1970-based seconds exceed it since 2001; a monotonic clock would
/// take 31 years.
constexpr double kWallClockFrom_s = 1e9;

tl::unexpected<Error> About(const std::string& address, const Error& error) {
  return Fail(fmt::format("camera {}: {}", address, error.message), error.kind);
}

tl::unexpected<Error> Broken(const std::string& address, const std::string& what) {
  return Fail(fmt::format("camera {}: {}", address, what), ErrorKind::kMachine);
}

std::optional<double> Number(const HeaderFields& fields, std::string_view name) {
  const auto field = fields.find(name);
  if (field == fields.end()) return std::nullopt;
  const std::string& text = field->second;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  constexpr double kMax = 1e12;
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value) ||
      value <= 0 || value > kMax) {
    return std::nullopt;
  }
  return value;
}

std::optional<double> FirstNumber(const HeaderFields& fields,
                                  std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    if (const auto number = Number(fields, name)) return number;
  }
  return std::nullopt;
}

std::string Base64(const std::string& text) {
  std::string encoded(4 * ((text.size() + 2) / 3) + 1, '\0');  // OpenSSL writes a zero behind it
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(encoded.data()),
                  reinterpret_cast<const unsigned char*>(text.data()),
                  static_cast<int>(text.size()));
  encoded.pop_back();
  return encoded;
}

/// @param authorization  the value of that field; empty: Basic, where the address has a user
std::string Request(const CameraUrl& url, const std::string& target,
                    const std::string& authorization) {
  std::string text = fmt::format(
      "GET {} HTTP/1.0\r\nHost: {}\r\nUser-Agent: trammel\r\nAccept: "
      "multipart/x-mixed-replace, */*\r\nConnection: close\r\n",
      target, url.Authority());
  if (!authorization.empty()) {
    text += "Authorization: " + authorization + "\r\n";
  } else if (!url.user.empty()) {
    text += "Authorization: Basic " + Base64(url.user + ":" + url.password) + "\r\n";
  }
  return text + "\r\n";
}

/// Returns the field with the server's authentication challenge.
std::string Challenge(const HttpHead& head) {
  const auto field = head.fields.find("www-authenticate");
  return field == head.fields.end() ? "" : field->second;
}

/// Explains a status other than 200 to the user.
std::string Refusal(const HttpHead& head, const CameraUrl& url) {
  const std::string status = fmt::format("HTTP {} {}", head.status, head.reason);
  if (head.status == 401 || head.status == 403) {
    const std::string challenge = Challenge(head);
    if (!challenge.empty() && !AsksFor("Basic", challenge) && !ParseDigest(challenge)) {
      return fmt::format(
          "{}; it wants a way of authentication that is not known here ({}); set it to Basic or "
          "Digest (MD5, SHA-256)",
          status, Utf8OrReplaced(challenge, kLongestShown));
    }
    if (!url.user.empty()) {
      return status + "; it refuses them: write the right user and password into [camera] url";
    }
    return status + "; write user and password into [camera] url: http://user:password@host/…";
  }
  if (head.status == 404) {
    return status + "; check the path, for ustreamer /?action=stream or /stream";
  }
  if (head.status >= 300 && head.status < 400) {
    const auto to = head.fields.find("location");
    return fmt::format("{}; use the address it names: {}", status,
                       to == head.fields.end()
                           ? "none"
                           : Utf8OrReplaced(WithoutSecrets(to->second), kLongestShown));
  }
  if (head.status >= 500) return status + "; check that the camera is plugged in and not in use";
  return status + "; check the address";
}

/// Returns the boundary of a stream of pictures, or an error with the actual content.
Result<std::string> BoundaryOf(const HttpHead& head) {
  const auto field = head.fields.find("content-type");
  const std::string type = field == head.fields.end() ? "" : field->second.substr(0, 200);
  if (auto boundary = MultipartBoundary(type)) return *boundary;
  if (type.find("image/") == 0) {
    return Fail(fmt::format("a single picture ('{}') instead of a stream; use the stream's address "
                            "rather than the snapshot's",
                            type),
                ErrorKind::kMachine);
  }
  return Fail(fmt::format("not an MJPEG stream but '{}'; use the address of an MJPEG stream, for "
                          "ustreamer /?action=stream",
                          type.empty() ? "something without a type" : type),
              ErrorKind::kMachine);
}

/// Sends the request, and repeats it if the server requires Digest authentication.
Result<HttpAnswer> AskWithPassword(const CameraUrl& url, const std::string& target,
                                   const CameraOptions& options, double deadline_s,
                                   const std::stop_token& stop) {
  Endpoint endpoint;
  endpoint.host = url.host;
  endpoint.port = url.port;
  endpoint.tls = url.tls;
  endpoint.verify_certificate = options.verify_certificate;
  endpoint.ca_file = options.ca_file;
  endpoint.time_limit_s = options.connect_time_limit_s;
  endpoint.server = "the camera's server";
  auto opened = SendHttp(endpoint, Request(url, target, ""), deadline_s, stop);
  if (!opened || opened->head.status != 401 || url.user.empty()) return opened;
  const auto challenge = ParseDigest(Challenge(opened->head));
  if (!challenge) return opened;
  std::random_device chance;  // system randomness: nonces affect no result
  const std::string nonce = fmt::format("{:08x}{:08x}", chance(), chance());
  const std::string answer = DigestAnswer(*challenge, url.user, url.password, target, nonce);
  return SendHttp(endpoint, Request(url, target, answer), deadline_s, stop);
}

class MjpegStream final : public FrameSource {
 public:
  MjpegStream(std::string address, HttpAnswer opened, std::string boundary,
              const MultipartLimits& limits)
      : address_(std::move(address)),
        stream_(std::move(opened.stream)),
        parts_(std::move(boundary), limits) {
    const auto coding = opened.head.fields.find("transfer-encoding");
    chunked_ = coding != opened.head.fields.end() && coding->second.find("chunked") == 0;
    pending_ = std::move(opened.rest);
  }

  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override;
  [[nodiscard]] bool live() const override { return true; }

 private:
  Result<void> Feed(std::span<const std::uint8_t> bytes);
  CapturedFrame FrameOf(MultipartPart part);

  std::string address_;
  ByteStream stream_;
  MultipartReader parts_;
  bool chunked_ = false;
  bool closed_ = false;
  ChunkDecoder chunks_;
  std::vector<std::uint8_t> pending_;
  std::vector<std::uint8_t> payload_;
  mutable std::mutex seen_mutex_;  // guards the members below, read while frames arrive
  FrameChecker checker_;
  std::optional<CameraClock> clock_;
  std::uint64_t frames_ = 0;  // written by Next alone, which reads it without the mutex
};

std::string MjpegStream::Describe() const {
  const std::lock_guard lock(seen_mutex_);
  const std::string size =
      checker_.width_px() > 0 ? fmt::format(", {}x{} px", checker_.width_px(), checker_.height_px())
                              : std::string();
  return fmt::format("MJPEG stream {}{}, {}", address_, size,
                     clock_        ? fmt::format("capture times on {}", ToString(*clock_))
                     : frames_ > 0 ? std::string("without capture times")
                                   : std::string("no frame yet"));
}

Result<void> MjpegStream::Feed(std::span<const std::uint8_t> bytes) {
  const double now_s = HostNow();
  if (!chunked_) {
    parts_.Feed(bytes, now_s);
    return {};
  }
  payload_.clear();
  TRY(chunks_.Decode(bytes, payload_));
  parts_.Feed(payload_, now_s);
  return {};
}

CapturedFrame MjpegStream::FrameOf(MultipartPart part) {
  CapturedFrame frame;
  frame.arrival_s = part.arrival_s;
  frame.image = std::move(part.body);
  ReadFrameFields(part.fields, frame);
  const std::lock_guard lock(seen_mutex_);
  checker_.Check(frame);
  if (frame.captured) clock_ = frame.captured->clock;
  ++frames_;
  return frame;
}

Result<std::optional<CapturedFrame>> MjpegStream::Next(double time_limit_s, std::stop_token stop) {
  const double deadline_s = HostNow() + time_limit_s;
  std::vector<std::uint8_t> buffer(kReadBytes);
  for (;;) {
    if (!pending_.empty()) {
      const std::vector<std::uint8_t> bytes = std::exchange(pending_, {});
      if (auto fed = Feed(bytes); !fed) return About(address_, fed.error());
    }
    auto part = parts_.Take();
    if (!part) return About(address_, part.error());
    if (*part) return FrameOf(std::move(**part));
    if (closed_ || parts_.ended() || chunks_.ended()) {
      if (auto rest = parts_.TakeRest()) return FrameOf(std::move(*rest));
      return Broken(address_, fmt::format("the stream ended after {} frames; is the camera's "
                                          "server still running?",
                                          frames_));
    }
    auto read = stream_.Read(buffer, deadline_s, stop);
    if (!read) return About(address_, read.error());
    if (read->timed_out) {
      return Broken(address_, fmt::format("no frame within {:g} s (after {} frames); is the camera "
                                          "plugged in and its server's processor not overloaded?",
                                          time_limit_s, frames_));
    }
    closed_ = read->count == 0;
    if (auto fed = Feed(std::span(buffer).first(read->count)); !fed) {
      return About(address_, fed.error());
    }
  }
}

}  // namespace

void ReadFrameFields(const HeaderFields& fields, CapturedFrame& frame) {
  using enum CameraClock;
  if (const auto grab =
          FirstNumber(fields, {"x-ustreamer-grab-time", "x-ustreamer-grab-begin-time",
                               "x-ustreamer-grab-timestamp", "x-ustreamer-grab-begin-timestamp"})) {
    frame.captured = CameraTime{*grab, kCameraMonotonic};
  }
  if (const auto send =
          FirstNumber(fields, {"x-ustreamer-send-time", "x-ustreamer-send-timestamp"})) {
    frame.sent = CameraTime{*send, kCameraMonotonic};
  }
  if (const auto stamp = Number(fields, "x-timestamp")) {
    // Here ustreamer states the wall clock at sending, mjpg-streamer the kernel's capture time.
    const bool wall = *stamp >= kWallClockFrom_s;
    if (wall && !frame.sent) frame.sent = CameraTime{*stamp, kCameraWall};
    if (!wall && !frame.captured) frame.captured = CameraTime{*stamp, kCameraMonotonic};
  }
  const auto online = fields.find("x-ustreamer-online");
  if (online != fields.end() && online->second == "false") {
    frame.fault = FrameFault::kNoSignal;
    frame.fault_text = "the server has no picture from its camera and sends a placeholder";
  }
}

Result<std::unique_ptr<FrameSource>> OpenMjpegStream(const std::string& address,
                                                     const CameraOptions& options,
                                                     const std::stop_token& stop) {
  auto url = TRY(ParseCameraUrl(address));
  const std::string name = url.ToString();
  const double deadline_s = HostNow() + options.connect_time_limit_s;
  const bool asked = url.target.find("extra_headers=") != std::string::npos;
  const bool has_query = url.target.find('?') != std::string::npos;
  const std::string with_times =
      asked ? url.target : url.target + (has_query ? "&" : "?") + "extra_headers=1";
  auto opened = AskWithPassword(url, with_times, options, deadline_s, stop);
  if (opened && opened->head.status != 200 && !asked) {
    opened = AskWithPassword(url, url.target, options, deadline_s, stop);
  }
  if (!opened) return About(name, opened.error());
  if (opened->head.status != 200) return Broken(name, Refusal(opened->head, url));
  auto boundary = BoundaryOf(opened->head);
  if (!boundary) return About(name, boundary.error());
  MultipartLimits limits;
  limits.body_bytes = options.max_frame_bytes;
  return std::make_unique<MjpegStream>(name, std::move(*opened), std::move(*boundary), limits);
}

}  // namespace trammel::machine
