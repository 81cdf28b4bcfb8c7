#include "part_alignment/targets/row_runs.h"

#include <algorithm>
#include <bit>
#include <cmath>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace trammel::part_alignment {
namespace {

/// Bit i, of 16: |p[i + 1] - p[i - 1]| >= step.
unsigned EdgesAt(const std::uint8_t* p, int step) {
#ifdef __SSE2__
  const __m128i before = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p - 1));
  const __m128i after = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p + 1));
  const __m128i change = _mm_or_si128(_mm_subs_epu8(before, after), _mm_subs_epu8(after, before));
  const __m128i over = _mm_subs_epu8(change, _mm_set1_epi8(static_cast<char>(step - 1)));
  const int below = _mm_movemask_epi8(_mm_cmpeq_epi8(over, _mm_setzero_si128()));
  return ~static_cast<unsigned>(below) & 0xffffU;
#else
  unsigned edges = 0;
  for (int i = 0; i < 16; ++i) edges |= (std::abs(p[i + 1] - p[i - 1]) >= step ? 1U : 0U) << i;
  return edges;
#endif
}

/// Columns of the steepest places, as 2 * column + (rising ? 1 : 0). None in a picture too narrow
/// for a ring.
void EdgesOfRow(const std::uint8_t* row, int width, int step, std::vector<std::int32_t>& edges) {
  edges.clear();
  if (width < 18) return;  // what EdgesAt reads
  int steepest = 0;        // of the edge being crossed, signed; 0: none
  int place = 0;
  int latest = 0;  // column
  const auto finish = [&] {
    if (steepest != 0) edges.push_back(2 * place + (steepest > 0 ? 1 : 0));
  };
  for (int block = 1; block < width - 1; block += 16) {
    // The last block begins early; what it repeats is cut off.
    const int first = std::min(block, width - 17);
    unsigned at = EdgesAt(row + first, step) >> (block - first) << (block - first);
    for (; at != 0; at &= at - 1) {
      const int x = first + std::countr_zero(at);
      const int change = row[x + 1] - row[x - 1];
      if (x != latest + 1 || (change > 0) != (steepest > 0)) {
        finish();
        steepest = 0;
      }
      latest = x;
      if (std::abs(change) > std::abs(steepest)) {
        steepest = change;
        place = x;
      }
    }
  }
  finish();
}

}  // namespace

void RunsOfRow(const PageView& picture, int row, const RunRules& rules,
               std::vector<std::int32_t>& edges, std::vector<Run>& runs) {
  runs.clear();
  const std::uint8_t* p = picture.row(row);
  EdgesOfRow(p, picture.width, rules.edge_step, edges);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    if (((edges[i] ^ edges[i - 1]) & 1) == 0) continue;
    Run run;
    run.row = row;
    run.first = edges[i - 1] / 2;
    run.last = edges[i] / 2;
    const int length = run.last - run.first;
    if (length < rules.min_px || length > rules.max_px) continue;
    const int aside = 2 + length / 6;
    if (run.first < aside || run.last + aside >= picture.width) continue;
    const int middle = (run.first + run.last) / 2;
    run.inside = (p[middle - 1] + p[middle] + p[middle + 1]) / 3;
    const int left = p[run.first - aside] - run.inside;
    const int right = p[run.last + aside] - run.inside;
    if ((left > 0) != (right > 0)) continue;
    const int less = std::min(std::abs(left), std::abs(right));
    if (less < rules.min_contrast / 2 || 4 * less < std::max(std::abs(left), std::abs(right))) {
      continue;
    }
    run.outside = run.inside + (left + right) / 2;
    run.nearer = run.inside + (left > 0 ? less : -less);
    runs.push_back(run);
  }
}

}  // namespace trammel::part_alignment
