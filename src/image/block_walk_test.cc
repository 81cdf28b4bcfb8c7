// Walks over entropy-coded data beside decoding code by code, bit by bit.
#include "image/block_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "base/random.h"
#include "image/dense_scan.h"
#include "image/entropy_bits.h"
#include "image/entropy_data.h"
#include "image/jpeg_kinds_test_support.h"
#include "image/mcu_scan.h"

namespace trammel::image {
namespace {

/// Codes of random lengths for all symbols of a kind, and for a few that are none.
HuffmanTable DrawTable(bool dc, Random& random) {
  std::vector<std::uint8_t> symbols;
  for (int symbol = 0; symbol < (dc ? 12 : 256); ++symbol) {
    if (symbol == 1) symbols.push_back(1);  // with which any block can be filled up
    if (symbol == 1) continue;
    const bool usual = dc || symbol % 16 != 0 || symbol == 0 || symbol == 0xF0;
    if (usual ? random.Uniform() < 0.9 : random.Uniform() < 0.05) {
      symbols.push_back(static_cast<std::uint8_t>(symbol));
    }
  }
  for (std::size_t i = symbols.size(); i > 1; --i) {
    std::swap(symbols[i - 1], symbols[random.Below(i)]);
  }
  HuffmanTable table;
  std::copy(symbols.begin(), symbols.end(), table.symbols.begin());
  std::size_t left = symbols.size();
  std::size_t codes = 1;  // of a length that are free
  for (std::size_t i = 0; i < table.counts.size(); ++i) {
    codes *= 2;
    std::size_t count = left;
    if (i + 1 < table.counts.size()) {
      count = random.Below(std::min(codes / 2, left) + 1);
      // Codes of 16 bits must be enough for the rest, and that of nothing but ones is none.
      while (count > 0 && (codes - count) << (15 - i) <= left - count) --count;
    }
    table.counts[i] = static_cast<std::uint8_t>(count);
    left -= count;
    codes -= count;
  }
  return table;
}

struct Tables {
  std::vector<HuffmanTable> dc;
  std::vector<HuffmanTable> ac;
};

/// Decodes as the format's text says, with no table but that of the file.
class PlainDecoder {
 public:
  PlainDecoder(const Bytes& data, std::size_t at_bit) : at_bit_(at_bit) {
    for (std::size_t i = 0; i < data.size(); ++i) {
      if (data[i] == 0xFF && (i + 1 == data.size() || data[i + 1] != 0)) break;
      for (int bit = 7; bit >= 0; --bit) bits_.push_back((data[i] >> bit & 1) != 0);
      if (data[i] == 0xFF) ++i;
    }
  }

  [[nodiscard]] std::size_t at_bit() const { return at_bit_; }

  /// The DC difference of a block that is passed, or nothing where it cannot be.
  std::optional<int> PassBlock(const HuffmanTable& dc, const HuffmanTable& ac) {
    const auto size = Symbol(dc);
    if (!size || *size > 11) return std::nullopt;
    int difference = Number(*size);
    if (*size > 0 && difference < 1 << (*size - 1)) difference -= (1 << *size) - 1;
    for (int count = 1; count < kCoefficients;) {
      const auto symbol = Symbol(ac);
      if (!symbol) return std::nullopt;
      if (*symbol == 0) break;
      if (*symbol % 16 == 0 && *symbol != 0xF0) return std::nullopt;
      count += (*symbol >> 4) + 1;
      if (count > kCoefficients) return std::nullopt;
      (void)Number(*symbol & 15);
    }
    if (at_bit_ > bits_.size()) return std::nullopt;
    return difference;
  }

 private:
  int Number(int count) {
    int number = 0;
    for (; count > 0; --count) number = 2 * number + Bit();
    return number;
  }
  int Bit() {
    const bool bit = at_bit_ < bits_.size() && bits_[at_bit_];
    ++at_bit_;
    return bit ? 1 : 0;
  }
  std::optional<int> Symbol(const HuffmanTable& table) {
    int code = 0;
    int first = 0;
    int before = 0;
    for (const int count : table.counts) {
      code = 2 * code + Bit();
      first *= 2;
      if (code < first + count)
        return table.symbols[static_cast<std::size_t>(before + code - first)];
      first += count;
      before += count;
    }
    return std::nullopt;
  }

  std::vector<bool> bits_;
  std::size_t at_bit_;
};

/// Tables of one or two components, the blocks of an MCU, and a walker past them.
struct Mcu {
  Tables tables;
  std::vector<std::size_t> numbers;
  std::vector<BlockCodes> codes{BlockWalker::kCodes};
  BlockWalker walker;

  explicit Mcu(Random& random) {
    tables.dc.resize(BlockWalker::kCodes);
    tables.ac.resize(BlockWalker::kCodes);
    numbers.resize(1 + random.Below(random.Uniform() < 0.5 ? 2 : kMostMcuBlocks));
    for (std::size_t& number : numbers) number = random.Below(BlockWalker::kCodes);
    for (std::size_t i = 0; i < BlockWalker::kCodes; ++i) {
      tables.dc[i] = DrawTable(true, random);
      tables.ac[i] = DrawTable(false, random);
      made = codes[i].Make(tables.dc[i], tables.ac[i]) && made;
      walker.SetCodes(i, codes[i]);
    }
    walker.SetMcu(numbers);
  }
  bool made = true;
};

/// A symbol's code, as the format numbers them; of no bits where it has none.
BitString CodeOf(const HuffmanTable& table, int symbol) {
  std::uint64_t code = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < table.counts.size(); ++i, code *= 2) {
    for (int k = 0; k < table.counts[i]; ++k, ++at, ++code) {
      if (table.symbols[at] == symbol) return {code, static_cast<int>(i) + 1};
    }
  }
  return {};
}

/// Puts a symbol and random bits behind it; false where the table has none.
bool Put(const HuffmanTable& table, int symbol, Random& random, EntropyWriter& writer) {
  const BitString code = CodeOf(table, symbol);
  if (code.count == 0) return false;
  const int size = symbol & 15;
  writer.Put(code.bits << size | random.Below(1U << size), code.count + size);
  return true;
}

/// So many MCUs of blocks of every length, and some bytes behind them.
Bytes DrawData(const Mcu& mcu, int mcus, Random& random) {
  Bytes data;
  EntropyWriter writer(data);
  const double ends = random.Uniform(0.02, 0.5);
  for (std::size_t b = 0; b < mcu.numbers.size() * static_cast<std::size_t>(mcus); ++b) {
    const HuffmanTable& dc = mcu.tables.dc[mcu.numbers[b % mcu.numbers.size()]];
    const HuffmanTable& ac = mcu.tables.ac[mcu.numbers[b % mcu.numbers.size()]];
    const int most_size = random.Uniform() < 0.01 ? 12 : 3;  // for sums that stay small
    while (!Put(dc, static_cast<int>(random.Below(most_size)), random, writer)) {
    }
    for (int left = kCoefficients - 1; left > 0;) {
      const bool end = random.Uniform() < ends;
      const int symbol = end ? 0 : static_cast<int>(random.Below(256));
      const int count = end ? left : (symbol >> 4) + 1;
      const bool usual = end || symbol % 16 != 0 || symbol == 0xF0;
      if (usual && count <= left && Put(ac, symbol, random, writer)) left -= count;
    }
  }
  writer.Finish();
  return data;
}

/// Loses bytes, or changes one of them.
void Damage(Bytes& data, Random& random) {
  const std::size_t at = random.Below(data.size());
  const double kind = random.Uniform();
  if (kind < 0.3) {
    data.resize(at);
  } else if (kind < 0.6) {
    data.erase(data.begin() + static_cast<std::ptrdiff_t>(at));
  } else {
    data[at] = static_cast<std::uint8_t>(random.Bits());
  }
}

/// Passes blocks from a walk's place, which must be at their begin, as the plain decoder does.
void ExpectPlain(const Mcu& mcu, const Bytes& bytes, std::size_t from_bit, const BlockWalk& walk) {
  PlainDecoder decoder(bytes, from_bit);
  std::vector<std::uint32_t> dc(mcu.numbers.size());
  for (std::size_t b = 0; b < walk.passed(); ++b) {
    const std::size_t block = b % mcu.numbers.size();
    const std::size_t number = mcu.numbers[block];
    const auto difference = decoder.PassBlock(mcu.tables.dc[number], mcu.tables.ac[number]);
    ASSERT_TRUE(difference) << "block " << b;
    dc[block] += static_cast<std::uint32_t>(*difference);
  }
  std::vector<std::uint32_t> walked(dc.size());
  for (std::size_t i = 0; i < walk.dc.size(); ++i) walked[i % dc.size()] += walk.dc[i];
  EXPECT_EQ(walk.at_bit, decoder.at_bit());
  EXPECT_EQ(walked, dc);
}

bool FinishBlock(const BlockWalker& walker, const EntropyData& data, BlockWalk& walk) {
  while (!walk.between_blocks()) {
    if (!walker.PassCode(data, walk)) return false;
  }
  return true;
}

TEST(BlockWalk, PassesTheBlocksThatAPlainDecoderPasses) {
  Random random(41);
  std::size_t passed = 0;
  std::size_t beside_passed = 0;
  for (int i = 0; i < 16; ++i) {
    const Mcu mcu(random);
    ASSERT_TRUE(mcu.made);
    for (int j = 0; j < 20; ++j) {
      Bytes bytes = DrawData(mcu, 1 + static_cast<int>(random.Below(60)), random);
      if (j % 3 == 0) Damage(bytes, random);
      EntropyData data;
      data.Start(bytes);
      const std::size_t begin_bit = j % 2 == 0 ? 0 : random.Below(data.size_bit() + 1);
      BlockWalk walk = mcu.walker.Begin(0);
      BlockWalk beside = mcu.walker.Begin(begin_bit);
      BlockWalker::End end;
      if (j % 3 == 0) end.blocks = random.Below(200);
      if (j % 4 == 0) end.at_bit = random.Below(data.size_bit() + 1);
      (void)mcu.walker.PassTogether(end, data, walk, beside);
      EXPECT_LE(walk.passed(), end.blocks);
      if (FinishBlock(mcu.walker, data, walk) && walk.at_bit <= data.size_bit()) {
        ExpectPlain(mcu, bytes, 0, walk);
        passed += walk.passed();
      }
      beside.dc = {};  // of which nothing is kept
      if (FinishBlock(mcu.walker, data, beside) && beside.at_bit <= data.size_bit()) {
        BlockWalk again = mcu.walker.Begin(begin_bit);
        while (again.passed() < beside.passed()) {
          ASSERT_TRUE(mcu.walker.PassCode(data, again));
        }
        EXPECT_EQ(again.at_bit, beside.at_bit);
        beside_passed += beside.passed();
        ExpectPlain(mcu, bytes, begin_bit, again);
      }
    }
  }
  EXPECT_GT(passed, 2000U);
  EXPECT_GT(beside_passed, 2000U);
}

/// Where PassTogether() says that there is no code, a plain decoder finds none either.
TEST(BlockWalk, EndsWhereThereIsNoCode) {
  Random random(42);
  int ended = 0;
  for (int i = 0; i < 20; ++i) {
    const Mcu mcu(random);
    for (int j = 0; j < 20; ++j) {
      Bytes bytes = DrawData(mcu, 30, random);
      Damage(bytes, random);
      EntropyData data;
      data.Start(bytes);
      BlockWalk walk = mcu.walker.Begin(0);
      BlockWalk beside = mcu.walker.Begin(0);
      if (mcu.walker.PassTogether({}, data, walk, beside)) continue;
      ++ended;
      PlainDecoder decoder(bytes, 0);
      std::size_t blocks = 0;
      for (bool good = true; good; ++blocks) {
        const std::size_t number = mcu.numbers[blocks % mcu.numbers.size()];
        good = decoder.PassBlock(mcu.tables.dc[number], mcu.tables.ac[number]).has_value();
      }
      EXPECT_EQ(walk.passed(), blocks - 1);
    }
  }
  EXPECT_GT(ended, 50);
}

/// Blocks as McuScan and DenseScan have them.
McuBlocks BlocksOf(const Mcu& mcu) {
  McuBlocks blocks;
  for (const std::size_t number : mcu.numbers) {
    EXPECT_TRUE(blocks.Add({&mcu.codes[number], number % kMostColours}));
  }
  blocks.MakeFlat();
  return blocks;
}

// What is copied, what is refused: the same with company and without.
TEST(DenseScan, CopiesWhatAScanByItselfCopies) {
  Random random(43);
  int copied = 0;
  int refused = 0;
  int joined = 0;
  for (int i = 0; i < 24; ++i) {
    const Mcu mcu(random);
    const McuBlocks blocks = BlocksOf(mcu);
    for (int j = 0; j < 20; ++j) {
      int mcus = 3 + static_cast<int>(random.Below(150));
      Bytes bytes = DrawData(mcu, mcus, random);
      if (j % 3 == 0) Damage(bytes, random);
      if (j % 3 == 1) mcus += static_cast<int>(random.Below(3)) - 1;
      EntropyData data;
      data.Start(bytes);
      const int before = static_cast<int>(random.Below(static_cast<std::uint64_t>(mcus - 1)));
      const int part =
          1 + static_cast<int>(random.Below(static_cast<std::uint64_t>(mcus - before)));
      const auto copy = [&](auto& scan, Bytes& to) {
        EntropyWriter writer(to);
        return scan.Pass(before) && scan.Copy(part, writer) && scan.PassLast(mcus - before - part);
      };
      Bytes plain;
      McuScan scan(blocks, EntropyBits(bytes), 0);
      const bool good = copy(scan, plain);
      Bytes beside;
      DenseScan dense(blocks, mcu.walker, data);
      dense.BeginAhead(random.Below(data.size_bit() + 1));
      ASSERT_EQ(copy(dense, beside), good) << i << ", " << j;
      if (good) EXPECT_EQ(beside, plain);
      (good ? copied : refused) += 1;
      joined += dense.joined() ? 1 : 0;
    }
  }
  EXPECT_GT(copied, 100);
  EXPECT_GT(refused, 100);
  EXPECT_GT(joined, 50);
}

}  // namespace
}  // namespace trammel::image
