#include "image/block_walk.h"

#include <algorithm>

namespace trammel::image {
namespace {

constexpr int kLookedUp_bit = 12;
constexpr std::uint32_t kTableSize = 1U << kLookedUp_bit;

// The tables of a component, one behind the other.
constexpr std::uint32_t kFirst = 0 * kTableSize;      // at the beginning of a block
constexpr std::uint32_t kWithin = 1 * kTableSize;     // behind its DC coefficient
constexpr std::uint32_t kAfterOnes = 2 * kTableSize;  // behind the ones that long codes begin with
constexpr std::uint32_t kTablesSize = 3 * kTableSize;
constexpr int kOnes_bit = 9;  // no more than shorter codes have: all of ones is none

// An entry of a table. As the sum of a few entries begins with the sum of their bits, and as the
// highest bit, shifted down, masks what goes on with the block, neither is taken apart.
constexpr std::uint32_t kSkip = 63;                     // bits to go past
constexpr std::uint32_t kSkipped = 255;                 // likewise, of a sum
constexpr std::uint32_t kTable = kWithin | kAfterOnes;  // to go on with
constexpr int kDc_bit = 15;                             // difference of the DC coefficient
constexpr int kMostDc = 255;
constexpr int kCount_bit = 24;                                     // coefficients
constexpr std::uint32_t kGoesOn = 1U << 31;                        // with the same block
constexpr std::uint32_t kTooMany = 64;                             // of a sum of counts
constexpr std::uint32_t kNone = kTooMany << kCount_bit | kGoesOn;  // where there is no such entry

// Look-ups between two fills: the bits of the last are there, and an entry's bits end within them.
constexpr int kLookUps = 4;
constexpr int kMostSkip = 15;
static_assert(7 + (kLookUps - 1) * kMostSkip + kLookedUp_bit <= 64);

// Kept from the data's end by the walk beside: more than a few look-ups and the filled-up rest of
// the last byte, behind which it would go past what no picture has.
constexpr std::size_t kBesideEnd_bit = kLookUps * kMostSkip + 8;

class Entry {
 public:
  void Skip(int bits) { skip_ += bits; }
  void SetDc(const FirstStep& dc) {
    Skip(dc.bits);
    count_ = 1;
    difference_ = dc.difference;
  }
  [[nodiscard]] bool Takes(const AcStep& step) const {
    return step.found() && skip_ + step.bits() <= kMostSkip &&
           count_ + Coefficients(step) < kCoefficients;
  }
  /// Adds AC coefficients. REQUIRES that it takes them.
  void Add(const AcStep& step) {
    Skip(step.bits());
    count_ += Coefficients(step);
    if (step.ends()) table_ = kFirst;
  }
  void GoOnAfterOnes() {
    Skip(kOnes_bit);
    table_ = kAfterOnes;
  }
  [[nodiscard]] bool ends() const { return table_ == kFirst; }
  [[nodiscard]] int skip() const { return skip_; }
  [[nodiscard]] std::uint32_t packed() const {
    if (skip_ == 0 || skip_ > kMostSkip || difference_ < -kMostDc || difference_ > kMostDc)
      return kNone;
    const auto difference = static_cast<std::uint32_t>(difference_) & (2 * kMostDc + 1);
    return static_cast<std::uint32_t>(skip_) | table_ | difference << kDc_bit |
           static_cast<std::uint32_t>(count_) << kCount_bit | (ends() ? 0 : kGoesOn);
  }

 private:
  static int Coefficients(const AcStep& step) { return step.count() - (step.ends() ? 1 : 0); }

  int skip_ = 0;
  int count_ = 0;
  int difference_ = 0;
  std::uint32_t table_ = kWithin;
};

/// Adds as many AC codes as the looked-up bits hold whole.
void AddCodes(const BlockCodes& codes, std::uint64_t bits, Entry& entry) {
  while (!entry.ends() && entry.skip() < kLookedUp_bit) {
    const std::uint64_t next = bits << entry.skip();
    const int held = kLookedUp_bit - entry.skip();
    const AcStep step = codes.Ac(next);
    const bool first = entry.skip() == 0;  // may end behind them, where it is alone
    if (entry.Takes(step) && (first ? codes.AcCodeBits(next) : step.bits()) <= held) {
      entry.Add(step);
    } else {
      const bool ones = held >= kOnes_bit && ~next >> (64 - kOnes_bit) == 0;
      if (ones) entry.GoOnAfterOnes();
      return;
    }
  }
}

/// Fills the three tables of a component's codes.
void FillTables(const BlockCodes& codes, std::span<std::uint32_t> tables) {
  for (std::uint32_t i = 0; i < kTableSize; ++i) {
    const std::uint64_t bits = std::uint64_t{i} << (64 - kLookedUp_bit);
    Entry first;
    if (const FirstStep dc = codes.Dc(bits); dc.bits > 0 && dc.bits <= kLookedUp_bit) {
      first.SetDc(dc);
      AddCodes(codes, bits, first);
    }
    tables[kFirst + i] = first.packed();
    Entry within;
    AddCodes(codes, bits, within);
    tables[kWithin + i] = within.packed();
    Entry after;
    const AcStep step = codes.Ac(~(~std::uint64_t{0} >> kOnes_bit) | bits >> kOnes_bit);
    if (step.found()) after.Add({step.bits() - kOnes_bit, step.count(), step.ends()});
    tables[kAfterOnes + i] = after.packed();
  }
}

/// A few look-ups of a walk, all of which count or none.
class Lane {
 public:
  [[gnu::always_inline]] Lane(const BlockPlace& walk, const std::uint32_t* tables,
                              const EntropyData& data)
      : bits_(data.Look(walk.at_bit)),
        block_(walk.block),
        count_(walk.coefficients),
        base_(tables[walk.block]),
        at_(walk.table - base_ + Index()),
        next_(tables[walk.block + 1]) {}

  /// @tparam kSign  by which DC differences are counted; 0: they are not.
  template <int kSign>
  [[gnu::always_inline]] void LookUp(const std::uint32_t* steps, const std::uint32_t* tables,
                                     std::uint32_t* dc) {
    const std::uint32_t step = steps[base_ + at_];
    bits_ <<= step & kSkip;
    sum_ += step;
    count_ += step >> kCount_bit;
    counts_ |= count_;
    if constexpr (kSign != 0) {
      const std::int32_t difference = static_cast<std::int32_t>(step << 8) >> (8 + kDc_bit);
      dc[block_] += static_cast<std::uint32_t>(kSign * difference);
    }
    const auto goes_on = static_cast<std::uint32_t>(static_cast<std::int32_t>(step) >> 31);
    base_ = next_ ^ ((base_ ^ next_) & goes_on);
    at_ = (step & kTable) + Index();
    count_ &= goes_on;
    block_ += 1 + goes_on;
    next_ = tables[block_ + 1];
  }

  [[nodiscard]] bool good() const { return (counts_ & kTooMany) == 0; }

  [[gnu::always_inline]] void MoveOn(std::uint32_t round, BlockPlace& walk) const {
    walk.at_bit += sum_ & kSkipped;
    walk.coefficients = count_ & (kTooMany - 1);
    walk.table = base_ + (at_ & kTable);
    const bool around = block_ >= round;
    walk.block = around ? block_ - round : block_;
    walk.blocks += around ? round : 0;
  }

 private:
  [[nodiscard]] std::uint32_t Index() const {
    return static_cast<std::uint32_t>(bits_ >> (64 - kLookedUp_bit));
  }

  std::uint64_t bits_;
  std::uint32_t block_;
  std::uint32_t count_;
  std::uint32_t base_;  // of this block's tables
  std::uint32_t at_;    // of the next step in them
  std::uint32_t next_;  // of the next one's
  std::uint32_t sum_ = 0;
  std::uint32_t counts_ = 0;
};

}  // namespace

void BlockWalker::SetCodes(std::size_t number, const BlockCodes& codes) {
  if (steps_.empty()) steps_.resize(kCodes * kTablesSize);
  codes_[number] = &codes;
  FillTables(codes, std::span(steps_).subspan(number * kTablesSize, kTablesSize));
}

void BlockWalker::SetMcu(std::span<const std::size_t> codes) {
  // A few look-ups end as many blocks: they go round at most once.
  round_ = 0;
  while (round_ < kLookUps) round_ += static_cast<std::uint32_t>(codes.size());
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    tables_[i] = kTablesSize * static_cast<std::uint32_t>(codes[i % codes.size()]);
  }
}

BlockWalk BlockWalker::Begin(std::size_t at_bit) const {
  BlockWalk walk;
  walk.at_bit = at_bit;
  walk.table = tables_[0] + kFirst;
  return walk;
}

bool BlockWalker::PassTogether(const End& end, const EntropyData& data, BlockWalk& walk,
                               BlockWalk& beside) const {
  const std::uint32_t* const steps = steps_.data();
  const std::uint32_t* const tables = tables_.data();
  const std::size_t end_bit = std::min(data.size_bit(), end.at_bit);
  const std::size_t beside_end_bit = std::max(data.size_bit(), kBesideEnd_bit) - kBesideEnd_bit;
  // Values, and their addresses handed to nobody, so that the loop keeps them in registers.
  BlockPlace here = walk.place();
  BlockPlace there = beside.place();
  bool good = true;
  bool beside_good = true;
  while (good && beside_good && here.passed() + kLookUps <= end.blocks && here.at_bit < end_bit &&
         there.at_bit < beside_end_bit) {
    Lane one(here, tables, data);
    Lane two(there, tables, data);
    for (int i = 0; i < kLookUps; ++i) {
      one.LookUp<1>(steps, tables, walk.dc.data());
      two.LookUp<0>(steps, tables, nullptr);
    }
    if (one.good()) [[likely]] {
      one.MoveOn(round_, here);
    } else {
      walk.SetPlace(here);
      Lane undone(here, tables, data);
      for (int i = 0; i < kLookUps; ++i) undone.LookUp<-1>(steps, tables, walk.dc.data());
      good = PassSlowly(end.blocks, data, walk);
      here = walk.place();
    }
    if (two.good()) [[likely]] {
      two.MoveOn(round_, there);
    } else {
      beside.SetPlace(there);
      beside_good = PassSlowly(End().blocks, data, beside);
      there = beside.place();
    }
  }
  walk.SetPlace(here);
  beside.SetPlace(there);
  return good;
}

/// Passes a few codes one by one, after look-ups that do not count.
[[gnu::noinline]] bool BlockWalker::PassSlowly(std::size_t blocks, const EntropyData& data,
                                               BlockWalk& walk) const {
  for (int i = 0; i < kLookUps && walk.passed() < blocks; ++i) {
    if (!PassCode(data, walk)) return false;
  }
  return true;
}

bool BlockWalker::PassCode(const EntropyData& data, BlockWalk& walk) const {
  const std::uint32_t tables = tables_[walk.block];
  const std::size_t at_bit = walk.at_bit - (walk.table == tables + kAfterOnes ? kOnes_bit : 0);
  if (at_bit > data.size_bit()) return false;
  const BlockCodes& codes = *codes_[tables / kTablesSize];
  const std::uint64_t bits = data.Look(at_bit);
  if (walk.table == tables + kFirst) {
    const FirstStep dc = codes.Dc(bits);
    if (dc.bits == 0) return false;
    walk.at_bit = at_bit + dc.bits;
    walk.dc[walk.block] += static_cast<std::uint32_t>(dc.difference);
    walk.coefficients = 1;
    walk.table = tables + kWithin;
    return true;
  }
  const AcStep ac = codes.Ac(bits);
  const auto coefficients = walk.coefficients + static_cast<std::uint32_t>(ac.count());
  if (!ac.found() || coefficients > kCoefficients) return false;
  walk.at_bit = at_bit + static_cast<std::size_t>(ac.bits());
  walk.coefficients = coefficients;
  walk.table = tables + kWithin;
  if (ac.ends() || coefficients == kCoefficients) EndBlock(walk);
  return true;
}

void BlockWalker::EndBlock(BlockWalk& walk) const {
  walk.coefficients = 0;
  if (++walk.block == round_) {
    walk.block = 0;
    walk.blocks += round_;
  }
  walk.table = tables_[walk.block] + kFirst;
}

}  // namespace trammel::image
