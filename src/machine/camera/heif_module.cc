// trammel-heif.so: HEIC pictures by libheif, in a separate process, the only limit on a hostile
// one's memory and time.
#include <fmt/format.h>
#include <libheif/heif.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "machine/camera/image_file.h"
#include "machine/camera/phone_picture.h"
#include "machine/module/module.h"
#include "machine/net/child_process.h"

namespace trammel::machine {
namespace {

constexpr int kMaxSeconds = 30;                   // CPU time
constexpr std::int64_t kMaxPixels = 110'000'000;  // phones have up to 108 megapixels
constexpr std::uint64_t kMaxBytes = std::uint64_t{1400} << 20U;

enum Kind : std::uint32_t { kSize = 1, kPixels, kEnd, kFault };

struct Size {
  int width_px = 0, height_px = 0;
};

using Context = std::unique_ptr<heif_context, decltype(&heif_context_free)>;
using Handle = std::unique_ptr<heif_image_handle, decltype(&heif_image_handle_release)>;
using Image = std::unique_ptr<heif_image, decltype(&heif_image_release)>;

tl::unexpected<Error> Refusal(const heif_error& error) {
  return Fail(fmt::format("libheif rejects it: {}; copy it again, or convert it to JPEG",
                          error.message != nullptr ? error.message : "no reason given"));
}

Frame Shrunk(const Image& image, const Size& size, int reduction) {
  int stride = 0;
  std::uint8_t* const rgb = heif_image_get_plane(image.get(), heif_channel_interleaved, &stride);
  const cv::Mat stored(size.height_px, size.width_px, CV_8UC3, rgb,
                       static_cast<std::size_t>(stride));
  Frame frame(std::max(size.width_px / reduction, 1), std::max(size.height_px / reduction, 1));
  cv::Mat to(frame.height, frame.width, CV_8UC3, frame.bgr.data());
  if (reduction > 1) {
    cv::Mat reduced;
    cv::resize(stored, reduced, to.size(), 0, 0, cv::INTER_AREA);
    cv::cvtColor(reduced, to, cv::COLOR_RGB2BGR);
  } else {
    cv::cvtColor(stored, to, cv::COLOR_RGB2BGR);
  }
  return frame;
}

// libheif rotates and mirrors the picture by the file's own properties; readers must ignore its
// EXIF orientation.
Result<Frame> DecodeHere(std::span<const std::uint8_t> bytes, const ImageReadOptions& options) {
  constexpr int kLongestSide_px = 32768;
  const Context context(heif_context_alloc(), &heif_context_free);
  if (!context) throw std::bad_alloc();
  heif_context_set_maximum_image_size_limit(context.get(), kLongestSide_px);
  heif_context_set_max_decoding_threads(context.get(), 2);
  heif_error error = heif_context_read_from_memory_without_copy(context.get(), bytes.data(),
                                                                bytes.size(), nullptr);
  if (error.code != heif_error_Ok) return Refusal(error);
  heif_image_handle* main = nullptr;
  error = heif_context_get_primary_image_handle(context.get(), &main);
  if (error.code != heif_error_Ok) return Refusal(error);
  const Handle handle(main, &heif_image_handle_release);
  const int width = heif_image_handle_get_width(main);
  const int height = heif_image_handle_get_height(main);
  if (width < 1 || height < 1) return Fail("it states no size; copy it again");
  ImageReadOptions bounds = options;
  bounds.most_pixels = std::min(bounds.most_pixels, kMaxPixels);
  TRY(CheckPixels(width, height, bounds));
  TRY(CheckPacking(width, height, bytes.size()));
  heif_image* decoded = nullptr;
  error =
      heif_decode_image(main, &decoded, heif_colorspace_RGB, heif_chroma_interleaved_RGB, nullptr);
  if (error.code != heif_error_Ok) return Refusal(error);
  const Image image(decoded, &heif_image_release);
  const Size size{heif_image_get_width(decoded, heif_channel_interleaved),
                  heif_image_get_height(decoded, heif_channel_interleaved)};
  if (size.width_px < 1 || size.height_px < 1) return Fail("it holds no pixels; copy it again");
  return Shrunk(image, size, ReductionOf(size.width_px, size.height_px, options));
}

void SendFrame(const Frame& frame, const ChildSender& sender) {
  constexpr std::size_t kPiece = std::size_t{1} << 20U;
  const Size size{frame.width, frame.height};
  sender.Send(kSize, {reinterpret_cast<const std::uint8_t*>(&size), sizeof size});
  const std::span<const std::uint8_t> pixels(frame.bgr);
  for (std::size_t at = 0; at < pixels.size(); at += kPiece) {
    if (!sender.Send(kPixels, pixels.subspan(at, std::min(kPiece, pixels.size() - at)))) return;
  }
  sender.Send(kEnd, std::string_view());
}

// Receives the frame from the other process, and checks its stated size against limits.
Result<Frame> TakeFrame(ChildProcess& child, std::size_t bytes) {
  constexpr double kSilence_s = 120;  // for a busy machine: CPU time is limited separately
  Frame frame;
  std::size_t filled = 0;
  ChildMessage message;
  for (;;) {
    if (child.Receive(message, kSilence_s, {}) != Received::kMessage) break;
    if (message.kind == kFault)
      return Fail(std::string(message.bytes.begin(), message.bytes.end()));
    if (message.kind == kSize && message.bytes.size() == sizeof(Size) && frame.bgr.empty()) {
      Size size;
      std::memcpy(&size, message.bytes.data(), sizeof size);
      if (size.width_px < 1 || size.height_px < 1 ||
          std::int64_t{size.width_px} * size.height_px > kMaxPixels) {
        break;
      }
      frame = Frame(size.width_px, size.height_px);
    } else if (message.kind == kPixels && message.bytes.size() <= frame.bgr.size() - filled) {
      std::copy(message.bytes.begin(), message.bytes.end(),
                frame.bgr.begin() + static_cast<std::ptrdiff_t>(filled));
      filled += message.bytes.size();
    } else if (message.kind == kEnd && !frame.bgr.empty() && filled == frame.bgr.size()) {
      return frame;
    } else {
      break;
    }
  }
  return Fail(fmt::format(
      "its decoder ended without a picture ({}): its {} bytes take more than {} s or {} MB, or it "
      "is damaged; convert it to JPEG",
      child.End(), bytes, kMaxSeconds, kMaxBytes >> 20U));
}

Result<Frame> Decode(std::span<const std::uint8_t> bytes, const ImageReadOptions& options) {
  constexpr double kPatience_s = 1;
  auto child = TRY(ChildProcess::Start(
      [&](const ChildSender& sender) {
        LimitThisProcess(kMaxBytes, kMaxSeconds);
        try {
          const Result<Frame> frame = DecodeHere(bytes, options);
          if (frame) {
            SendFrame(*frame, sender);
          } else {
            sender.Send(kFault, frame.error().message);
          }
        } catch (const std::bad_alloc&) {
          sender.Send(kFault, "it does not fit into memory; convert it to JPEG");
        }
      },
      kPatience_s));
  return TakeFrame(child, bytes.size());
}

constexpr PictureModule kModule = {Decode};

}  // namespace
}  // namespace trammel::machine

TRAMMEL_MODULE(trammel::machine::kModule)
