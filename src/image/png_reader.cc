#include "image/png_reader.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstring>
#include <string_view>
#include <utility>

#include "image/exif.h"

namespace trammel::image {
// libpng's errors jump: functions that they leave may contain no object with a destructor.
struct PngReader::State {
  png_structp reader = nullptr;
  png_infop info = nullptr;
  png_infop end = nullptr;
  std::span<const std::uint8_t> bytes;
  std::size_t at = 0;
  char said[200] = {};
  PngHeader header;
  int passes = 1;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { png_destroy_read_struct(&reader, &info, &end); }

  bool Begin(PngPixels pixels);
  void TakeHeader();
  bool ReadRow(std::uint8_t* row);
  bool Finish();
  [[nodiscard]] tl::unexpected<Error> Rejected() const {
    return Fail(fmt::format("the decoder rejects it ({})", said));
  }

  static void Complain(png_structp reader, png_const_charp message) {
    auto& state = *static_cast<State*>(png_get_error_ptr(reader));
    std::strncpy(state.said, message, sizeof state.said - 1);
    png_longjmp(reader, 1);
  }
  static void Ignore(png_structp /*reader*/, png_const_charp /*message*/) {}
  static void Give(png_structp reader, png_bytep out, std::size_t count) {
    auto& state = *static_cast<State*>(png_get_io_ptr(reader));
    if (count > state.bytes.size() - state.at) png_error(reader, "it ends early");
    std::memcpy(out, state.bytes.data() + state.at, count);
    state.at += count;
  }
};

bool PngReader::State::Begin(PngPixels pixels) {
  constexpr png_uint_32 kMaxOfASide = 1'000'000;
  if (setjmp(png_jmpbuf(reader)) != 0) return false;
  png_set_user_limits(reader, kMaxOfASide, kMaxOfASide);
  png_set_read_fn(reader, this, Give);
  // Skips texts and profiles, which may be compressed, would be unpacked and are not used.
  constexpr char kRemarks[] = "hIST\0iCCP\0iTXt\0sPLT\0tEXt\0zTXt";
  png_set_keep_unknown_chunks(reader, PNG_HANDLE_CHUNK_NEVER,
                              reinterpret_cast<png_const_bytep>(kRemarks), 6);
  png_read_info(reader, info);
  png_set_expand(reader);  // palettes, 1 to 4 bits, transparent colours
  if (pixels == PngPixels::kBgr8) {
    png_set_strip_16(reader);
    png_set_strip_alpha(reader);
    png_set_gray_to_rgb(reader);
    png_set_bgr(reader);
    passes = png_set_interlace_handling(reader);
  } else if (std::endian::native == std::endian::little && png_get_bit_depth(reader, info) == 16) {
    png_set_swap(reader);
  }
  png_read_update_info(reader, info);
  return true;
}

void PngReader::State::TakeHeader() {
  constexpr double kMetersPerInch = 0.0254;
  header.width_px = static_cast<int>(png_get_image_width(reader, info));
  header.height_px = static_cast<int>(png_get_image_height(reader, info));
  header.samples = png_get_channels(reader, info);
  header.bits = png_get_bit_depth(reader, info);
  header.interlaced = png_get_interlace_type(reader, info) != PNG_INTERLACE_NONE;
  const double x = png_get_x_pixels_per_meter(reader, info);
  const double y = png_get_y_pixels_per_meter(reader, info);
  if (x > 0 && y > 0) {
    header.dpi_x = x * kMetersPerInch;
    header.dpi_y = y * kMetersPerInch;
  }
}

bool PngReader::State::ReadRow(std::uint8_t* row) {
  if (setjmp(png_jmpbuf(reader)) != 0) return false;
  png_read_row(reader, row, nullptr);
  return true;
}

bool PngReader::State::Finish() {
  if (setjmp(png_jmpbuf(reader)) != 0) return false;
  png_read_end(reader, end);
  return true;
}

PngReader::PngReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
PngReader::PngReader(PngReader&&) noexcept = default;
PngReader& PngReader::operator=(PngReader&&) noexcept = default;
PngReader::~PngReader() = default;

Result<PngReader> PngReader::Open(std::span<const std::uint8_t> bytes, PngPixels pixels) {
  auto state = std::make_unique<State>();
  state->bytes = bytes;
  state->reader =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, state.get(), State::Complain, State::Ignore);
  if (state->reader != nullptr) {
    state->info = png_create_info_struct(state->reader);
    state->end = png_create_info_struct(state->reader);
  }
  if (state->info == nullptr || state->end == nullptr) {
    return Fail("there is no memory for a PNG decoder");
  }
  if (!state->Begin(pixels)) return state->Rejected();
  state->TakeHeader();
  return PngReader(std::move(state));
}

const PngHeader& PngReader::header() const { return state_->header; }
std::size_t PngReader::row_bytes() const { return png_get_rowbytes(state_->reader, state_->info); }
int PngReader::passes() const { return state_->passes; }

Result<void> PngReader::ReadRow(std::uint8_t* row) {
  if (!state_->ReadRow(row)) return state_->Rejected();
  return {};
}

Result<void> PngReader::Finish() {
  if (!state_->Finish()) return state_->Rejected();
  return {};
}

int PngReader::orientation() const {
  for (png_infop part : {state_->info, state_->end}) {
    png_uint_32 count = 0;
    png_bytep exif = nullptr;
    if (png_get_eXIf_1(state_->reader, part, &count, &exif) != 0) {
      return ExifOrientation({exif, count});
    }
  }
  return 1;
}

namespace {

constexpr std::size_t kSignature = 8;

std::uint32_t BigEndian(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8U | bytes[at + i];
  return value;
}

std::string_view NameOf(std::span<const std::uint8_t> chunk) {
  return {reinterpret_cast<const char*>(chunk.data()) + 4, 4};
}

}  // namespace

Result<PngOutline> OutlineOfPng(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kHeader = 26;
  if (bytes.size() < kHeader || NameOf(bytes.subspan(kSignature)) != "IHDR") {
    return Fail("it begins like a PNG, but has no header");
  }
  constexpr std::uint32_t kMax = 0x7FFFFFFF;
  PngOutline outline{BigEndian(bytes, 16), BigEndian(bytes, 20), 0};
  if (outline.width_px == 0 || outline.height_px == 0 || outline.width_px > kMax ||
      outline.height_px > kMax) {
    return Fail(fmt::format("its header states {} x {} px", outline.width_px, outline.height_px));
  }
  constexpr std::array<int, 7> kSamples = {1, 1, 3, 1, 2, 1, 4};  // by PNG colour type
  outline.bits = bytes[24] * kSamples[std::min<std::size_t>(bytes[25], kSamples.size() - 1)];
  return outline;
}

Result<void> CheckCost(const PngOutline& outline, std::size_t bytes) {
  constexpr double kMaxPacked = 1032;  // deflate's max. ratio
  const double raster =
      static_cast<double>(outline.width_px) * outline.height_px * std::max(outline.bits, 1) / 8;
  if (raster <= kMaxPacked * static_cast<double>(bytes)) return {};
  return Fail(
      fmt::format("its header states {} x {} px, more than its {} bytes can hold; "
                  "it was cut off or is damaged: copy it again, or scan again",
                  outline.width_px, outline.height_px, bytes));
}

}  // namespace trammel::image
