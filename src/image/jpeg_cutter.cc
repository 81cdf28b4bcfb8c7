#include "image/jpeg_cutter.h"

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <optional>

// Declares FILE before libjpeg's headers, which require it.
#include <jerror.h>

#include "image/jpeg_compressor.h"
#include "image/jpeg_reader.h"

namespace trammel::image {
namespace {

constexpr std::size_t kMaxComponents = 3;

// Both libjpeg structures report to the compressor, and jump to it.
struct Cutter {
  JpegCompressor out;
  jpeg_decompress_struct in{};
  jpeg_error_mgr errors{};
  std::array<jvirt_barray_ptr, kMaxComponents> kept{};  // coefficients of the cut

  explicit Cutter(std::vector<std::uint8_t>& cut) : out(cut) {}
  Cutter(const Cutter&) = delete;
  Cutter& operator=(const Cutter&) = delete;
  ~Cutter() { jpeg_destroy_decompress(&in); }  // does nothing where it was not created

  bool Cut(std::span<const std::uint8_t> bytes, const PixelRect& rect,
           std::span<const std::uint8_t> place);

 private:
  void Open(std::span<const std::uint8_t> bytes);
  void MakeRoom(const PixelRect& rect);
  void Copy(const PixelRect& rect, jvirt_barray_ptr* read);

  // Treats a warning (level -1) as damage, except for extra bytes that cameras write before a
  // marker.
  static void Warn(j_common_ptr in, int level) {
    if (level < 0 && in->err->msg_code != JWRN_EXTRANEOUS_DATA) JpegCompressor::Complain(in);
  }
};

/// Blocks of one component.
struct Blocks {
  JDIMENSION x = 0;
  JDIMENSION y = 0;
  JDIMENSION width = 0;
  JDIMENSION height = 0;
};

/// Returns the blocks of all whole MCUs of a rectangle, including padding at the picture's ends.
Blocks BlocksOf(const jpeg_decompress_struct& in, const jpeg_component_info& component,
                const PixelRect& rect) {
  const auto count = [](int px, int mcu, int factor) {
    return static_cast<JDIMENSION>((px + mcu - 1) / mcu * factor);
  };
  const int mcu_width = in.max_h_samp_factor * DCTSIZE;
  const int mcu_height = in.max_v_samp_factor * DCTSIZE;
  return {count(rect.x, mcu_width, component.h_samp_factor),
          count(rect.y, mcu_height, component.v_samp_factor),
          count(rect.width, mcu_width, component.h_samp_factor),
          count(rect.height, mcu_height, component.v_samp_factor)};
}

void Cutter::Open(std::span<const std::uint8_t> bytes) {
  in.err = jpeg_std_error(&errors);
  errors.error_exit = JpegCompressor::Complain;
  errors.emit_message = Warn;
  in.client_data = &out;
  jpeg_create_decompress(&in);  // keeps err and client_data
  jpeg_mem_src(&in, bytes.data(), bytes.size());
  jpeg_read_header(&in, TRUE);
  for (int c = 0; c < in.num_components; ++c) {  // like the decoder that reads the cut
    const jpeg_component_info& component = in.comp_info[c];
    if (in.max_h_samp_factor % component.h_samp_factor != 0 ||
        in.max_v_samp_factor % component.v_samp_factor != 0) {
      ERREXIT(&in, JERR_FRACT_SAMPLE_NOTIMPL);
    }
  }
}

/// Requests arrays for the cut's coefficients. REQUIRES that none were read: memory is allocated on
/// reading.
void Cutter::MakeRoom(const PixelRect& rect) {
  for (int c = 0; c < in.num_components; ++c) {
    const jpeg_component_info& component = in.comp_info[c];
    const Blocks blocks = BlocksOf(in, component, rect);
    kept[static_cast<std::size_t>(c)] = in.mem->request_virt_barray(
        reinterpret_cast<j_common_ptr>(&in), JPOOL_IMAGE, FALSE, blocks.width, blocks.height,
        static_cast<JDIMENSION>(component.v_samp_factor));
  }
}

void Cutter::Copy(const PixelRect& rect, jvirt_barray_ptr* read) {
  const auto row_of = [&](jvirt_barray_ptr blocks, JDIMENSION row, boolean writable) {
    return *in.mem->access_virt_barray(reinterpret_cast<j_common_ptr>(&in), blocks, row, 1,
                                       writable);
  };
  for (int c = 0; c < in.num_components; ++c) {
    const Blocks blocks = BlocksOf(in, in.comp_info[c], rect);
    for (JDIMENSION y = 0; y < blocks.height; ++y) {
      const JBLOCKROW from = row_of(read[c], blocks.y + y, FALSE);
      const JBLOCKROW to = row_of(kept[static_cast<std::size_t>(c)], y, TRUE);
      std::memcpy(to, from + blocks.x, blocks.width * sizeof(JBLOCK));
    }
  }
}

bool Cutter::Cut(std::span<const std::uint8_t> bytes, const PixelRect& rect,
                 std::span<const std::uint8_t> place) {
  if (setjmp(out.back) != 0) return false;
  Open(bytes);
  MakeRoom(rect);
  jvirt_barray_ptr* const read = jpeg_read_coefficients(&in);
  Copy(rect, read);
  out.Create();
  jpeg_copy_critical_parameters(&in, &out.jpeg);
  out.jpeg.image_width = static_cast<JDIMENSION>(rect.width);
  out.jpeg.image_height = static_cast<JDIMENSION>(rect.height);
  out.jpeg.optimize_coding = TRUE;
  jpeg_write_coefficients(&out.jpeg, kept.data());
  if (!place.empty()) {
    jpeg_write_marker(&out.jpeg, kPlaceMarker, place.data(), static_cast<unsigned>(place.size()));
  }
  jpeg_finish_compress(&out.jpeg);
  jpeg_finish_decompress(&in);
  return true;
}

/// Returns why the picture cannot be cut; empty if it can.
std::string_view WhyNot(const JpegHeader& header, const PixelRect& part) {
  if (header.multiple_scans) return "it has several scans";
  if (header.components != 1 && header.components != 3)
    return "it is neither grey nor of 3 colours";
  if (header.place) return "it was cut before";
  if (part.x < 0 || part.y < 0 || part.width < 1 || part.height < 1 ||
      part.x > header.width_px - part.width || part.y > header.height_px - part.height) {
    return "the part does not lie within it";
  }
  return {};
}

}  // namespace

Result<void> CutJpeg(std::span<const std::uint8_t> bytes, const PixelRect& part,
                     std::vector<std::uint8_t>& cut) {
  const auto reader = TRY(JpegReader::Open(bytes, JpegDamage::kRefuse));
  const JpegHeader& header = reader.header();
  if (const auto why = WhyNot(header, part); !why.empty()) {
    return Fail(fmt::format("{}x{} px at ({}, {}) cannot be cut from a JPEG of {}x{} px: {}",
                            part.width, part.height, part.x, part.y, header.width_px,
                            header.height_px, why));
  }
  const PixelRect rect = CutAround(part, header.grid());
  const bool all = rect.width == header.width_px && rect.height == header.height_px;
  std::array<std::uint8_t, kPlaceBytes> place{};
  if (!all) place = FormatPlace({rect.x, rect.y, header.width_px, header.height_px});
  Cutter cutter(cut);
  if (!cutter.Cut(bytes, rect, all ? std::span<const std::uint8_t>() : place)) {
    return Fail(fmt::format("the decoder rejects it ({})", cutter.out.said));
  }
  return {};
}

}  // namespace trammel::image
