// Cuts a JPEG to a part of itself without decoding it to pixels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/frame.h"
#include "base/result.h"

namespace trammel::image {

/// Copies the MCUs of `part` and of one chroma sample around it, with unchanged coefficients:
/// within `part` a decoder yields bit-identical pixels. Huffman tables are the cut's own, even if
/// the picture omitted the standard ones; restarts, comments and application data are omitted. The
/// cut records its position (jpeg_reader.h), unless it is the whole picture.
///
/// Accepts pictures of one scan, as cameras write them, grey or of three colours. Input may be
/// hostile, but the caller must bound its cost, from the header or before.
/// @param part  in px of the picture.
/// @param cut   receives the bytes; its memory is reused.
/// Errors (kInput), with `cut` unusable: several scans, another number of colours, a cut already, a
/// part outside the picture, any damage, whatever the decoder rejects.
/// Memory: 2 bytes a sample of the whole picture.
[[nodiscard]] Result<void> CutJpeg(std::span<const std::uint8_t> bytes, const PixelRect& part,
                                   std::vector<std::uint8_t>& cut);

}  // namespace trammel::image
