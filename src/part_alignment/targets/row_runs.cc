#include "part_alignment/targets/row_runs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdlib>

#include "part_alignment/targets/quieten.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace trammel::part_alignment {
namespace {

constexpr int kScanned = 64;  ///< pixels at a time

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
/// @param edges  at least as many as pixels. Returns how many there are.
std::size_t EdgesOfLine(const std::uint8_t* line, int width, int step, RowEdge* edges) {
  constexpr int kNarrowest_px = 18;
  if (width < kNarrowest_px) return 0;
  std::size_t count = 0;
  RowEdge steepest;  // of the edge being crossed
  int latest = -1;   // column
  for (int first = 1; first < width - 1; first += kScanned) {
    std::uint64_t at = EdgesAt(line + first, step);
    if (const int left = width - 1 - first; left < kScanned) at &= (std::uint64_t{1} << left) - 1;
    for (; at != 0; at &= at - 1) {
      const int x = first + std::countr_zero(at);
      const int change = line[x + 1] - line[x - 1];
      // Pixels come in no order that a processor could guess: nothing here depends on a branch.
      const bool begins = (x != latest + 1) | ((change ^ steepest.step) < 0);
      const bool steeper = begins | (std::abs(change) > std::abs(steepest.step));
      steepest = steeper ? RowEdge{x, change} : steepest;
      count += begins ? 1 : 0;
      edges[count - 1] = steepest;
      latest = x;
    }
  }
  return count;
}

/// Leaves out edges that both neighbours are much steeper than: dirt, or light that changes within
/// a disc. Returns how many are left.
std::size_t LeaveOutSlight(RowEdge* edges, std::size_t count) {
  constexpr int kMuch = 4;
  if (count < 3) return count;
  std::size_t kept = 1;
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const int beside = std::min(std::abs(edges[kept - 1].step), std::abs(edges[i + 1].step));
    edges[kept] = edges[i];
    kept += kMuch * std::abs(edges[i].step) >= beside ? 1 : 0;
  }
  edges[kept++] = edges[count - 1];
  return kept;
}

/// Whether both sides differ from the run alike; then with its levels.
bool FindLevels(const std::uint8_t* p, int width, int min_contrast, Run& run) {
  constexpr int kMostUnlike = 4;
  const int aside = 2 + (run.last - run.first) / 6;
  if (run.first < aside || run.last + aside >= width) return false;
  const int middle = (run.first + run.last) / 2;
  const int inside = (p[middle - 1] + p[middle] + p[middle + 1]) / 3;
  const int left = p[run.first - aside] - inside;
  const int right = p[run.last + aside] - inside;
  const int less = std::min(std::abs(left), std::abs(right));
  const int more = std::max(std::abs(left), std::abs(right));
  const bool even =
      ((left > 0) == (right > 0)) & (less >= min_contrast / 2) & (kMostUnlike * less >= more);
  if (!even) return false;
  run.inside = inside;
  run.outside = inside + (left + right) / 2;
  run.nearer = inside + (left > 0 ? less : -less);
  run.dark = left > 0;
  return true;
}

}  // namespace

void RunsOfRow(const PageView& picture, int row, const RunRules& rules, RowMemory& memory,
               std::vector<Run>& runs) {
  constexpr int kLeastApart_px = 6;  // shorter runs lie about everywhere in noise
  runs.clear();
  const std::uint8_t* p = picture.row(row);
  const int width = picture.width;
  if (memory.edges.size() < static_cast<std::size_t>(width)) memory.edges.resize(width);
  RowEdge* edges = memory.edges.data();
  const std::size_t count =
      LeaveOutSlight(edges, EdgesOfLine(LineOf(picture, row, rules.across_rows, memory.line), width,
                                        rules.edge_step, edges));
  const auto range = static_cast<unsigned>(rules.max_px - rules.min_px);
  for (std::size_t i = 1; i < count; ++i) {
    const int first = edges[i - 1].column;
    const int last = edges[i].column;
    const int length = last - first;
    const bool falls = edges[i - 1].step < 0;
    const bool rises = edges[i].step > 0;
    const int before = first - (i > 1 ? edges[i - 2].column : 0);
    const int after = (i + 1 < count ? edges[i + 1].column : width) - last;
    // A disc's gap is half as wide as its chord or more, from wherever it is seen.
    const bool apart = (length >= kLeastApart_px) & (20 * std::min(before, after) >= 9 * length);
    const bool one_way = falls != rises;
    const bool fits = static_cast<unsigned>(length - rules.min_px) <= range;
    if (!(fits & (apart | !one_way))) continue;
    Run run;
    run.row = row;
    run.first = first;
    run.last = last;
    run.dark = falls;
    run.apart = apart;
    run.even = !one_way && FindLevels(p, width, rules.min_contrast, run);
    if (run.even || run.apart) runs.push_back(run);
    if (run.apart && one_way) {  // darker than one side, brighter than the other
      run.dark = !run.dark;
      runs.push_back(run);
    }
  }
}

}  // namespace trammel::part_alignment
