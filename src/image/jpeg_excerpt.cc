#include "image/jpeg_excerpt.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>

#include "image/block_walk.h"
#include "image/dense_scan.h"
#include "image/entropy_bits.h"
#include "image/entropy_data.h"
#include "image/entropy_writer.h"
#include "image/huffman_codes.h"
#include "image/jpeg_head.h"
#include "image/jpeg_place.h"
#include "image/mcu_scan.h"

namespace trammel::image {
namespace {

// Of more, most blocks take several look-ups, and two places at a time are worth a copy of the
// data; of fewer, most are passed in one look-up, or a whole MCU is.
constexpr std::size_t kDenseBlock_bit = 10;

// Where the walk ahead begins, as a share of the data: behind what is copied, and so that a scan
// from the front has its company for long. Behind the last of them it spares too little.
constexpr double kFirstAhead = 0.5;
constexpr double kLastAhead = 0.9;

/// The part, in MCUs.
struct McuPart {
  int across = 0;  ///< of the whole
  int down = 0;
  int left = 0;
  int top = 0;
  int wide = 0;
  int high = 0;

  McuPart(const JpegGrid& grid, const PixelRect& rect)
      : across(Count(grid.width, grid.mcu_width)),
        down(Count(grid.height, grid.mcu_height)),
        left(rect.x / grid.mcu_width),
        top(rect.y / grid.mcu_height),
        wide(Count(rect.width, grid.mcu_width)),
        high(Count(rect.height, grid.mcu_height)) {}

 private:
  static int Count(int px, int mcu) { return (px + mcu - 1) / mcu; }
};

bool CopyPart(const McuPart& part, auto& scan, EntropyWriter& writer) {
  if (!scan.Pass(part.top * part.across + part.left)) return false;
  for (int row = 0; row < part.high; ++row) {
    if (row > 0 && !scan.Pass(part.across - part.wide)) return false;
    if (!scan.Copy(part.wide, writer)) return false;
  }
  const int rows = part.down - part.top - part.high;
  return scan.PassLast(rows * part.across + part.across - part.left - part.wide);
}

}  // namespace

struct JpegExcerpter::State {
  /// The codes of a component, and the tables that they are made of.
  struct Codes {
    HuffmanTable dc;
    HuffmanTable ac;
    BlockCodes codes;
    bool walked = false;  ///< the walker has them
  };

  std::array<Codes, BlockWalker::kCodes> made;  // of each pair of a DC and an AC table
  McuBlocks mcu;
  BlockWalker walker;
  EntropyData data;
  std::vector<std::uint8_t> bytes;
  PixelRect rect;

  static bool MakeCodes(const HuffmanTable& dc, const HuffmanTable& ac, Codes& codes);
  bool ListBlocks(const JpegHead& head);
  void ListWalked(const JpegHead& head);
  void WriteHead(const JpegHead& head);
  bool TakeDense(const JpegHead& head, const McuPart& part, double ahead, EntropyWriter& writer);
  bool Take(std::span<const std::uint8_t> jpeg, const PixelRect& part);
};

/// Makes the codes of a component, unless they are those of the picture before.
bool JpegExcerpter::State::MakeCodes(const HuffmanTable& dc, const HuffmanTable& ac, Codes& codes) {
  if (codes.dc == dc && codes.ac == ac) return true;
  codes.dc = codes.ac = {};
  codes.walked = false;
  if (!codes.codes.Make(dc, ac)) return false;
  codes.dc = dc;
  codes.ac = ac;
  return true;
}

/// Lists the blocks of an MCU, with their codes.
bool JpegExcerpter::State::ListBlocks(const JpegHead& head) {
  mcu.Clear();
  for (std::size_t c = 0; c < head.components; ++c) {
    const JpegComponent& component = head.component[c];
    Codes& codes = made[component.codes()];
    if (!MakeCodes(head.tables.dc[component.dc], head.tables.ac[component.ac], codes)) {
      return false;
    }
    for (int i = 0; i < component.across * component.down; ++i) {
      if (!mcu.Add({&codes.codes, c})) return false;
    }
  }
  mcu.MakeFlat();
  return true;
}

/// Lists the same for the walker.
void JpegExcerpter::State::ListWalked(const JpegHead& head) {
  std::array<std::size_t, kMostMcuBlocks> numbers{};
  for (std::size_t b = 0; b < mcu.count(); ++b) {
    const std::size_t number = head.component[mcu.block(b).component].codes();
    if (!made[number].walked) walker.SetCodes(number, made[number].codes);
    made[number].walked = true;
    numbers[b] = number;
  }
  walker.SetMcu(std::span(numbers).first(mcu.count()));
}

void JpegExcerpter::State::WriteHead(const JpegHead& head) {
  const auto put = [this](std::initializer_list<int> numbers) {
    for (const int number : numbers) bytes.push_back(static_cast<std::uint8_t>(number));
  };
  const auto begin = [&](std::uint8_t marker, std::size_t size) {
    const auto length = static_cast<int>(size + 2);
    put({0xFF, marker, length >> 8, length & 0xFF});
  };
  bytes.clear();
  put({0xFF, JpegMarker::kStart});
  for (const std::span segment : head.copied) {
    bytes.insert(bytes.end(), segment.begin(), segment.end());
  }
  begin(JpegMarker::kHuffmanTables, 1 + 16 + kWrittenDc_bit + 1);
  put({0});  // for DC, the first
  for (int length = 1; length <= 16; ++length) {
    put({length == kWrittenDcCode_bit ? kWrittenDc_bit + 1 : 0});
  }
  for (int size = 0; size <= kWrittenDc_bit; ++size) put({size});
  begin(JpegMarker::kBaseline, head.frame.size());
  put({head.frame[0], rect.height >> 8, rect.height & 0xFF, rect.width >> 8, rect.width & 0xFF});
  bytes.insert(bytes.end(), head.frame.begin() + 5, head.frame.end());
  begin(JpegMarker::kScan, head.scan.size());
  put({head.scan[0]});
  for (std::size_t c = 0; c < head.components; ++c) {
    put({head.component[c].id, static_cast<int>(head.component[c].ac)});
  }
  put({0, kCoefficients - 1, 0});
}

/// @param ahead  where the walk ahead begins, as a share of the data.
bool JpegExcerpter::State::TakeDense(const JpegHead& head, const McuPart& part, double ahead,
                                     EntropyWriter& writer) {
  ListWalked(head);
  data.Start(head.data);
  DenseScan scan(mcu, walker, data);
  scan.BeginAhead(static_cast<std::size_t>(ahead * static_cast<double>(data.size_bit())));
  return CopyPart(part, scan, writer);
}

bool JpegExcerpter::State::Take(std::span<const std::uint8_t> jpeg, const PixelRect& part) {
  JpegHead head;
  if (!ReadHead(jpeg, head) || !ListBlocks(head)) return false;
  const JpegGrid grid = head.grid();
  for (std::size_t c = 0; c < head.components; ++c) {
    if (grid.mcu_width / 8 % head.component[c].across != 0) return false;
  }
  rect = CutAround(part, grid);
  WriteHead(head);
  EntropyWriter writer(bytes);
  const McuPart mcus(grid, rect);
  const std::size_t blocks =
      mcu.count() * static_cast<std::size_t>(mcus.across) * static_cast<std::size_t>(mcus.down);
  const double behind = static_cast<double>(mcus.top + mcus.high + 1) / mcus.down;
  const double ahead = std::max(behind, kFirstAhead);
  if (head.restart_mcus == 0 && 8 * head.data.size() > kDenseBlock_bit * blocks &&
      ahead < kLastAhead) {
    if (!TakeDense(head, mcus, ahead, writer)) return false;
  } else {
    McuScan scan(mcu, EntropyBits(head.data), head.restart_mcus);
    if (!CopyPart(mcus, scan, writer)) return false;
  }
  writer.Finish();
  bytes.insert(bytes.end(), {0xFF, JpegMarker::kEnd});
  return true;
}

JpegExcerpter::JpegExcerpter() : state_(std::make_unique<State>()) {}
JpegExcerpter::JpegExcerpter(JpegExcerpter&&) noexcept = default;
JpegExcerpter& JpegExcerpter::operator=(JpegExcerpter&&) noexcept = default;
JpegExcerpter::~JpegExcerpter() = default;

bool JpegExcerpter::Take(std::span<const std::uint8_t> jpeg, const PixelRect& part) {
  return state_->Take(jpeg, part);
}
const std::vector<std::uint8_t>& JpegExcerpter::bytes() const { return state_->bytes; }
const PixelRect& JpegExcerpter::rect() const { return state_->rect; }

}  // namespace trammel::image
