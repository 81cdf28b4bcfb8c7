// JPEG files to pixels, whole or a part; shared: where JPEG data is read from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "base/frame.h"
#include "base/result.h"

namespace trammel::image {

/// All in px.
struct JpegPlace {
  int x = 0;  ///< of the cut picture's first pixel in the whole: a multiple of an MCU's width
  int y = 0;
  int whole_width = 0;
  int whole_height = 0;
};

/// The marker that bears the place: application data of a number that cameras leave alone.
inline constexpr int kPlaceMarker = 0xE9;
inline constexpr std::size_t kPlaceBytes = 21;

/// What stands behind the marker: "trammel part", 0, and four numbers of 16 bits.
/// REQUIRES numbers of 0 … 65535.
[[nodiscard]] std::array<std::uint8_t, kPlaceBytes> FormatPlace(const JpegPlace& place);

/// Absent where the bytes are another program's.
[[nodiscard]] std::optional<JpegPlace> ParsePlace(std::span<const std::uint8_t> bytes);

/// A picture's size and that of its MCUs, all in px.
struct JpegGrid {
  int width = 0;
  int height = 0;
  int mcu_width = 8;  ///< pixels that are coded together: 8 chroma samples
  int mcu_height = 8;

  [[nodiscard]] int chroma_width() const { return mcu_width / 8; }  ///< pixels of a sample
  [[nodiscard]] int chroma_height() const { return mcu_height / 8; }
};

/// Whether a picture can lie there: within the whole, and cut from it along MCUs.
[[nodiscard]] bool Fits(const JpegPlace& place, const JpegGrid& cut);

/// Pixels of the whole that a cut picture has to the bit: on each side that is none of the whole's
/// one chroma sample less than it holds, since a decoder interpolates chroma between neighbours.
/// REQUIRES Fits().
[[nodiscard]] PixelRect ExactPart(const JpegPlace& place, const JpegGrid& cut);

/// The fewest MCUs of a picture in which `part` is exact. REQUIRES `part` within the picture.
[[nodiscard]] PixelRect CutAround(const PixelRect& part, const JpegGrid& whole);

struct JpegHeader {
  int width_px = 0;             ///< >= 1, as stored: before any turn that EXIF asks for
  int height_px = 0;            ///< >= 1
  int components = 0;           ///< of a pixel: 1 grey, 3 YCbCr or RGB, 4 CMYK or YCCK
  bool multiple_scans = false;  ///< all of the picture is kept while decoding: 2 bytes a sample
  int orientation = 1;          ///< 1 … 8, of EXIF
  std::optional<int> film_focal_mm = {};  ///< of EXIF: as if on film of 35 mm
  std::optional<double> dpi_x;            ///< of JFIF; absent where it does not say
  std::optional<double> dpi_y;
  int mcu_width_px = 8;            ///< of the pixels that are coded together
  int mcu_height_px = 8;           ///< likewise
  std::optional<JpegPlace> place;  ///< in the picture that it was cut from; absent: it is whole

  [[nodiscard]] JpegGrid grid() const { return {width_px, height_px, mcu_width_px, mcu_height_px}; }
};

/// Decides on entropy-coded data that is damaged, for which the decoder makes up grey.
enum class JpegDamage { kRefuse, kFillIn };

enum class JpegPixels { kGrey, kBgr };  ///< 8 bits a sample, interleaved

/// Decodes with libjpeg. Input may be hostile, but what it costs is the caller's to bound, from the
/// header or before. Messages do not name the file.
class JpegReader {
 public:
  /// Reads the header. REQUIRES that `bytes` live as long as the reader.
  /// Errors (kInput): whatever the decoder rejects; a place in another picture that cannot be.
  [[nodiscard]] static Result<JpegReader> Open(std::span<const std::uint8_t> bytes,
                                               JpegDamage damage);
  JpegReader(JpegReader&&) noexcept;
  JpegReader& operator=(JpegReader&&) noexcept;
  ~JpegReader();

  [[nodiscard]] const JpegHeader& header() const;

  /// Begins to decode. Four components are taken as CMYK and printed on white, with the inverted
  /// values that Adobe's marker announces; there is no colour management.
  /// @param reduction  1, 2, 4 or 8: each side is divided by it, rounded up, as the mean of its
  ///                   pixels.
  /// Errors (kInput): two, or more than four components; whatever the decoder rejects.
  [[nodiscard]] Result<void> Start(JpegPixels pixels, int reduction = 1);

  /// Begins to decode a part of the picture, whose pixels are those of the whole to the bit. Beyond
  /// it transform, interpolation and colours are left out; entropy-coded data is read up to it.
  /// REQUIRES that `part` lies within the picture. Errors as above.
  [[nodiscard]] Result<void> StartPart(JpegPixels pixels, const PixelRect& part);

  [[nodiscard]] int row_px() const;  ///< width of the rows, after Start() or StartPart()
  [[nodiscard]] int rows() const;    ///< after Start() or StartPart()

  /// Fills the next row. REQUIRES Start() or StartPart(), fewer than rows() calls before, and room
  /// for row_px() pixels.
  [[nodiscard]] Result<void> ReadRow(std::uint8_t* row);

  /// Reads the entropy-coded data behind a part: bytes lost before it are often not missed sooner.
  /// REQUIRES StartPart() and rows() calls of ReadRow().
  [[nodiscard]] Result<void> ReadRest();

 private:
  struct State;
  explicit JpegReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace trammel::image
