// JPEGs of every kind that cameras and programs write, drawn for tests.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/random.h"
#include "base/result.h"
#include "image/jpeg_reader.h"

namespace trammel::image {

using Bytes = std::vector<std::uint8_t>;

struct Kind {
  std::string name;
  int components = 3;
  int across = 1;  ///< of luma for one of chroma
  int down = 1;
  int restart_rows = 0;  ///< of MCUs; 0: none
  int restart_mcus = 0;
  bool progressive = false;
  bool arithmetic = false;
  bool huffman_tables = true;
  bool dark = false;  ///< but for a stripe
};

/// What cameras write: every sampling of chroma, grey, restarts, standard tables left out, and a
/// stripe in the dark.
[[nodiscard]] std::vector<Kind> KindsOfCameras();

/// The same and others.
[[nodiscard]] std::vector<Kind> KindsOfCamerasAnd(std::vector<Kind> others);

/// Slopes, strong colours that change from block to block, and noise.
[[nodiscard]] Bytes EncodeKind(const Kind& kind, int width, int height, Random& random);

/// All rows of a started reader, of `samples` a pixel.
[[nodiscard]] Result<Bytes> ReadRows(JpegReader& reader, std::size_t samples);

[[nodiscard]] Result<Bytes> ReadWhole(const Bytes& jpeg, JpegPixels pixels);

/// The same part of decoded pixels.
[[nodiscard]] Bytes PartOf(const Bytes& whole, int width, std::size_t samples,
                           const PixelRect& part);

/// Corners, edges, single pixels, the whole, and `anywhere` more.
[[nodiscard]] std::vector<PixelRect> PartsOf(int width, int height, int anywhere, Random& random);

}  // namespace trammel::image
