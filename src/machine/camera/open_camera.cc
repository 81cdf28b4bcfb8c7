#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <string_view>
#include <system_error>

#include "base/url_secrets.h"
#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/camera/camera_url.h"
#include "machine/camera/image_file.h"
#include "machine/module/module.h"

namespace trammel::machine {

std::optional<std::string> AravisId(const std::string& address) {
  constexpr std::string_view kScheme = "aravis:";
  if (!address.starts_with(kScheme)) return std::nullopt;
  return address.substr(kScheme.size());
}

Result<std::unique_ptr<FrameSource>> OpenAravisCamera(const std::string& id,
                                                      const CameraOptions& options,
                                                      const std::stop_token& stop) {
  constexpr std::size_t kLongestId = 256;
  const bool printable =
      std::all_of(id.begin(), id.end(), [](char c) { return c >= ' ' && c <= '~'; });
  if (id.size() > kLongestId || !printable) {
    return Fail(
        fmt::format("camera aravis: an id of {} characters{}; write it as arv-tool-0.8 "
                    "lists it, at most {} printable characters",
                    id.size(), printable ? "" : ", not all of them printable", kLongestId));
  }
  const auto module = TRY(LoadModule<AravisModule>(kAravisModule));
  return module->open(id, options, stop);
}

Result<std::unique_ptr<FrameSource>> OpenCamera(const std::string& address,
                                                const CameraOptions& options,
                                                std::stop_token stop) {
  if (IsHttpUrl(address)) return OpenMjpegStream(address, options, stop);
  if (const auto id = AravisId(address)) return OpenAravisCamera(*id, options, stop);
  if (address.find("://") != std::string::npos) {
    return Fail(
        fmt::format("camera '{}': only http and https streams can be read; serve the camera "
                    "as MJPEG over HTTP",
                    WithoutSecrets(address)));
  }
  if (address.rfind("/dev/", 0) == 0) return OpenV4l2Camera(address, options);
  std::error_code error;
  const auto status = std::filesystem::status(address, error);
  if (std::filesystem::is_directory(status)) return OpenImageFolder(address, options);
  if (std::filesystem::is_regular_file(status)) return OpenVideoFrames(address, options);
  if (std::filesystem::exists(status)) {
    return Fail(fmt::format("camera '{}': neither a file nor a folder", address));
  }
  return Fail(
      fmt::format("camera '{}': there is nothing of that name; write http://…, /dev/videoN, "
                  "aravis:ID, a video or a folder of pictures",
                  address));
}

Result<Frame> DecodeFrame(const CapturedFrame& frame) {
  ImageReadOptions options;
  options.most_pixels = 50'000'000;
  options.reduce_above_px = options.most_pixels;
  auto decoded = DecodeImage(frame.image, options);
  if (!decoded) {
    return Fail(fmt::format("frame of {} bytes: {}", frame.image.size(), decoded.error().message),
                ErrorKind::kMeasurement);
  }
  return decoded;
}

}  // namespace trammel::machine
