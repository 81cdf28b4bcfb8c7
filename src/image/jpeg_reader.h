// Decodes JPEG files, whole or in part, to pixels; shared by all JPEG sources.
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
  int x = 0;  ///< of the cut's first pixel in the whole picture: a multiple of an MCU's width
  int y = 0;
  int whole_width = 0;
  int whole_height = 0;
};

/// Marker that contains the position: application data with a number that cameras do not use.
inline constexpr int kPlaceMarker = 0xE9;
inline constexpr std::size_t kPlaceBytes = 21;

/// Formats the segment after the marker: "trammel part", 0, and four 16-bit numbers.
/// REQUIRES numbers of 0 … 65535.
[[nodiscard]] std::array<std::uint8_t, kPlaceBytes> FormatPlace(const JpegPlace& place);

/// Absent if the bytes are another program's.
[[nodiscard]] std::optional<JpegPlace> ParsePlace(std::span<const std::uint8_t> bytes);

/// Size of a picture and of its MCUs, in px.
struct JpegGrid {
  int width = 0;
  int height = 0;
  int mcu_width = 8;  ///< pixels that are coded together: 8 chroma samples
  int mcu_height = 8;

  [[nodiscard]] int chroma_width() const { return mcu_width / 8; }  ///< pixels of a sample
  [[nodiscard]] int chroma_height() const { return mcu_height / 8; }
};

/// True if the place is possible: within the whole picture, and cut along MCUs.
[[nodiscard]] bool Fits(const JpegPlace& place, const JpegGrid& cut);

/// Returns the whole picture's pixels that a cut reproduces to the bit: one chroma sample less than
/// it contains on each side that is no edge of the whole, since a decoder interpolates chroma
/// between neighbours. REQUIRES Fits().
[[nodiscard]] PixelRect ExactPart(const JpegPlace& place, const JpegGrid& cut);

/// Returns the smallest block of MCUs in which `part` is exact. REQUIRES `part` within the picture.
[[nodiscard]] PixelRect CutAround(const PixelRect& part, const JpegGrid& whole);

struct JpegHeader {
  int width_px = 0;             ///< >= 1, as stored: before any turn that EXIF asks for
  int height_px = 0;            ///< >= 1
  int components = 0;           ///< per pixel: 1 grey, 3 YCbCr or RGB, 4 CMYK or YCCK
  bool multiple_scans = false;  ///< all of the picture is kept while decoding: 2 bytes a sample
  int orientation = 1;          ///< 1 … 8, of EXIF
  std::optional<int> film_focal_mm = {};  ///< EXIF focal length, 35 mm equivalent
  std::optional<double> dpi_x;            ///< from JFIF; absent if not stated
  std::optional<double> dpi_y;
  int mcu_width_px = 8;            ///< width of a coded block (MCU)
  int mcu_height_px = 8;           ///< likewise
  std::optional<JpegPlace> place;  ///< position in the original picture; absent: not a cut

  [[nodiscard]] JpegGrid grid() const { return {width_px, height_px, mcu_width_px, mcu_height_px}; }
};

/// Handling of damaged entropy-coded data, which the decoder replaces by grey.
enum class JpegDamage { kRefuse, kFillIn };

enum class JpegPixels { kGrey, kBgr };  ///< 8 bits a sample, interleaved

/// Decodes with libjpeg. Input may be hostile, but the caller must bound its cost, from the header
/// or before. Messages do not name the file.
class JpegReader {
 public:
  /// Reads the header. REQUIRES that `bytes` outlive the reader.
  /// Errors (kInput): whatever the decoder rejects; an impossible position in another picture.
  [[nodiscard]] static Result<JpegReader> Open(std::span<const std::uint8_t> bytes,
                                               JpegDamage damage);
  JpegReader(JpegReader&&) noexcept;
  JpegReader& operator=(JpegReader&&) noexcept;
  ~JpegReader();

  [[nodiscard]] const JpegHeader& header() const;

  /// Starts decoding. Four components are taken as CMYK and printed on white, with the inverted
  /// values that Adobe's marker announces; there is no colour management.
  /// @param reduction  1, 2, 4 or 8: each side is divided by it, rounded up, as the mean of its
  ///                   pixels.
  /// Errors (kInput): two, or more than four components; whatever the decoder rejects.
  [[nodiscard]] Result<void> Start(JpegPixels pixels, int reduction = 1);

  /// Starts decoding a part of the picture, with pixels bit-identical to the whole's. Beyond it,
  /// transform, interpolation and colour conversion are skipped; entropy-coded data is read up to
  /// its end. REQUIRES `part` within the picture. Errors as above.
  [[nodiscard]] Result<void> StartPart(JpegPixels pixels, const PixelRect& part);

  [[nodiscard]] int row_px() const;  ///< width of the rows, after Start() or StartPart()
  [[nodiscard]] int rows() const;    ///< after Start() or StartPart()

  /// Fills the next row. REQUIRES Start() or StartPart(), fewer than rows() earlier calls, and room
  /// for row_px() pixels.
  [[nodiscard]] Result<void> ReadRow(std::uint8_t* row);

  /// Reads the entropy-coded data after a part: bytes lost before it are often detected only there.
  /// REQUIRES StartPart() and rows() calls of ReadRow().
  [[nodiscard]] Result<void> ReadRest();

 private:
  struct State;
  explicit JpegReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace trammel::image
