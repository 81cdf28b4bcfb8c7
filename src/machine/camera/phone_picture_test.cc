#include "machine/camera/phone_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libheif/heif.h>
#include <webp/encode.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Blue above, orange below, and a white corner at the top left: every turn of it differs.
Frame Flag(int width_px = 240, int height_px = 160) {
  Frame frame(width_px, height_px);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      std::uint8_t* const pixel = frame.row(y) + 3 * x;
      const bool above = 2 * y < height_px, corner = 4 * x < width_px && 4 * y < height_px;
      pixel[0] = corner ? 250 : above ? 200 : 30;
      pixel[1] = corner ? 250 : above ? 60 : 130;
      pixel[2] = corner ? 250 : above ? 40 : 220;
    }
  }
  return frame;
}

Bytes Webp(const Frame& frame, bool lossless = false) {
  std::uint8_t* data = nullptr;
  const std::size_t size = lossless ? WebPEncodeLosslessBGR(frame.bgr.data(), frame.width,
                                                            frame.height, 3 * frame.width, &data)
                                    : WebPEncodeBGR(frame.bgr.data(), frame.width, frame.height,
                                                    3 * frame.width, 90, &data);
  Bytes bytes(data, data + size);
  WebPFree(data);
  return bytes;
}

heif_error Append(heif_context* /*context*/, const void* data, std::size_t size, void* to) {
  const auto* const bytes = static_cast<const std::uint8_t*>(data);
  static_cast<Bytes*>(to)->insert(static_cast<Bytes*>(to)->end(), bytes, bytes + size);
  return {heif_error_Ok, heif_suberror_Unspecified, "Success"};
}

// Empty where this libheif cannot write HEIC.
Bytes Heic(const Frame& frame) {
  heif_context* const context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  Bytes bytes;
  if (heif_context_get_encoder_for_format(context, heif_compression_HEVC, &encoder).code ==
      heif_error_Ok) {
    heif_encoder_set_lossy_quality(encoder, 90);
    heif_image* image = nullptr;
    heif_image_create(frame.width, frame.height, heif_colorspace_RGB, heif_chroma_interleaved_RGB,
                      &image);
    heif_image_add_plane(image, heif_channel_interleaved, frame.width, frame.height, 8);
    int stride = 0;
    std::uint8_t* const rgb = heif_image_get_plane(image, heif_channel_interleaved, &stride);
    for (int y = 0; y < frame.height; ++y) {
      const std::uint8_t* const from = frame.view().row(y);
      for (int x = 0; x < frame.width; ++x) {
        for (int k = 0; k < 3; ++k) rgb[y * stride + 3 * x + k] = from[3 * x + 2 - k];
      }
    }
    heif_context_encode_image(context, image, encoder, nullptr, nullptr);
    heif_writer writer{1, Append};
    heif_context_write(context, &writer, &bytes);
    heif_image_release(image);
    heif_encoder_release(encoder);
  }
  heif_context_free(context);
  return bytes;
}

// Mean difference per sample.
double Apart(const Frame& a, const Frame& b) {
  if (a.width != b.width || a.height != b.height) return 255;
  double sum = 0;
  for (std::size_t i = 0; i < a.bgr.size(); ++i) sum += std::abs(a.bgr[i] - b.bgr[i]);
  return sum / static_cast<double>(a.bgr.size());
}

constexpr double kLossy = 4;  // levels, of the flag's few edges

TEST(PhonePicture, ReadsWebpAsItWasTaken) {
  const Frame flag = Flag();
  const auto lossy = DecodePhoto(Webp(flag)), lossless = DecodePhoto(Webp(flag, true));
  ASSERT_TRUE(lossy) << lossy.error().message;
  ASSERT_TRUE(lossless) << lossless.error().message;
  EXPECT_LT(Apart(*lossy, flag), kLossy);
  EXPECT_EQ(Apart(*lossless, flag), 0);
}

TEST(PhonePicture, ReadsHeicAsItWasTaken) {
  const Frame flag = Flag();
  const Bytes heic = Heic(flag);
  if (heic.empty()) GTEST_SKIP() << "this libheif has no encoder of HEVC to make a picture with";
  const auto read = Must(DecodePhoto(heic));
  EXPECT_LT(Apart(read, flag), kLossy);
}

TEST(PhonePicture, TurnsAWebpAsItsExifSays) {
  // RIFF: VP8X with the flag of EXIF, the picture's chunk, EXIF with orientation 6.
  const Frame flag = Flag(120, 80);
  const Bytes plain = Webp(flag, true);
  const auto put = [](Bytes& to, std::string_view text) {
    to.insert(to.end(), text.begin(), text.end());
  };
  Bytes bytes;
  put(bytes, std::string_view("RIFF\0\0\0\0WEBP", 12));
  put(bytes, std::string_view("VP8X\x0a\0\0\0\x08\0\0\0", 12));
  bytes.insert(bytes.end(), {119, 0, 0, 79, 0, 0});
  bytes.insert(bytes.end(), plain.begin() + 12, plain.end());
  put(bytes,
      std::string_view(
          "EXIF\x1a\0\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0", 34));
  const std::size_t size = bytes.size() - 8;
  for (std::size_t i = 0; i < 4; ++i) bytes[4 + i] = static_cast<std::uint8_t>(size >> (8 * i));
  const auto read = Must(DecodePhoto(bytes));
  ASSERT_EQ(read.width, 80);
  ASSERT_EQ(read.height, 120);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 120; ++x) {  // turned by 90 degrees clockwise
      ASSERT_EQ(read.view().row(x)[3 * (79 - y)], flag.view().row(y)[3 * x]) << x << " " << y;
    }
  }
}

// A header of 16383 x 16383 px over nothing.
TEST(PhonePicture, RefusesASizeThatItsBytesCannotHold) {
  Bytes bytes = Webp(Flag(16, 16), true);
  constexpr std::size_t kSize = 21;  // 14 bits of width less 1, 14 of height less 1
  for (std::size_t i = 0; i < 3; ++i) bytes[kSize + i] = 0xFF;
  bytes[kSize + 3] |= 0x0F;
  EXPECT_THAT(DecodePhoto(bytes, {.most_pixels = 300'000'000}), FailsWith("cannot hold"));
}

TEST(PhonePicture, BrokenFilesAreRefusedOrReadWithinTheirSize) {
  for (const Bytes& whole : {Webp(Flag(64, 48)), Webp(Flag(64, 48), true), Heic(Flag(64, 64))}) {
    if (whole.empty()) continue;
    for (std::size_t share = 1; share < 12; ++share) {
      EXPECT_FALSE(DecodePhoto(std::span(whole).first(whole.size() * share / 16))) << share;
    }
    for (std::size_t at = 4; at < whole.size(); at += 1 + whole.size() / 24) {
      Bytes changed = whole;
      changed[at] ^= 0xFF;
      const auto read = DecodePhoto(changed, {.most_pixels = 10'000'000});
      if (read) EXPECT_EQ(read->bgr.size(), std::size_t{3} * read->width * read->height);
    }
  }
}

}  // namespace
}  // namespace trammel::machine
