#include "machine/moonraker/webcam_list.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/utf8.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr std::size_t kMaxWebcams = 100;
constexpr std::size_t kLongestName = 200;

std::string Absolute(const std::string& url, const MoonrakerAddress& address) {
  if (url.empty() || url.find("://") != std::string::npos) {
    return url;
  }
  const std::string path = url.front() == '/' ? url : "/" + url;
  if (address.transport == Transport::kUnix) {
    return "http://localhost" + path;
  }
  const bool behind_proxy =
      address.transport == Transport::kTls || address.port == "80" || !address.path_prefix.empty();
  if (behind_proxy) {
    return fmt::format("{}://{}{}", address.transport == Transport::kTls ? "https" : "http",
                       address.Authority(), path);
  }
  MoonrakerAddress web = address;
  web.port = "80";
  return web.HttpUrl() + path;
}

int Rotation(const json& webcam) {
  const double rotation_deg = NumberOr(webcam, "rotation", 0);
  for (const int allowed : {90, 180, 270}) {
    if (rotation_deg == allowed) {
      return allowed;
    }
  }
  return 0;
}

}  // namespace

std::vector<Webcam> ReadWebcams(const json& answer, const MoonrakerAddress& address) {
  std::vector<Webcam> webcams;
  const json* list = Member(answer, "webcams");
  if (list == nullptr || !list->is_array()) {
    return webcams;
  }
  for (const json& entry : *list) {
    Webcam webcam;
    webcam.name = Utf8OrReplaced(TextOr(entry, "name", ""), kLongestName);
    webcam.service = Utf8OrReplaced(TextOr(entry, "service", ""), kLongestName);
    webcam.stream_url = Absolute(TextOr(entry, "stream_url", ""), address);
    webcam.snapshot_url = Absolute(TextOr(entry, "snapshot_url", ""), address);
    webcam.enabled = BoolOr(entry, "enabled", true);
    webcam.flip_horizontal = BoolOr(entry, "flip_horizontal", false);
    webcam.flip_vertical = BoolOr(entry, "flip_vertical", false);
    webcam.rotation_deg = Rotation(entry);
    if (!webcam.name.empty() && webcams.size() < kMaxWebcams) {
      webcams.push_back(std::move(webcam));
    }
  }
  return webcams;
}

}  // namespace trammel::machine
