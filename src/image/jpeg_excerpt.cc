#include "image/jpeg_excerpt.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <utility>

#include "image/entropy_bits.h"
#include "image/huffman_codes.h"
#include "image/jpeg_compressor.h"
#include "image/jpeg_place.h"

namespace trammel::image {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kMostComponents = 3;
constexpr std::size_t kMostBlocks = 10;  // of an MCU, as the format has it

enum Marker : std::uint8_t {
  kBaseline = 0xC0,
  kHuffmanTables = 0xC4,
  kStart = 0xD8,
  kEnd = 0xD9,
  kScan = 0xDA,
  kQuantisation = 0xDB,
  kRestarts = 0xDD,
  kJfif = 0xE0,
  kAdobe = 0xEE,
  kLastApplication = 0xEF,
  kComment = 0xFE,
};

int U16(Bytes bytes, std::size_t at) { return bytes[at] << 8 | bytes[at + 1]; }

struct Component {
  std::uint8_t id = 0;
  int across = 1;  // blocks of an MCU
  int down = 1;
  std::size_t dc = 0;  // of the tables
  std::size_t ac = 0;
};

struct HuffmanTables {
  std::array<HuffmanTable, 2> dc;
  std::array<HuffmanTable, 2> ac;
};

bool SetDefaults(JpegCompressor& compressor) {
  if (setjmp(compressor.back) != 0) return false;
  compressor.Create();
  compressor.jpeg.in_color_space = JCS_RGB;
  compressor.jpeg.input_components = kMostComponents;
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

/// What is needed of the markers before the scan's data.
struct Head {
  int width_px = 0;
  int height_px = 0;
  int restart_mcus = 0;  // 0: none
  std::size_t components = 0;
  std::array<Component, kMostComponents> component;
  HuffmanTables tables;
  std::vector<Bytes> copied;  // segments that the excerpt has, too, with their markers
  Bytes frame;                // the frame's segment, behind its marker
  Bytes scan;                 // likewise
  Bytes data;                 // behind the scan's header

  [[nodiscard]] JpegGrid grid() const {
    JpegGrid grid{width_px, height_px, 8, 8};
    for (std::size_t c = 0; c < components; ++c) {
      grid.mcu_width = std::max(grid.mcu_width, 8 * component[c].across);
      grid.mcu_height = std::max(grid.mcu_height, 8 * component[c].down);
    }
    return grid;
  }
};

bool TakeHuffmanTables(Bytes segment, Head& head) {
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

bool TakeFrame(Bytes segment, Head& head) {
  constexpr std::size_t kBefore = 6;
  constexpr std::size_t kEach = 3;
  if (segment.size() < kBefore || head.components > 0 || segment[0] != 8) return false;
  head.frame = segment;
  head.height_px = U16(segment, 1);
  head.width_px = U16(segment, 3);
  head.components = segment[5];
  const std::size_t count = head.components;
  if ((count != 1 && count != kMostComponents) || segment.size() != kBefore + kEach * count ||
      head.width_px < 1 || head.height_px < 1) {
    return false;
  }
  for (std::size_t c = 0; c < count; ++c) {
    Component& component = head.component[c];
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

bool TakeScan(Bytes segment, Head& head) {
  const std::size_t count = head.components;
  if (count == 0 || segment.size() != 2 * count + 4 || segment[0] != count) return false;
  head.scan = segment;
  for (std::size_t c = 0; c < count; ++c) {
    Component& component = head.component[c];
    const std::uint8_t tables = segment[2 + 2 * c];
    component.dc = tables >> 4;
    component.ac = tables & 15;
    if (segment[1 + 2 * c] != component.id || component.dc > 1 || component.ac > 1) return false;
  }
  const Bytes spectrum = segment.subspan(1 + 2 * count);
  return spectrum[0] == 0 && spectrum[1] == kCoefficients - 1 && spectrum[2] == 0;
}

/// Takes one segment before the scan.
bool TakeSegment(std::uint8_t marker, Bytes whole, Head& head) {
  const Bytes segment = whole.subspan(4);
  switch (marker) {
    case kBaseline:
      return TakeFrame(segment, head);
    case kHuffmanTables:
      head.copied.push_back(whole);
      return TakeHuffmanTables(segment, head);
    case kRestarts:
      if (segment.size() != 2) return false;
      head.restart_mcus = U16(segment, 0);
      return true;
    case kQuantisation:
    case kJfif:
    case kAdobe:  // they say which colours the components are
      head.copied.push_back(whole);
      return true;
    default:
      return (marker > kJfif && marker <= kLastApplication) || marker == kComment;
  }
}

/// Reads the markers up to the scan's data; false where any is not as cameras write it.
bool ReadHead(Bytes jpeg, Head& head) {
  if (jpeg.size() < 4 || jpeg[0] != 0xFF || jpeg[1] != kStart) return false;
  for (std::size_t at = 2; at + 4 <= jpeg.size();) {
    if (jpeg[at] != 0xFF) return false;
    const std::uint8_t marker = jpeg[at + 1];
    const auto length = static_cast<std::size_t>(U16(jpeg, at + 2));
    if (length < 2 || at + 2 + length > jpeg.size()) return false;
    const Bytes whole = jpeg.subspan(at, 2 + length);
    at += 2 + length;
    if (marker == kScan) {
      head.data = jpeg.subspan(at);
      return TakeScan(whole.subspan(4), head);
    }
    if (!TakeSegment(marker, whole, head)) return false;
  }
  return false;
}

// The excerpt's table for DC differences of up to 11 bits: codes of four bits, the size itself.
constexpr int kDcCode_bit = 4;
constexpr int kMostDc_bit = 11;

/// Writes entropy-coded data.
class BitWriter {
 public:
  explicit BitWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  /// @param bits  right-aligned, `count` of them, at most 31; nothing above them.
  void Put(std::uint64_t bits, int count) {
    held_ = held_ << count | bits;
    count_ += count;
    while (count_ >= 8) {
      count_ -= 8;
      const auto byte = static_cast<std::uint8_t>(held_ >> count_);
      bytes_.push_back(byte);
      if (byte == 0xFF) bytes_.push_back(0);
    }
  }

  /// False where there is no code for the difference.
  [[nodiscard]] bool PutDc(int difference) {
    const int size = std::bit_width(static_cast<unsigned>(std::abs(difference)));
    if (size > kMostDc_bit) return false;
    const int number = difference < 0 ? difference + (1 << size) - 1 : difference;
    Put(static_cast<std::uint64_t>(size << size | number), kDcCode_bit + size);
    return true;
  }

  /// Fills the last byte up with ones.
  void Finish() { Put(0x7F, 7); }

 private:
  std::vector<std::uint8_t>& bytes_;
  std::uint64_t held_ = 0;
  int count_ = 0;
};

}  // namespace

struct JpegExcerpter::State {
  /// The codes of a component, and the tables that they are made of.
  struct Codes {
    HuffmanTable dc;
    HuffmanTable ac;
    BlockCodes codes;
  };
  struct Block {
    const BlockCodes* codes = nullptr;
    std::size_t component = 0;
  };
  /// Where one is in the scan.
  struct Scan {
    EntropyBits bits;
    std::array<int, kMostComponents> dc{};  // of the block before, per component
    int until_restart = 0;
    int restarts = 0;
  };

  /// An MCU of flat blocks (BlockCodes::Flat()), as it stands in the bits that are ready.
  struct FlatMcu {
    std::uint64_t code = 1;  // none of whose bits the mask has: there is no such MCU
    std::uint64_t mask = 0;
    int count = 0;

    [[nodiscard]] bool IsNext(const EntropyBits& bits) const {
      return (bits.Look() & mask) == code;
    }
  };

  std::array<Codes, 4> made;             // of each pair of a DC and an AC table
  std::array<Block, kMostBlocks> block;  // of an MCU
  std::size_t blocks = 0;
  FlatMcu flat;
  int restart_mcus = 0;
  std::array<int, kMostComponents> written_dc{};
  std::vector<std::uint8_t> bytes;
  PixelRect rect;

  static bool MakeCodes(const HuffmanTable& dc, const HuffmanTable& ac, Codes& codes);
  bool ListBlocks(const Head& head);
  void MakeFlat();
  bool Pass(Scan& scan, int mcus) const;
  bool Copy(Scan& scan, int mcus, BitWriter& writer);
  bool PassRestartWhereDue(Scan& scan) const;
  void WriteHead(const Head& head);
  bool Take(Bytes jpeg, const PixelRect& part);
};

/// Makes the codes of a component, unless they are those of the picture before.
bool JpegExcerpter::State::MakeCodes(const HuffmanTable& dc, const HuffmanTable& ac, Codes& codes) {
  if (codes.dc == dc && codes.ac == ac) return true;
  codes.dc = codes.ac = {};
  if (!codes.codes.Make(dc, ac)) return false;
  codes.dc = dc;
  codes.ac = ac;
  return true;
}

/// Lists the blocks of an MCU, with their codes.
bool JpegExcerpter::State::ListBlocks(const Head& head) {
  blocks = 0;
  for (std::size_t c = 0; c < head.components; ++c) {
    const Component& component = head.component[c];
    Codes& codes = made[2 * component.dc + component.ac];
    if (!MakeCodes(head.tables.dc[component.dc], head.tables.ac[component.ac], codes)) {
      return false;
    }
    for (int i = 0; i < component.across * component.down; ++i) {
      if (blocks == block.size()) return false;
      block[blocks++] = {&codes.codes, c};
    }
  }
  MakeFlat();
  return true;
}

/// Joins the listed blocks' flat codes, unless they are more than is ready at a time.
void JpegExcerpter::State::MakeFlat() {
  flat = {};
  BitString joined;
  for (std::size_t b = 0; b < blocks; ++b) {
    const BitString one = block[b].codes->Flat();
    joined.count += one.count;
    if (one.count == 0 || joined.count > EntropyBits::kReady_bit) return;
    joined.bits = joined.bits << one.count | one.bits;
  }
  const int unused = 64 - joined.count;
  flat = {joined.bits << unused, ~std::uint64_t{0} << unused, joined.count};
}

bool JpegExcerpter::State::PassRestartWhereDue(Scan& scan) const {
  if (scan.until_restart-- > 0) return true;
  if (!scan.bits.PassRestart(scan.restarts)) return false;
  scan.restarts = (scan.restarts + 1) % 8;
  scan.until_restart = restart_mcus - 1;
  scan.dc = {};
  return true;
}

/// Goes past so many AC coefficients of a block.
[[gnu::always_inline]] inline bool PassCoefficients(const BlockCodes& codes, int left,
                                                    EntropyBits& bits) {
  while (left > 0) {
    bits.Fill();
    for (int i = 0; i < EntropyBits::kReady_bit / BlockCodes::kLookedUp_bit; ++i) {
      AcStep step = codes.Several(bits.Look());
      if (left > step.weight()) [[likely]] {
        bits.Skip(step.bits());
        left -= step.weight();
        continue;
      }
      if (!step.found() || step.count() > left) {
        bits.Fill();
        step = codes.Ac(bits.Look());
        if (!step.found() || step.count() > left) return false;
      }
      bits.Skip(step.bits());
      left = step.ends() ? 0 : left - step.count();
      break;
    }
  }
  return true;
}

/// Goes past so many MCUs.
bool JpegExcerpter::State::Pass(Scan& scan, int mcus) const {
  EntropyBits bits = scan.bits;
  for (; mcus > 0; --mcus) {
    if (scan.until_restart == 0) {
      scan.bits = bits;
      if (!PassRestartWhereDue(scan)) return false;
      bits = scan.bits;
    } else {
      --scan.until_restart;
    }
    bits.Fill();
    if (flat.IsNext(bits)) {
      bits.Skip(flat.count);
      if (bits.RanOut()) return false;
      continue;
    }
    // Filled no oftener than is needed: what a look-up waits for is the fill before it.
    int ready = EntropyBits::kReady_bit;  // at least
    for (std::size_t b = 0; b < blocks; ++b) {
      const BlockCodes& codes = *block[b].codes;
      if (ready < BlockCodes::kLookedUp_bit) {
        bits.Fill();
        ready = EntropyBits::kReady_bit;
      }
      FirstStep step = codes.First(bits.Look());
      ready -= BlockCodes::kLookedUp_bit;
      if (step.bits == 0) [[unlikely]] {
        bits.Fill();
        step = codes.Dc(bits.Look());
        if (step.bits == 0) return false;
        ready = 0;
      }
      bits.Skip(step.bits);
      scan.dc[block[b].component] += step.difference;
      if (step.left > 0) {
        if (!PassCoefficients(codes, step.left, bits)) return false;
        ready = 0;
      }
    }
    if (bits.RanOut()) return false;
  }
  scan.bits = bits;
  return true;
}

/// Copies the AC coefficients of a block.
bool CopyCoefficients(const BlockCodes& codes, EntropyBits& bits, BitWriter& writer) {
  for (int left = kCoefficients - 1; left > 0;) {
    bits.Fill();
    AcStep step = codes.Several(bits.Look());
    if (left <= step.weight()) {  // the block's end lies between them, or there is none
      step = codes.Ac(bits.Look());
      if (!step.found() || step.count() > left) return false;
    }
    writer.Put(bits.Look() >> (64 - step.bits()), step.bits());
    bits.Skip(step.bits());
    left = step.ends() ? 0 : left - step.count();
  }
  return true;
}

/// Copies so many MCUs, whose DC coefficients follow what was written before.
bool JpegExcerpter::State::Copy(Scan& scan, int mcus, BitWriter& writer) {
  for (; mcus > 0; --mcus) {
    if (!PassRestartWhereDue(scan)) return false;
    for (std::size_t b = 0; b < blocks; ++b) {
      const BlockCodes& codes = *block[b].codes;
      scan.bits.Fill();
      const FirstStep dc = codes.Dc(scan.bits.Look());
      if (dc.bits == 0) return false;
      scan.bits.Skip(dc.bits);
      int& now = scan.dc[block[b].component];
      now += dc.difference;
      if (!writer.PutDc(now - std::exchange(written_dc[block[b].component], now))) return false;
      if (!CopyCoefficients(codes, scan.bits, writer)) return false;
    }
  }
  return true;
}

void JpegExcerpter::State::WriteHead(const Head& head) {
  const auto put = [this](std::initializer_list<int> numbers) {
    for (const int number : numbers) bytes.push_back(static_cast<std::uint8_t>(number));
  };
  const auto begin = [&](Marker marker, std::size_t size) {
    const auto length = static_cast<int>(size + 2);
    put({0xFF, marker, length >> 8, length & 0xFF});
  };
  bytes.clear();
  put({0xFF, kStart});
  for (const Bytes segment : head.copied) {
    bytes.insert(bytes.end(), segment.begin(), segment.end());
  }
  begin(kHuffmanTables, 1 + 16 + kMostDc_bit + 1);
  put({0});  // for DC, the first
  for (int length = 1; length <= 16; ++length) {
    put({length == kDcCode_bit ? kMostDc_bit + 1 : 0});
  }
  for (int size = 0; size <= kMostDc_bit; ++size) put({size});
  begin(kBaseline, head.frame.size());
  put({head.frame[0], rect.height >> 8, rect.height & 0xFF, rect.width >> 8, rect.width & 0xFF});
  bytes.insert(bytes.end(), head.frame.begin() + 5, head.frame.end());
  begin(kScan, head.scan.size());
  put({head.scan[0]});
  for (std::size_t c = 0; c < head.components; ++c) {
    put({head.component[c].id, static_cast<int>(head.component[c].ac)});
  }
  put({0, kCoefficients - 1, 0});
}

bool JpegExcerpter::State::Take(Bytes jpeg, const PixelRect& part) {
  static const HuffmanTables kStandard = StandardTables();
  Head head;
  head.tables = kStandard;
  if (!ReadHead(jpeg, head) || !ListBlocks(head)) return false;
  const JpegGrid grid = head.grid();
  for (std::size_t c = 0; c < head.components; ++c) {
    if (grid.mcu_width / 8 % head.component[c].across != 0) return false;
  }
  rect = CutAround(part, grid);
  WriteHead(head);
  const auto mcus = [](int px, int mcu) { return (px + mcu - 1) / mcu; };
  const int across = mcus(grid.width, grid.mcu_width);
  const int down = mcus(grid.height, grid.mcu_height);
  const int left = rect.x / grid.mcu_width;
  const int wide = mcus(rect.width, grid.mcu_width);
  const int top = rect.y / grid.mcu_height;
  const int high = mcus(rect.height, grid.mcu_height);
  restart_mcus = head.restart_mcus;
  written_dc = {};
  Scan scan{EntropyBits(head.data)};
  scan.until_restart = restart_mcus > 0 ? restart_mcus : std::numeric_limits<int>::max();
  BitWriter writer(bytes);
  if (!Pass(scan, top * across + left)) return false;
  for (int row = 0; row < high; ++row) {
    if (row > 0 && !Pass(scan, across - wide)) return false;
    if (!Copy(scan, wide, writer) || scan.bits.RanOut()) return false;
  }
  if (!Pass(scan, (down - top - high) * across + across - left - wide)) return false;
  writer.Finish();
  bytes.insert(bytes.end(), {0xFF, kEnd});
  return !scan.bits.RanOut();
}

JpegExcerpter::JpegExcerpter() : state_(std::make_unique<State>()) {}
JpegExcerpter::JpegExcerpter(JpegExcerpter&&) noexcept = default;
JpegExcerpter& JpegExcerpter::operator=(JpegExcerpter&&) noexcept = default;
JpegExcerpter::~JpegExcerpter() = default;

bool JpegExcerpter::Take(Bytes jpeg, const PixelRect& part) { return state_->Take(jpeg, part); }
const std::vector<std::uint8_t>& JpegExcerpter::bytes() const { return state_->bytes; }
const PixelRect& JpegExcerpter::rect() const { return state_->rect; }

}  // namespace trammel::image
