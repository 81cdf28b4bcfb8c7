#include "pressure_advance/procedure/pattern_photo.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "machine/camera/camera.h"
#include "pressure_advance/procedure/guarded_run.h"

namespace trammel::procedure {
namespace {

using nlohmann::json;

constexpr double kAsk_s = 10;
constexpr double kDownload_s = 120;

/// The folder's own pictures: name and time of the last one. Files of other folders are left out.
Result<std::string> NewestPhoto(const Session& session,
                                const std::function<bool(const std::string&)>& is_result) {
  const auto listed =
      session.printer.CallServer("server.files.list", {{"root", "config"}}, session.Within(kAsk_s));
  if (!listed) return tl::unexpected(listed.error());
  const std::string folder = fmt::format("{}/", kPhotoFolder);
  std::pair<double, std::string> newest{0, ""};
  for (const json& file : *listed) {
    if (!file.is_object() || !file.contains("path") || !file["path"].is_string()) continue;
    const auto& path = file["path"].get_ref<const std::string&>();
    if (!path.starts_with(folder)) continue;
    const std::string name = path.substr(folder.size());
    if (name.find('/') != std::string::npos || PictureEnding(name).empty() || is_result(name)) {
      continue;
    }
    const auto modified = file.find("modified");
    const double time_s =
        modified != file.end() && modified->is_number() ? modified->get<double>() : 0;
    if (newest.second.empty() || time_s > newest.first) newest = {time_s, name};
  }
  if (!newest.second.empty()) return newest.second;
  return Fail(
      fmt::format("there is no photo in the folder {} beside the printer's configuration: upload "
                  "one there (JPEG, PNG, WebP or HEIC)",
                  kPhotoFolder));
}

}  // namespace

std::string PictureEnding(const std::string& name) {
  constexpr std::array<std::string_view, 6> kEndings = {".jpg",  ".jpeg", ".png",
                                                        ".webp", ".heic", ".heif"};
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot == 0) return {};
  std::string ending = name.substr(dot);
  for (char& c : ending) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end() ? ending
                                                                               : std::string();
}

Result<PatternPhoto> DownloadPhoto(const Session& session, const std::string& name,
                                   const std::function<bool(const std::string&)>& is_result) {
  PatternPhoto photo{name, {}};
  if (name.empty()) {
    auto newest = NewestPhoto(session, is_result);
    if (!newest) return tl::unexpected(newest.error());
    photo.name = std::move(*newest);
  } else if (name.find('/') != std::string::npos || PictureEnding(name).empty()) {
    return Fail(
        fmt::format("{}: must be the name of a picture (.jpg, .png, .webp, .heic) in the "
                    "folder {} beside the printer's configuration",
                    name, kPhotoFolder));
  }
  session.Say("fetching " + photo.name);
  auto bytes = session.printer.DownloadConfig(fmt::format("{}/{}", kPhotoFolder, photo.name),
                                              kMostPhotoBytes, session.Within(kDownload_s));
  if (!bytes) return tl::unexpected(bytes.error());
  photo.bytes = std::move(*bytes);
  return photo;
}

Result<PatternPhoto> TakePhoto(const Session& session, const settings::ScanSettings& settings) {
  constexpr int kFrames = 5;
  constexpr double kFrame_s = 10;
  session.Say("looking at the camera");
  const auto camera = OpenCamera(session, settings);
  if (!camera) return tl::unexpected(camera.error());
  std::vector<std::uint8_t> image;
  for (int i = 0; i < kFrames; ++i) {
    auto frame = (*camera)->Next(kFrame_s, session.stop);
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) break;
    if ((*frame)->fault == machine::FrameFault::kNone) image = std::move((*frame)->image);
  }
  if (image.empty()) return Fail("the camera sent no whole picture", ErrorKind::kMachine);
  constexpr std::uint8_t kJpeg = 0xFF;
  const char* const ending = image.front() == kJpeg ? "jpg" : "png";
  return PatternPhoto{fmt::format("webcam.{}", ending), {image.begin(), image.end()}};
}

}  // namespace trammel::procedure
