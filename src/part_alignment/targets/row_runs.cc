#include "part_alignment/targets/row_runs.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace trammel::part_alignment {
namespace {

using Edge = RowMemory::Edge;

/// The steepest places of what changes one way, side by side.
void FindEdges(const std::uint8_t* line, int width, int least, std::vector<Edge>& edges) {
  edges.clear();
  int next = 0;  // column, where the edge would go on
  for (int x = 1; x + 1 < width; ++x) {
    const int step = line[x + 1] - line[x - 1];
    if (std::abs(step) < least) continue;
    if (x != next || (step > 0) != (edges.back().step > 0)) {
      edges.push_back({x, step});
    } else if (std::abs(step) > std::abs(edges.back().step)) {
      edges.back() = {x, step};
    }
    next = x + 1;
  }
}

/// Leaves out edges that both neighbours are much steeper than: dirt, or light that changes within
/// a disc.
void LeaveOutSlight(std::vector<Edge>& edges) {
  constexpr int kMuch = 4;
  if (edges.size() < 3) return;
  std::size_t kept = 1;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const int steep = kMuch * std::abs(edges[i].step);
    const bool is_slight = i + 1 < edges.size() && steep < std::abs(edges[kept - 1].step) &&
                           steep < std::abs(edges[i + 1].step);
    if (!is_slight) edges[kept++] = edges[i];
  }
  edges.resize(kept);
}

}  // namespace

std::span<const Run> RunsOfRow(const PageView& picture, int row, const RunRules& rules,
                               RowMemory& memory) {
  std::vector<Edge>& edges = memory.edges;
  FindEdges(picture.row(row), picture.width, rules.edge_step, edges);
  LeaveOutSlight(edges);
  memory.runs.clear();
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const Edge& first = edges[i - 1];
    const Edge& last = edges[i];
    const int length = last.column - first.column;
    if (length < rules.min_px || length > rules.max_px) continue;
    const int before = first.column - (i > 1 ? edges[i - 2].column : 0);
    const int after = (i + 1 < edges.size() ? edges[i + 1].column : picture.width) - last.column;
    // A disc's gap is half as wide as its chord or more, from wherever it is seen.
    if (20 * std::min(before, after) < 9 * length) continue;
    const bool falls = first.step < 0;
    memory.runs.push_back({row, first.column, last.column, falls});
    if (falls == (last.step < 0)) memory.runs.push_back({row, first.column, last.column, !falls});
  }
  return memory.runs;
}

}  // namespace trammel::part_alignment
