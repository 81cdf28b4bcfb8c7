#include "part_alignment/targets/row_runs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdlib>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace trammel::part_alignment {
namespace {

#ifndef __SSE2__
/// A pixel and those above and below it, (1, 2, 1)/4. `stride` 0: the pixel itself.
std::uint8_t AcrossRows(const std::uint8_t* p, std::ptrdiff_t stride) {
  return static_cast<std::uint8_t>((((p[-stride] + p[stride] + 1) >> 1) + p[0] + 1) >> 1);
}
#endif

/// 16 pixels' neighbours along the row, each across rows.
struct Neighbours {
  alignas(16) std::array<std::uint8_t, 16> before;
  alignas(16) std::array<std::uint8_t, 16> after;
};

#ifdef __SSE2__
/// 16 pixels, each with those above and below it, (1, 2, 1)/4. `stride` 0: the pixels themselves.
__m128i AcrossRows16(const std::uint8_t* p, std::ptrdiff_t stride) {
  const auto load = [](const std::uint8_t* at) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
  };
  if (stride == 0) return load(p);
  return _mm_avg_epu8(_mm_avg_epu8(load(p - stride), load(p + stride)), load(p));
}

/// By how much |after - before| is above `below`, of 16; 0 where it is not.
__m128i ChangeAbove(__m128i before, __m128i after, int below) {
  const __m128i change = _mm_or_si128(_mm_subs_epu8(before, after), _mm_subs_epu8(after, before));
  return _mm_subs_epu8(change, _mm_set1_epi8(static_cast<char>(below)));
}

/// Bit i, of 16: not 0.
unsigned NotZero(__m128i values) {
  const int zero = _mm_movemask_epi8(_mm_cmpeq_epi8(values, _mm_setzero_si128()));
  return ~static_cast<unsigned>(zero) & 0xffffU;
}
#endif

/// Bit i, of 16: |I(i + 1) - I(i - 1)| >= step; where any is, with the two.
unsigned EdgesAt(const std::uint8_t* p, std::ptrdiff_t stride, int step, Neighbours& beside) {
#ifdef __SSE2__
  const __m128i before = AcrossRows16(p - 1, stride);
  const __m128i after = AcrossRows16(p + 1, stride);
  const unsigned edges = NotZero(ChangeAbove(before, after, step - 1));
  if (edges == 0) return 0;
  _mm_store_si128(reinterpret_cast<__m128i*>(beside.before.data()), before);
  _mm_store_si128(reinterpret_cast<__m128i*>(beside.after.data()), after);
  return edges;
#else
  unsigned edges = 0;
  for (int i = 0; i < 16; ++i) {
    beside.before[i] = AcrossRows(p + i - 1, stride);
    beside.after[i] = AcrossRows(p + i + 1, stride);
    edges |= (std::abs(beside.after[i] - beside.before[i]) >= step ? 1U : 0U) << i;
  }
  return edges;
#endif
}

/// Whether there are none among 64 pixels, as in most of a picture.
bool IsPlain(const std::uint8_t* p, std::ptrdiff_t stride, int step) {
#ifdef __SSE2__
  __m128i any = _mm_setzero_si128();
  for (const int i : {0, 16, 32, 48}) {
    const __m128i before = AcrossRows16(p + i - 1, stride);
    const __m128i after = AcrossRows16(p + i + 1, stride);
    any = _mm_or_si128(any, ChangeAbove(before, after, step - 1));
  }
  return NotZero(any) == 0;
#else
  Neighbours beside;
  for (const int i : {0, 16, 32, 48}) {
    if (EdgesAt(p + i, stride, step, beside) != 0) return false;
  }
  return true;
#endif
}

/// The steepest places. None in a picture too narrow for a ring.
void EdgesOfRow(const std::uint8_t* row, std::ptrdiff_t stride, int width, int step,
                std::vector<RowEdge>& edges) {
  edges.clear();
  if (width < 18) return;  // what EdgesAt reads
  RowEdge steepest;        // of the edge being crossed; a step of 0: none
  int latest = 0;          // column
  Neighbours beside;
  constexpr int kScanned = 64;
  int looked = 1;  // up to which column it is known whether there are any
  for (int block = 1; block < width - 1; block += 16) {
    while (block >= looked && block + kScanned < width) {
      looked = block + kScanned;
      if (IsPlain(row + block, stride, step)) block = looked;
    }
    if (block >= width - 1) break;
    // The last block begins early; what it repeats is cut off.
    const int first = std::min(block, width - 17);
    unsigned at = EdgesAt(row + first, stride, step, beside) >> (block - first) << (block - first);
    for (; at != 0; at &= at - 1) {
      const int i = std::countr_zero(at);
      const int x = first + i;
      const int change = beside.after[i] - beside.before[i];
      if (x != latest + 1 || (change > 0) != (steepest.step > 0)) {
        if (steepest.step != 0) edges.push_back(steepest);
        steepest.step = 0;
      }
      latest = x;
      if (std::abs(change) > std::abs(steepest.step)) steepest = {x, change};
    }
  }
  if (steepest.step != 0) edges.push_back(steepest);
}

/// Leaves out edges that both neighbours are much steeper than: dirt, or light that changes within
/// a disc.
void LeaveOutSlight(std::vector<RowEdge>& edges) {
  constexpr int kMuch = 4;
  if (edges.size() < 3) return;
  std::size_t kept = 1;
  for (std::size_t i = 1; i + 1 < edges.size(); ++i) {
    const int beside = std::min(std::abs(edges[kept - 1].step), std::abs(edges[i + 1].step));
    if (kMuch * std::abs(edges[i].step) >= beside) edges[kept++] = edges[i];
  }
  edges[kept++] = edges.back();
  edges.resize(kept);
}

/// Whether both sides differ from the run alike; then with its levels.
bool FindLevels(const std::uint8_t* p, int width, int min_contrast, Run& run) {
  constexpr int kMostUnlike = 4;
  const int aside = 2 + (run.last - run.first) / 6;
  if (run.first < aside || run.last + aside >= width) return false;
  const int middle = (run.first + run.last) / 2;
  run.inside = (p[middle - 1] + p[middle] + p[middle + 1]) / 3;
  const int left = p[run.first - aside] - run.inside;
  const int right = p[run.last + aside] - run.inside;
  if ((left > 0) != (right > 0)) return false;
  const int less = std::min(std::abs(left), std::abs(right));
  const int more = std::max(std::abs(left), std::abs(right));
  if (less < min_contrast / 2 || kMostUnlike * less < more) return false;
  run.outside = run.inside + (left + right) / 2;
  run.nearer = run.inside + (left > 0 ? less : -less);
  run.dark = left > 0;
  return true;
}

}  // namespace

void RunsOfRow(const PageView& picture, int row, const RunRules& rules, std::vector<RowEdge>& edges,
               std::vector<Run>& runs) {
  constexpr int kLeastApart_px = 6;  // shorter runs lie about everywhere in noise
  runs.clear();
  const std::uint8_t* p = picture.row(row);
  const bool blended = rules.across_rows && row > 0 && row < picture.height - 1;
  EdgesOfRow(p, blended ? picture.stride : 0, picture.width, rules.edge_step, edges);
  LeaveOutSlight(edges);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const int first = edges[i - 1].column;
    const int last = edges[i].column;
    const int length = last - first;
    if (length < rules.min_px || length > rules.max_px) continue;
    const bool falls = edges[i - 1].step < 0;
    const bool rises = edges[i].step > 0;
    const int before = first - (i > 1 ? edges[i - 2].column : 0);
    const int after = (i + 1 < edges.size() ? edges[i + 1].column : picture.width) - last;
    // A disc's gap is half as wide as its chord or more, from wherever it is seen.
    const bool apart = length >= kLeastApart_px && 20 * std::min(before, after) >= 9 * length;
    if (!apart && falls != rises) continue;
    Run run;
    run.row = row;
    run.first = first;
    run.last = last;
    run.dark = falls;
    run.apart = apart;
    run.even = falls == rises && FindLevels(p, picture.width, rules.min_contrast, run);
    if (run.even || run.apart) runs.push_back(run);
    if (run.apart && falls != rises) {  // darker than one side, brighter than the other
      run.dark = !run.dark;
      runs.push_back(run);
    }
  }
}

}  // namespace trammel::part_alignment
