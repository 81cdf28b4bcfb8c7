// Cuts a JPEG to a part of itself without decoding it to pixels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/frame.h"
#include "base/result.h"

namespace trammel::image {

/// Keeps the MCUs that `part` and one chroma sample around it lie in, with their coefficients as
/// they are: within `part` a decoder gives the same pixels to the bit. Huffman tables are the cut's
/// own, whether the picture had any or left out the standard ones; restarts, comments and
/// application data are left out. The cut says where it lies (jpeg_reader.h), unless it is all of
/// the picture.
///
/// Pictures of one scan, as cameras write them, grey or of three colours. Input may be hostile, but
/// what it costs is the caller's to bound, from the header or before.
/// @param part  in px of the picture.
/// @param cut   receives the bytes; its memory is reused.
/// Errors (kInput), with `cut` of no use: several scans, another number of colours, a cut already,
/// a part that does not lie within the picture, damage anywhere, whatever the decoder rejects.
/// Memory: 2 bytes a sample of the whole picture.
[[nodiscard]] Result<void> CutJpeg(std::span<const std::uint8_t> bytes, const PixelRect& part,
                                   std::vector<std::uint8_t>& cut);

}  // namespace trammel::image
