#include "image/jpeg_kinds_test_support.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

// After cstdio: it wants FILE declared before it.
#include <jpeglib.h>

namespace trammel::image {
namespace {

Bytes WithoutHuffmanTables(const Bytes& jpeg) {
  constexpr std::uint8_t kTables = 0xC4;
  constexpr std::uint8_t kStartOfScan = 0xDA;
  Bytes stripped(jpeg.begin(), jpeg.begin() + 2);
  std::size_t at = 2;
  for (std::uint8_t marker = 0; marker != kStartOfScan;) {
    marker = jpeg[at + 1];
    const std::size_t end = at + 2 + jpeg[at + 2] * std::size_t{256} + jpeg[at + 3];
    if (marker != kTables) {
      stripped.insert(stripped.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at),
                      jpeg.begin() + static_cast<std::ptrdiff_t>(end));
    }
    at = end;
  }
  stripped.insert(stripped.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
  return stripped;
}

}  // namespace

std::vector<Kind> KindsOfCameras() {
  return {{.name = "4:4:4"},
          {.name = "4:2:2", .across = 2},
          {.name = "4:2:0", .across = 2, .down = 2},
          {.name = "4:4:0", .down = 2},
          {.name = "4:1:1", .across = 4},
          {.name = "grey", .components = 1},
          {.name = "restarts of rows", .across = 2, .down = 2, .restart_rows = 1},
          {.name = "restarts within rows", .across = 2, .restart_mcus = 3},
          {.name = "standard tables left out", .across = 2, .huffman_tables = false},
          {.name = "dark", .across = 2, .down = 2, .dark = true},
          {.name = "dark, restarts within rows", .across = 2, .restart_mcus = 3, .dark = true}};
}

std::vector<Kind> KindsOfCamerasAnd(std::vector<Kind> others) {
  std::vector<Kind> kinds = KindsOfCameras();
  kinds.insert(kinds.end(), others.begin(), others.end());
  return kinds;
}

Bytes EncodeKind(const Kind& kind, int width, int height, Random& random) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(width);
  jpeg.image_height = static_cast<JDIMENSION>(height);
  jpeg.input_components = kind.components;
  jpeg.in_color_space = kind.components == 1   ? JCS_GRAYSCALE
                        : kind.components == 3 ? JCS_RGB
                                               : JCS_CMYK;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 85, TRUE);
  jpeg.comp_info[0].h_samp_factor = kind.across;
  jpeg.comp_info[0].v_samp_factor = kind.down;
  jpeg.restart_in_rows = kind.restart_rows;
  jpeg.restart_interval = static_cast<unsigned>(kind.restart_mcus);
  jpeg.arith_code = kind.arithmetic ? TRUE : FALSE;
  if (kind.progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(kind.components * width));
  for (int y = 0; y < height; ++y) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const int x = static_cast<int>(i) / kind.components;
      const int c = static_cast<int>(i) % kind.components;
      const double level = 128 + 90 * std::sin(0.3 * x * (c + 1) + 0.21 * y) + 12 * random.Normal();
      const bool lit = !kind.dark || (x >= 50 && x < 75);
      row[i] = static_cast<std::uint8_t>(lit ? std::clamp(level, 0.0, 255.0) : 0.0);
    }
    JSAMPROW at = row.data();
    jpeg_write_scanlines(&jpeg, &at, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  Bytes written(bytes, bytes + size);
  std::free(bytes);
  return kind.huffman_tables ? written : WithoutHuffmanTables(written);
}

Result<Bytes> ReadRows(JpegReader& reader, std::size_t samples) {
  const std::size_t row_bytes = samples * static_cast<std::size_t>(reader.row_px());
  Bytes pixels(row_bytes * static_cast<std::size_t>(reader.rows()));
  for (int y = 0; y < reader.rows(); ++y) {
    TRY(reader.ReadRow(pixels.data() + static_cast<std::size_t>(y) * row_bytes));
  }
  return pixels;
}

Result<Bytes> ReadWhole(const Bytes& jpeg, JpegPixels pixels) {
  auto reader = TRY(JpegReader::Open(jpeg, JpegDamage::kRefuse));
  TRY(reader.Start(pixels));
  return ReadRows(reader, pixels == JpegPixels::kGrey ? 1 : 3);
}

Bytes PartOf(const Bytes& whole, int width, std::size_t samples, const PixelRect& part) {
  Bytes cut;
  for (int y = part.y; y < part.y + part.height; ++y) {
    const auto at = whole.begin() + static_cast<std::ptrdiff_t>(samples) * (y * width + part.x);
    cut.insert(cut.end(), at, at + static_cast<std::ptrdiff_t>(samples) * part.width);
  }
  return cut;
}

std::vector<PixelRect> PartsOf(int width, int height, int anywhere, Random& random) {
  std::vector<PixelRect> parts = {{0, 0, width, height},         {0, 0, 1, 1},
                                  {width - 1, 0, 1, 1},          {0, height - 1, 1, 1},
                                  {width - 1, height - 1, 1, 1}, {0, height / 2, width, 1},
                                  {width / 2, 0, 1, height}};
  const auto within = [&](int count) {
    return std::min(count - 1, static_cast<int>(random.Uniform() * count));
  };
  for (int i = 0; i < anywhere; ++i) {
    const int x = within(width);
    const int y = within(height);
    parts.push_back({x, y, 1 + within(width - x), 1 + within(height - y)});
  }
  return parts;
}

}  // namespace trammel::image
