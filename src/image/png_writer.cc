#include "image/png_writer.h"

#include <fmt/format.h>
#include <png.h>

#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstring>
#include <exception>
#include <utility>

#include "base/check.h"

namespace trammel::image {

// libpng's errors jump: functions that they leave may contain no object with a destructor.
struct PngWriter::State {
  png_structp writer = nullptr;
  png_infop info = nullptr;
  ByteSink sink;
  Result<void> taken;  ///< sink's result
  char said[200] = {};

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { png_destroy_write_struct(&writer, &info); }

  bool Begin(const PngForm& form);
  bool WriteRow(const std::uint8_t* row);
  bool Finish();
  [[nodiscard]] tl::unexpected<Error> Failed() const {
    if (!taken) return tl::unexpected(taken.error());
    return Fail(fmt::format("a PNG could not be encoded ({})", said));
  }
  bool Take(std::span<const std::uint8_t> bytes) noexcept {
    try {
      taken = sink(bytes);
    } catch (const std::exception& exception) {
      taken = Fail(fmt::format("a PNG could not be kept ({})", exception.what()));
    }
    return taken.has_value();
  }

  static void Complain(png_structp writer, png_const_charp message) {
    auto& state = *static_cast<State*>(png_get_error_ptr(writer));
    std::strncpy(state.said, message, sizeof state.said - 1);
    png_longjmp(writer, 1);
  }
  static void Ignore(png_structp /*writer*/, png_const_charp /*message*/) {}
  static void Put(png_structp writer, png_bytep bytes, std::size_t count) {
    if (!static_cast<State*>(png_get_io_ptr(writer))->Take({bytes, count})) {
      png_error(writer, "its bytes were not taken");
    }
  }
  static void Flush(png_structp /*writer*/) {}
};

namespace {

png_uint_32 PerMetre(double dpi) {
  constexpr double kInchesPerMetre = 1 / 0.0254;
  return static_cast<png_uint_32>(std::lround(dpi * kInchesPerMetre));
}

}  // namespace

bool PngWriter::State::Begin(const PngForm& form) {
  constexpr std::size_t kChunkBytes = 1 << 16;  // each goes to the sink at once
  constexpr int kBestSpeed = 1;                 // zlib's
  constexpr int kRunLengths = 3;
  constexpr int kDense = 3;
  if (setjmp(png_jmpbuf(writer)) != 0) return false;
  png_set_write_fn(writer, this, Put, Flush);
  png_set_compression_buffer_size(writer, kChunkBytes);
  if (form.packing == PngForm::Packing::kFast) {
    png_set_filter(writer, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(writer, kBestSpeed);
    png_set_compression_strategy(writer, kRunLengths);
  } else {
    png_set_compression_level(writer, kDense);
  }
  png_set_IHDR(writer, info, static_cast<png_uint_32>(form.width_px),
               static_cast<png_uint_32>(form.height_px), form.bits,
               form.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (form.dpi_x && form.dpi_y) {
    png_set_pHYs(writer, info, PerMetre(*form.dpi_x), PerMetre(*form.dpi_y), PNG_RESOLUTION_METER);
  }
  png_write_info(writer, info);
  if (form.channels == 3 && form.order == PngForm::Order::kBgr) png_set_bgr(writer);
  if (form.bits == 16 && std::endian::native == std::endian::little) png_set_swap(writer);
  return true;
}

bool PngWriter::State::WriteRow(const std::uint8_t* row) {
  if (setjmp(png_jmpbuf(writer)) != 0) return false;
  png_write_row(writer, row);
  return true;
}

bool PngWriter::State::Finish() {
  if (setjmp(png_jmpbuf(writer)) != 0) return false;
  png_write_end(writer, nullptr);
  return true;
}

PngWriter::PngWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
PngWriter::PngWriter(PngWriter&&) noexcept = default;
PngWriter& PngWriter::operator=(PngWriter&&) noexcept = default;
PngWriter::~PngWriter() = default;

Result<PngWriter> PngWriter::Create(const PngForm& form, ByteSink sink) {
  constexpr int kMaxOfASide = 1'000'000;
  TRAMMEL_CHECK(form.channels == 1 || form.channels == 3, "{} channels", form.channels);
  TRAMMEL_CHECK(form.bits == 8 || form.bits == 16, "{} bits", form.bits);
  if (form.width_px < 1 || form.height_px < 1 || form.width_px > kMaxOfASide ||
      form.height_px > kMaxOfASide) {
    return Fail(fmt::format("a PNG of {} x {} px; 1 to {} px a side can be written", form.width_px,
                            form.height_px, kMaxOfASide));
  }
  auto state = std::make_unique<State>();
  state->sink = std::move(sink);
  state->writer =
      png_create_write_struct(PNG_LIBPNG_VER_STRING, state.get(), State::Complain, State::Ignore);
  if (state->writer != nullptr) state->info = png_create_info_struct(state->writer);
  if (state->info == nullptr) return Fail("there is no memory for a PNG encoder");
  if (!state->Begin(form)) return state->Failed();
  return PngWriter(std::move(state));
}

Result<void> PngWriter::WriteRow(const std::uint8_t* row) {
  if (!state_->WriteRow(row)) return state_->Failed();
  return {};
}

Result<void> PngWriter::Finish() {
  if (!state_->Finish()) return state_->Failed();
  return {};
}

Result<std::vector<std::uint8_t>> EncodePng(const PageView& pixels, std::optional<double> dpi_x,
                                            std::optional<double> dpi_y) {
  PngForm form;
  form.width_px = pixels.width;
  form.height_px = pixels.height;
  form.channels = pixels.channels;
  form.dpi_x = dpi_x;
  form.dpi_y = dpi_y;
  std::vector<std::uint8_t> bytes;
  auto png = PngWriter::Create(form, [&bytes](std::span<const std::uint8_t> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return Result<void>();
  });
  if (!png) return tl::unexpected(png.error());
  for (int y = 0; y < pixels.height; ++y) {
    TRY(png->WriteRow(pixels.row(y)));
  }
  TRY(png->Finish());
  return bytes;
}

}  // namespace trammel::image
