#include "image/jpeg_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

// After cstdio: they require the declaration of FILE.
#include <jerror.h>
#include <jpeglib.h>

#include "base/check.h"
#include "image/exif.h"

namespace trammel::image {
namespace {

constexpr std::string_view kName("trammel part\0", 13);
static_assert(kName.size() + 8 == kPlaceBytes);

}  // namespace

std::array<std::uint8_t, kPlaceBytes> FormatPlace(const JpegPlace& place) {
  std::array<std::uint8_t, kPlaceBytes> bytes{};
  auto at = std::copy(kName.begin(), kName.end(), bytes.begin());
  for (const int number : {place.x, place.y, place.whole_width, place.whole_height}) {
    TRAMMEL_CHECK(number >= 0 && number <= 0xFFFF, "a place at {} px", number);
    *at++ = static_cast<std::uint8_t>(number >> 8);
    *at++ = static_cast<std::uint8_t>(number);
  }
  return bytes;
}

std::optional<JpegPlace> ParsePlace(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kPlaceBytes || !std::equal(kName.begin(), kName.end(), bytes.begin())) {
    return std::nullopt;
  }
  const auto number = [&](std::size_t i) {
    const std::size_t at = kName.size() + 2 * i;
    return bytes[at] << 8 | bytes[at + 1];
  };
  return JpegPlace{number(0), number(1), number(2), number(3)};
}

bool Fits(const JpegPlace& place, const JpegGrid& cut) {
  const auto fits = [](int begin, int length, int whole, int mcu) {
    const bool to_the_end = begin + length == whole;
    return begin + length <= whole && begin % mcu == 0 && (to_the_end || length % mcu == 0);
  };
  return fits(place.x, cut.width, place.whole_width, cut.mcu_width) &&
         fits(place.y, cut.height, place.whole_height, cut.mcu_height);
}

PixelRect ExactPart(const JpegPlace& place, const JpegGrid& cut) {
  struct Range {
    int begin;
    int length;
  };
  const auto within = [](int begin, int length, int whole, int margin) -> Range {
    const int first = begin == 0 ? 0 : begin + margin;
    const int last = begin + length == whole ? whole : begin + length - margin;
    return {first, std::max(0, last - first)};
  };
  const Range x = within(place.x, cut.width, place.whole_width, cut.chroma_width());
  const Range y = within(place.y, cut.height, place.whole_height, cut.chroma_height());
  return {x.begin, y.begin, x.length, y.length};
}

PixelRect CutAround(const PixelRect& part, const JpegGrid& whole) {
  TRAMMEL_CHECK(part.x >= 0 && part.y >= 0 && part.width > 0 && part.height > 0 &&
                    part.x <= whole.width - part.width && part.y <= whole.height - part.height,
                "part {}x{} at ({}, {}) of {}x{} px", part.width, part.height, part.x, part.y,
                whole.width, whole.height);
  const auto begin = [](int first, int mcu) { return std::max(0, first) / mcu * mcu; };
  const auto end = [](int last, int most, int mcu) {
    return std::min(most, (last + mcu - 1) / mcu * mcu);
  };
  int x = begin(part.x - whole.chroma_width(), whole.mcu_width);
  const int y = begin(part.y - whole.chroma_height(), whole.mcu_height);
  const int x_end = end(part.x + part.width + whole.chroma_width(), whole.width, whole.mcu_width);
  const int y_end =
      end(part.y + part.height + whole.chroma_height(), whole.height, whole.mcu_height);
  // Decoders do not interpolate in rows of one or two chroma samples.
  if (x > 0 && x_end - x <= 2 * whole.chroma_width()) x -= whole.mcu_width;
  return {x, y, x_end - x, y_end - y};
}

/// Row that is copied as soon as it is decoded. libjpeg-turbo writes aligned rows past the caches,
/// from where each copy would wait for memory: hence an offset of one byte.
class DecodedRow {
 public:
  void Resize(std::size_t samples) { bytes_.resize(samples + 1); }
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  [[nodiscard]] std::span<std::uint8_t> samples() {
    return empty() ? std::span(bytes_) : std::span(bytes_).subspan(1);
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

// libjpeg's errors jump: functions that they leave may contain no object with a destructor.
struct JpegReader::State {
  jpeg_decompress_struct reader{};
  jpeg_error_mgr errors{};
  std::jmp_buf back{};
  char said[JMSG_LENGTH_MAX] = {};
  bool created = false;
  bool fill_in = false;
  JpegHeader header;
  PixelRect part;           // picture region whose rows are read
  std::size_t left_px = 0;  // decoded before the part's first column
  DecodedRow row;           // decoded row, if its format is not the requested one

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (created) jpeg_destroy_decompress(&reader);
  }

  bool Begin(std::span<const std::uint8_t> bytes);
  void TakeHeader();
  Result<void> Choose(JpegPixels pixels);
  bool Start();
  bool StartPart();
  bool ReadRow(std::uint8_t* into);
  bool ReadRest();
  [[nodiscard]] tl::unexpected<Error> Rejected() const {
    return Fail(fmt::format("the decoder rejects it ({})", said));
  }

  static void Complain(j_common_ptr reader) {
    auto& state = *static_cast<State*>(reader->client_data);
    reader->err->format_message(reader, state.said);
    std::longjmp(state.back, 1);
  }
  // A warning (level -1) means that the decoder invents missing data, except for extra bytes that
  // cameras write before a marker.
  static void Warn(j_common_ptr reader, int level) {
    const bool harmless = reader->err->msg_code == JWRN_EXTRANEOUS_DATA;
    if (level >= 0 || harmless || static_cast<State*>(reader->client_data)->fill_in) return;
    Complain(reader);
  }
};

namespace {

constexpr int kExif = JPEG_APP0 + 1;

/// Returns the TIFF structure of the first EXIF block; empty if there is none.
std::span<const std::uint8_t> ExifOf(const jpeg_decompress_struct& reader) {
  constexpr std::string_view kName("Exif\0\0", 6);
  for (jpeg_saved_marker_ptr at = reader.marker_list; at != nullptr; at = at->next) {
    if (at->marker != kExif) continue;
    const std::string_view data(reinterpret_cast<const char*>(at->data), at->data_length);
    if (data.starts_with(kName)) return {at->data + kName.size(), data.size() - kName.size()};
  }
  return {};
}

/// Returns its place in a larger picture; absent if it is whole.
std::optional<JpegPlace> PlaceOf(const jpeg_decompress_struct& reader) {
  for (jpeg_saved_marker_ptr at = reader.marker_list; at != nullptr; at = at->next) {
    if (at->marker != kPlaceMarker || at->original_length != at->data_length) continue;
    if (auto place = ParsePlace({at->data, at->data_length})) return place;
  }
  return std::nullopt;
}

/// Prints four inks on white. Adobe's files store 255 for no ink.
void PrintOnWhite(std::span<const std::uint8_t> cmyk, bool inverted, std::uint8_t* bgr) {
  const unsigned flip = inverted ? 0U : 255U;
  for (std::size_t i = 0; i + 3 < cmyk.size(); i += 4, bgr += 3) {
    const unsigned white = cmyk[i + 3] ^ flip;
    for (std::size_t ink = 0; ink < 3; ++ink) {
      bgr[2 - ink] = static_cast<std::uint8_t>(((cmyk[i + ink] ^ flip) * white + 127U) / 255U);
    }
  }
}

}  // namespace

bool JpegReader::State::Begin(std::span<const std::uint8_t> bytes) {
  if (setjmp(back) != 0) return false;
  reader.err = jpeg_std_error(&errors);
  errors.error_exit = Complain;
  errors.emit_message = Warn;
  reader.client_data = this;
  jpeg_create_decompress(&reader);  // keeps err and client_data
  created = true;
  jpeg_save_markers(&reader, kExif, 0xFFFF);
  jpeg_save_markers(&reader, kPlaceMarker, kPlaceBytes);
  jpeg_mem_src(&reader, bytes.data(), bytes.size());
  jpeg_read_header(&reader, TRUE);
  return true;
}

void JpegReader::State::TakeHeader() {
  constexpr int kPerInch = 1;
  constexpr int kPerCentimetre = 2;
  header.width_px = static_cast<int>(reader.image_width);
  header.height_px = static_cast<int>(reader.image_height);
  header.components = reader.num_components;
  header.multiple_scans = jpeg_has_multiple_scans(&reader) != 0;
  header.orientation = ExifOrientation(ExifOf(reader));
  header.film_focal_mm = ExifFilmFocal_mm(ExifOf(reader));
  header.mcu_width_px = reader.max_h_samp_factor * DCTSIZE;
  header.mcu_height_px = reader.max_v_samp_factor * DCTSIZE;
  header.place = PlaceOf(reader);
  const int unit = reader.density_unit;
  if (reader.saw_JFIF_marker && (unit == kPerInch || unit == kPerCentimetre) &&
      reader.X_density > 0 && reader.Y_density > 0) {
    const double per_inch = unit == kPerCentimetre ? 2.54 : 1;
    header.dpi_x = per_inch * reader.X_density;
    header.dpi_y = per_inch * reader.Y_density;
  }
}

bool JpegReader::State::Start() {
  if (setjmp(back) != 0) return false;
  jpeg_start_decompress(&reader);
  return true;
}

bool JpegReader::State::StartPart() {
  if (setjmp(back) != 0) return false;
  jpeg_start_decompress(&reader);
  // At the ends of the decoded columns chroma is interpolated without its neighbours, so a margin
  // of one block separates them from the part. The decoder widens it to whole blocks.
  const int block = reader.max_h_samp_factor * DCTSIZE;
  const int begin = std::max(0, part.x - block);
  const int end = std::min(header.width_px, part.x + part.width + block);
  auto x = static_cast<JDIMENSION>(begin);
  auto width = static_cast<JDIMENSION>(end - begin);
  jpeg_crop_scanline(&reader, &x, &width);
  left_px = static_cast<std::size_t>(part.x) - x;
  jpeg_skip_scanlines(&reader, static_cast<JDIMENSION>(part.y));
  return true;
}

bool JpegReader::State::ReadRow(std::uint8_t* into) {
  if (setjmp(back) != 0) return false;
  return jpeg_read_scanlines(&reader, &into, 1) == 1;
}

bool JpegReader::State::ReadRest() {
  if (setjmp(back) != 0) return false;
  const JDIMENSION left = reader.output_height - reader.output_scanline;
  if (left > 1) jpeg_skip_scanlines(&reader, left - 1);
  JSAMPROW last = row.samples().data();
  return left == 0 || jpeg_read_scanlines(&reader, &last, 1) == 1;
}

JpegReader::JpegReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
JpegReader::JpegReader(JpegReader&&) noexcept = default;
JpegReader& JpegReader::operator=(JpegReader&&) noexcept = default;
JpegReader::~JpegReader() = default;

Result<JpegReader> JpegReader::Open(std::span<const std::uint8_t> bytes, JpegDamage damage) {
  auto state = std::make_unique<State>();
  state->fill_in = damage == JpegDamage::kFillIn;
  if (!state->Begin(bytes)) return state->Rejected();
  state->TakeHeader();
  if (const auto& place = state->header.place; place && !Fits(*place, state->header.grid())) {
    return Fail(fmt::format("it says that it is {}x{} px at ({}, {}) of {}x{}, which cannot be",
                            state->header.width_px, state->header.height_px, place->x, place->y,
                            place->whole_width, place->whole_height));
  }
  return JpegReader(std::move(state));
}

const JpegHeader& JpegReader::header() const { return state_->header; }
int JpegReader::row_px() const { return state_->part.width; }
int JpegReader::rows() const { return state_->part.height; }

/// Sets the output colours.
Result<void> JpegReader::State::Choose(JpegPixels pixels) {
  const int components = header.components;
  if (components != 1 && components != 3 && components != 4) {
    return Fail(fmt::format("it has {} colours; save it as grey or RGB", components));
  }
  reader.out_color_space = components == 4               ? JCS_CMYK
                           : pixels == JpegPixels::kGrey ? JCS_GRAYSCALE
                                                         : JCS_EXT_BGR;
  return {};
}

Result<void> JpegReader::Start(JpegPixels pixels, int reduction) {
  TRAMMEL_CHECK(reduction == 1 || reduction == 2 || reduction == 4 || reduction == 8,
                "a reduction by {}", reduction);
  State& state = *state_;
  TRY(state.Choose(pixels));
  state.reader.scale_num = 1;
  state.reader.scale_denom = static_cast<unsigned>(reduction);
  if (!state.Start()) return state.Rejected();
  state.part = {0, 0, static_cast<int>(state.reader.output_width),
                static_cast<int>(state.reader.output_height)};
  if (state.header.components == 4) state.row.Resize(std::size_t{4} * state.reader.output_width);
  return {};
}

Result<void> JpegReader::StartPart(JpegPixels pixels, const PixelRect& part) {
  State& state = *state_;
  const JpegHeader& whole = state.header;
  TRAMMEL_CHECK(part.x >= 0 && part.y >= 0 && part.width > 0 && part.height > 0 &&
                    part.x <= whole.width_px - part.width &&
                    part.y <= whole.height_px - part.height,
                "part {}x{} at ({}, {}) of {}x{} px", part.width, part.height, part.x, part.y,
                whole.width_px, whole.height_px);
  if (part.width == whole.width_px && part.height == whole.height_px) return Start(pixels);
  TRY(state.Choose(pixels));
  state.part = part;
  if (!state.StartPart()) return state.Rejected();
  state.row.Resize(static_cast<std::size_t>(state.reader.output_components) *
                   state.reader.output_width);
  return {};
}

Result<void> JpegReader::ReadRow(std::uint8_t* row) {
  State& state = *state_;
  if (state.row.empty()) {
    if (!state.ReadRow(row)) return state.Rejected();
    return {};
  }
  if (!state.ReadRow(state.row.samples().data())) return state.Rejected();
  const auto samples = static_cast<std::size_t>(state.reader.output_components);
  const std::span<const std::uint8_t> part = state.row.samples().subspan(
      samples * state.left_px, samples * static_cast<std::size_t>(state.part.width));
  if (state.header.components == 4) {
    PrintOnWhite(part, state.reader.saw_Adobe_marker != 0, row);
  } else {
    std::copy(part.begin(), part.end(), row);
  }
  return {};
}

Result<void> JpegReader::ReadRest() {
  if (!state_->ReadRest()) return state_->Rejected();
  return {};
}

}  // namespace trammel::image
