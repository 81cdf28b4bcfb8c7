#include "machine/camera/camera.h"

#include <fmt/format.h>
#include <time.h>

#include <system_error>

#include "base/url_secrets.h"
#include "machine/camera/aravis_camera.h"
#include "machine/camera/camera_url.h"
#include "machine/camera/frame_files.h"
#include "machine/camera/image_file.h"
#include "machine/camera/mjpeg_stream.h"
#include "machine/camera/v4l2_camera.h"

namespace trammel::machine {

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
