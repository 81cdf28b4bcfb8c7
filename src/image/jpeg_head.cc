#include "image/jpeg_head.h"

#include "image/jpeg_compressor.h"

namespace trammel::image {
namespace {

using Bytes = std::span<const std::uint8_t>;

int U16(Bytes bytes, std::size_t at) { return bytes[at] << 8 | bytes[at + 1]; }

bool SetDefaults(JpegCompressor& compressor) {
  if (setjmp(compressor.back) != 0) return false;
  compressor.Create();
  compressor.jpeg.in_color_space = JCS_RGB;
  compressor.jpeg.input_components = kMostColours;
  jpeg_set_defaults(&compressor.jpeg);
  return true;
}

/// Those that a picture has where it leaves them out; libjpeg knows them.
HuffmanTables StandardTables() {
  std::vector<std::uint8_t> nothing;
  JpegCompressor compressor(nothing);
  HuffmanTables tables;
  if (!SetDefaults(compressor)) return tables;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto take = [](const JHUFF_TBL& from, HuffmanTable& to) {
      std::copy_n(from.bits + 1, to.counts.size(), to.counts.begin());
      std::copy_n(from.huffval, to.symbols.size(), to.symbols.begin());
    };
    take(*compressor.jpeg.dc_huff_tbl_ptrs[i], tables.dc[i]);
    take(*compressor.jpeg.ac_huff_tbl_ptrs[i], tables.ac[i]);
  }
  return tables;
}

bool TakeHuffmanTables(Bytes segment, JpegHead& head) {
  while (!segment.empty()) {
    constexpr std::size_t kCounts = 17;
    if (segment.size() < kCounts) return false;
    const std::size_t id = segment[0] & 15;
    if (id > 1 || segment[0] >> 4 > 1) return false;
    HuffmanTable table;
    std::copy_n(segment.begin() + 1, table.counts.size(), table.counts.begin());
    std::size_t symbols = 0;
    for (const std::uint8_t count : table.counts) symbols += count;
    if (symbols > table.symbols.size() || segment.size() < kCounts + symbols) return false;
    std::copy_n(segment.begin() + kCounts, symbols, table.symbols.begin());
    (segment[0] >> 4 == 0 ? head.tables.dc : head.tables.ac)[id] = table;
    segment = segment.subspan(kCounts + symbols);
  }
  return true;
}

bool TakeFrame(Bytes segment, JpegHead& head) {
  constexpr std::size_t kBefore = 6;
  constexpr std::size_t kEach = 3;
  if (segment.size() < kBefore || head.components > 0 || segment[0] != 8) return false;
  head.frame = segment;
  head.height_px = U16(segment, 1);
  head.width_px = U16(segment, 3);
  head.components = segment[5];
  const std::size_t count = head.components;
  if ((count != 1 && count != kMostColours) || segment.size() != kBefore + kEach * count ||
      head.width_px < 1 || head.height_px < 1) {
    return false;
  }
  for (std::size_t c = 0; c < count; ++c) {
    JpegComponent& component = head.component[c];
    component.id = segment[kBefore + kEach * c];
    component.across = segment[kBefore + kEach * c + 1] >> 4;
    component.down = segment[kBefore + kEach * c + 1] & 15;
    const auto usual = [](int factor) { return factor == 1 || factor == 2 || factor == 4; };
    if (!usual(component.across) || !usual(component.down)) return false;
    // Blocks of a component by itself come in another order.
    if (count == 1 && (component.across > 1 || component.down > 1)) return false;
  }
  return true;
}

bool TakeScan(Bytes segment, JpegHead& head) {
  const std::size_t count = head.components;
  if (count == 0 || segment.size() != 2 * count + 4 || segment[0] != count) return false;
  head.scan = segment;
  for (std::size_t c = 0; c < count; ++c) {
    JpegComponent& component = head.component[c];
    const std::uint8_t tables = segment[2 + 2 * c];
    component.dc = tables >> 4;
    component.ac = tables & 15;
    if (segment[1 + 2 * c] != component.id || component.dc > 1 || component.ac > 1) return false;
  }
  const Bytes spectrum = segment.subspan(1 + 2 * count);
  return spectrum[0] == 0 && spectrum[1] == kCoefficients - 1 && spectrum[2] == 0;
}

/// Takes one segment before the scan.
bool TakeSegment(std::uint8_t marker, Bytes whole, JpegHead& head) {
  const Bytes segment = whole.subspan(4);
  switch (marker) {
    case JpegMarker::kBaseline:
      return TakeFrame(segment, head);
    case JpegMarker::kHuffmanTables:
      head.copied.push_back(whole);
      return TakeHuffmanTables(segment, head);
    case JpegMarker::kRestarts:
      if (segment.size() != 2) return false;
      head.restart_mcus = U16(segment, 0);
      return true;
    case JpegMarker::kQuantisation:
    case JpegMarker::kJfif:
    case JpegMarker::kAdobe:  // they say which colours the components are
      head.copied.push_back(whole);
      return true;
    default:
      return (marker > JpegMarker::kJfif && marker <= JpegMarker::kLastApplication) ||
             marker == JpegMarker::kComment;
  }
}

}  // namespace

bool ReadHead(Bytes jpeg, JpegHead& head) {
  static const HuffmanTables kStandard = StandardTables();
  head.tables = kStandard;
  if (jpeg.size() < 4 || jpeg[0] != 0xFF || jpeg[1] != JpegMarker::kStart) return false;
  for (std::size_t at = 2; at + 4 <= jpeg.size();) {
    if (jpeg[at] != 0xFF) return false;
    const std::uint8_t marker = jpeg[at + 1];
    const auto length = static_cast<std::size_t>(U16(jpeg, at + 2));
    if (length < 2 || at + 2 + length > jpeg.size()) return false;
    const Bytes whole = jpeg.subspan(at, 2 + length);
    at += 2 + length;
    if (marker == JpegMarker::kScan) {
      head.data = jpeg.subspan(at);
      return TakeScan(whole.subspan(4), head);
    }
    if (!TakeSegment(marker, whole, head)) return false;
  }
  return false;
}

}  // namespace trammel::image
