#include "part_alignment/targets/row_runs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdlib>

#include "part_alignment/targets/four.h"
#include "part_alignment/targets/quieten.h"

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace trammel::part_alignment {
namespace {

constexpr int kScanned = 64;  ///< pixels at a time

/// Places in a row where the shade changes the most.
struct RowEdges {
  int* columns;
  int* steps;  ///< I(x + 1) - I(x - 1), grey levels
};

/// Bit i, of 64: |I(i + 1) - I(i - 1)| >= step.
std::uint64_t EdgesAt(const std::uint8_t* p, int step) {
  std::uint64_t edges = 0;
#ifdef __SSE2__
  const auto load = [](const std::uint8_t* at) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
  };
  const __m128i below = _mm_set1_epi8(static_cast<char>(step - 1));
  const __m128i none = _mm_setzero_si128();
  constexpr int kBlocks = kScanned / 16;
  __m128i changes[kBlocks];
  __m128i most = none;
  for (int i = 0; i < kBlocks; ++i) {
    const __m128i before = load(p + 16 * i - 1);
    const __m128i after = load(p + 16 * i + 1);
    changes[i] = _mm_or_si128(_mm_subs_epu8(before, after), _mm_subs_epu8(after, before));
    most = _mm_max_epu8(most, changes[i]);
  }
  const auto not_above = [&](__m128i change) {
    return static_cast<unsigned>(
        _mm_movemask_epi8(_mm_cmpeq_epi8(_mm_subs_epu8(change, below), none)));
  };
  constexpr unsigned kAll = 0xffff;
  if (not_above(most) == kAll) return 0;  // as in most of a picture
  for (int i = 0; i < kBlocks; ++i) {
    edges |= std::uint64_t{not_above(changes[i]) ^ kAll} << 16 * i;
  }
#else
  for (int i = 0; i < kScanned; ++i) {
    edges |= std::uint64_t{std::abs(p[i + 1] - p[i - 1]) >= step} << i;
  }
#endif
  return edges;
}

#ifdef __x86_64__
/// The same, by instructions that take 32 pixels.
[[gnu::target("avx2")]] inline std::uint64_t EdgesAtByAvx2(const std::uint8_t* p, int step) {
  const auto changes_at = [p](int i) __attribute__((target("avx2"))) {
    const __m256i before = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p + i - 1));
    const __m256i after = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p + i + 1));
    return _mm256_sub_epi8(_mm256_max_epu8(before, after), _mm256_min_epu8(before, after));
  };
  const __m256i least = _mm256_set1_epi8(static_cast<char>(step));
  const auto edges_of = [least](__m256i changes) __attribute__((target("avx2"))) {
    return static_cast<std::uint32_t>(
        _mm256_movemask_epi8(_mm256_cmpeq_epi8(_mm256_max_epu8(changes, least), changes)));
  };
  return edges_of(changes_at(0)) | std::uint64_t{edges_of(changes_at(32))} << 32;
}
#endif

/// The row as edges are looked for in it, and as many pixels more as are scanned at a time.
const std::uint8_t* LineOf(const PageView& picture, int row, bool across_rows,
                           std::vector<std::uint8_t>& line) {
  line.resize(static_cast<std::size_t>(picture.width) + kScanned);
  const std::uint8_t* p = picture.row(row);
  if (across_rows && row > 0 && row < picture.height - 1) {
    Blend(p - picture.stride, p, p + picture.stride, picture.width, line.data());
  } else {
    std::copy_n(p, picture.width, line.data());
  }
  return line.data();
}

/// The steepest places of what changes one way, side by side. None in a picture too narrow for a
/// ring.
/// @param edges  room for as many as pixels. Returns how many there are.
template <std::uint64_t (*kEdgesAt)(const std::uint8_t*, int)>
[[gnu::always_inline]] inline std::size_t FindEdges(const std::uint8_t* line, int width, int step,
                                                    const RowEdges& edges) {
  constexpr int kNarrowest_px = 18;
  if (width < kNarrowest_px) return 0;
  std::ptrdiff_t latest = -1;
  int column = 0;  // of the edge being crossed
  int steepest = 0;
  int size = 0;  // of the steepest step
  int next = 0;  // column, where the edge would go on
  for (int first = 1; first < width - 1; first += kScanned) {
    std::uint64_t at = kEdgesAt(line + first, step);
    if (const int left = width - 1 - first; left < kScanned) at &= (std::uint64_t{1} << left) - 1;
    for (; at != 0; at &= at - 1) {
      const int x = first + std::countr_zero(at);
      const int change = line[x + 1] - line[x - 1];
      // Pixels come in no order that a processor could guess: nothing here depends on a branch.
      const bool begins = (x != next) | ((change ^ steepest) < 0);
      const bool steeper = begins | (std::abs(change) > size);
      const int taken = -static_cast<int>(steeper);
      column ^= (column ^ x) & taken;
      steepest ^= (steepest ^ change) & taken;
      size = std::abs(steepest);
      latest += begins ? 1 : 0;
      edges.columns[latest] = column;
      edges.steps[latest] = steepest;
      next = x + 1;
    }
  }
  return static_cast<std::size_t>(latest + 1);
}

#ifdef __x86_64__
[[gnu::target("avx2")]] std::size_t FindEdgesByAvx2(const std::uint8_t* line, int width, int step,
                                                    const RowEdges& edges) {
  return FindEdges<EdgesAtByAvx2>(line, width, step, edges);
}
#endif

std::size_t EdgesOfLine(const std::uint8_t* line, int width, int step, const RowEdges& edges) {
#ifdef __x86_64__
  if (TakesAvx2()) return FindEdgesByAvx2(line, width, step, edges);
#endif
  return FindEdges<EdgesAt>(line, width, step, edges);
}

/// Leaves out edges that both neighbours are much steeper than: dirt, or light that changes within
/// a disc. Returns how many are left.
[[gnu::always_inline]] inline std::size_t LeaveOutSlight(const RowEdges& edges, std::size_t count) {
  constexpr int kMuch = 4;
  if (count < 3) return count;
  std::size_t kept = 1;
  int before = std::abs(edges.steps[0]);
  int steep = std::abs(edges.steps[1]);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const int after = std::abs(edges.steps[i + 1]);
    edges.columns[kept] = edges.columns[i];
    edges.steps[kept] = edges.steps[i];
    const bool stays = (kMuch * steep >= before) | (kMuch * steep >= after);
    kept += stays ? 1 : 0;
    before ^= (before ^ steep) & -static_cast<int>(stays);  // no branch
    steep = after;
  }
  edges.columns[kept] = edges.columns[count - 1];
  edges.steps[kept] = edges.steps[count - 1];
  return kept + 1;
}

// Of a stretch between an edge and the next.
constexpr std::uint8_t kMayBeRun = 1;
constexpr std::uint8_t kApart = 2;   ///< as of a run
constexpr std::uint8_t kOneWay = 4;  ///< at both edges the shade changes the same way
constexpr std::uint8_t kFalls = 8;   ///< at its first edge the shade becomes darker

/// What the stretches before edge 1, 2 … are, by their length and how far off the edges beside them
/// are.
/// @param edges  with one more before and after them, at the ends of the row.
[[gnu::always_inline]] inline void JudgeStretches(const RowEdges& edges, std::size_t count,
                                                  const RunRules& rules, std::uint8_t* kinds) {
  constexpr int kLeastApart_px = 6;  // shorter runs lie about everywhere in noise
  const int* columns = edges.columns;
  const int* steps = edges.steps;
  const auto end = static_cast<std::ptrdiff_t>(count);
  for (std::ptrdiff_t i = 1; i < end; ++i) {
    const int length = columns[i] - columns[i - 1];
    const int before = columns[i - 1] - columns[i - 2];
    const int after = columns[i + 1] - columns[i];
    // A disc's gap is half as wide as its chord or more, from wherever it is seen.
    const int apart = (length >= kLeastApart_px) & (20 * std::min(before, after) >= 9 * length);
    const int one_way = (steps[i - 1] ^ steps[i]) >= 0;
    const int fits = (length >= rules.min_px) & (length <= rules.max_px);
    const int falls = steps[i - 1] < 0;
    kinds[i] = static_cast<std::uint8_t>((fits & (apart | (1 - one_way))) | apart * kApart |
                                         one_way * kOneWay | falls * kFalls);
  }
}

/// The stretch between two edges, with the levels beside it and within, of a row of so many pixels.
[[gnu::always_inline]] inline Run RunBetween(int first, int last, std::uint8_t kind,
                                             const std::uint8_t* p, int width, int min_contrast) {
  constexpr int kMostUnlike = 4;
  Run run;
  run.first = first;
  run.last = last;
  run.apart = (kind & kApart) != 0;
  const int aside = 2 + static_cast<int>(static_cast<unsigned>(last - first) / 6);
  const int before = first - aside;
  const int after = last + aside;
  const std::uint8_t* middle = p + static_cast<unsigned>(first + last) / 2;
  const int inside =
      static_cast<int>(static_cast<unsigned>(middle[-1] + middle[0] + middle[1]) / 3);
  const int left = p[std::max(before, 0)] - inside;
  const int right = p[std::min(after, width - 1)] - inside;
  const int less = std::min(std::abs(left), std::abs(right));
  const int more = std::max(std::abs(left), std::abs(right));
  const bool brighter = left > 0;  // beside the run
  run.even = ((kind & kOneWay) == 0) & (before >= 0) & (after < width) & (brighter == (right > 0)) &
             (less >= min_contrast / 2) & (kMostUnlike * less >= more);
  run.dark = (run.even & brighter) | (!run.even & ((kind & kFalls) != 0));
  run.inside = inside;
  run.outside = inside + (left + right) / 2;
  run.nearer = inside + (brighter ? less : -less);
  return run;
}

/// The runs between a row's edges.
/// @param edges  with room for one more before and after them.
[[gnu::always_inline]] inline std::span<const Run> RunsBetween(const RowEdges& edges,
                                                               std::size_t count,
                                                               const PageView& picture, int row,
                                                               const RunRules& rules,
                                                               RowMemory& memory) {
  count = LeaveOutSlight(edges, count);
  const int width = picture.width;
  edges.columns[-1] = 0;
  edges.columns[count] = width;
  std::uint8_t* kinds = memory.kinds.data();
  JudgeStretches(edges, count, rules, kinds);
  // Which of them may be runs cannot be guessed: they are gathered before they are looked at.
  std::size_t chosen = 0;
  for (std::size_t i = 1; i < count; ++i) {
    memory.chosen[chosen] = static_cast<int>(i);
    chosen += kinds[i] & kMayBeRun;
  }
  const std::uint8_t* p = picture.row(row);
  Run* end = memory.runs.data();
  for (std::size_t i = 0; i < chosen; ++i) {
    const int last = memory.chosen[i];
    *end = RunBetween(edges.columns[last - 1], edges.columns[last], kinds[last], p, width,
                      rules.min_contrast);
    end->row = row;
    end += (end->even | end->apart) ? 1 : 0;
    if ((kinds[last] & (kApart | kOneWay)) == (kApart | kOneWay)) {
      // Darker than one side, brighter than the other.
      *end = end[-1];
      end->dark = !end->dark;
      ++end;
    }
  }
  return {memory.runs.data(), end};
}

#ifdef __x86_64__
/// The same.
[[gnu::target("avx2")]] std::span<const Run> RunsBetweenByAvx2(const RowEdges& edges,
                                                               std::size_t count,
                                                               const PageView& picture, int row,
                                                               const RunRules& rules,
                                                               RowMemory& memory) {
  return RunsBetween(edges, count, picture, row, rules, memory);
}
#endif

}  // namespace

std::span<const Run> RunsOfRow(const PageView& picture, int row, const RunRules& rules,
                               RowMemory& memory) {
  const int width = picture.width;
  const auto most = static_cast<std::size_t>(width) + 2;
  if (memory.columns.size() < most) {
    memory.columns.resize(most);
    memory.steps.resize(most);
    memory.kinds.resize(most);
    memory.chosen.resize(most);
    memory.runs.resize(2 * most);
  }
  const RowEdges edges{memory.columns.data() + 1, memory.steps.data() + 1};
  const std::uint8_t* line = LineOf(picture, row, rules.across_rows, memory.line);
  const std::size_t count = EdgesOfLine(line, width, rules.edge_step, edges);
#ifdef __x86_64__
  if (TakesAvx2()) return RunsBetweenByAvx2(edges, count, picture, row, rules, memory);
#endif
  return RunsBetween(edges, count, picture, row, rules, memory);
}

}  // namespace trammel::part_alignment
