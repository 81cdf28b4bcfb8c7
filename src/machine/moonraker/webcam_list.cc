#include "machine/moonraker/webcam_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "base/utf8.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr std::size_t kMaxWebcams = 100;
constexpr std::size_t kLongestName = 200;

std::string Absolute(const std::string& url, const MoonrakerAddress& address) {
  if (url.empty() || url.find("://") != std::string::npos) return url;
  if (url.starts_with("//")) {  // another host, by the scheme of the page that names it
    return (address.transport == Transport::kTls ? "https:" : "http:") + url;
  }
  // Like browsers: below the interface's own folder, unless it begins at the host's root.
  const std::string path = url.front() == '/' ? url : address.path_prefix + "/" + url;
  if (address.transport == Transport::kUnix) {
    return "http://localhost" + path;
  }
  const bool behind_proxy =
      address.transport == Transport::kTls || address.port == 80 || !address.path_prefix.empty();
  if (behind_proxy) {
    return fmt::format("{}://{}{}", address.transport == Transport::kTls ? "https" : "http",
                       address.Authority(), path);
  }
  MoonrakerAddress web = address;
  web.port = 80;
  return web.HttpUrl() + path;
}

}  // namespace

std::vector<Webcam> ReadWebcams(const json& answer, const MoonrakerAddress& address) {
  std::vector<Webcam> webcams;
  const json* list = Member(answer, "webcams");
  if (list == nullptr || !list->is_array()) return webcams;
  for (const json& entry : *list) {
    Webcam webcam;
    webcam.name = Utf8OrReplaced(TextOr(entry, "name", ""), kLongestName);
    webcam.service = Utf8OrReplaced(TextOr(entry, "service", ""), kLongestName);
    webcam.stream_url = Absolute(TextOr(entry, "stream_url", ""), address);
    webcam.enabled = BoolOr(entry, "enabled", true);
    if (!webcam.name.empty() && webcams.size() < kMaxWebcams) webcams.push_back(std::move(webcam));
  }
  return webcams;
}

namespace {

/// Services with MJPEG at stream_url, of those that Mainsail, Fluidd and Moonraker write.
constexpr std::array<std::string_view, 4> kMjpegServices = {
    "mjpegstreamer", "mjpegstreamer-adaptive", "mjpegadaptive", "uv4l-mjpeg"};

bool IsMjpeg(const Webcam& webcam) {
  return webcam.service.empty() || std::find(kMjpegServices.begin(), kMjpegServices.end(),
                                             webcam.service) != kMjpegServices.end();
}

}  // namespace

Result<Webcam> ChooseWebcam(const std::vector<Webcam>& webcams, const std::string& name) {
  const Webcam* other = nullptr;
  for (const Webcam& webcam : webcams) {
    if (!webcam.enabled || (!name.empty() && webcam.name != name)) continue;
    if (IsMjpeg(webcam)) return webcam;
    if (other == nullptr) other = &webcam;
  }
  if (other == nullptr) {
    return Fail(fmt::format("the printer's server lists no camera{}: set [camera] url to the "
                            "stream's address",
                            name.empty() ? "" : " named " + name),
                ErrorKind::kMachine);
  }
  return Fail(
      fmt::format(
          "the printer's server lists the camera {} as {}, which is no MJPEG stream: set "
          "[camera] url to its MJPEG address, with camera-streamer http://HOST/webcam/stream, "
          "with go2rtc http://HOST:1984/api/stream.mjpeg?src=NAME, else often "
          "http://HOST/webcam/?action=stream",
          other->name, other->service),
      ErrorKind::kMachine);
}

}  // namespace trammel::machine
