#include "part_alignment/mesh/vertex_weld.h"

#include <bit>
#include <limits>

namespace trammel::part_alignment {
namespace {

constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

std::uint64_t Mixed(std::uint64_t bits) {
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
  return bits ^ (bits >> 31);
}

std::uint64_t HashOf(const Eigen::Vector3d& at_mm) {
  std::uint64_t hash = 0x9e3779b97f4a7c15U;
  for (const double mm : at_mm) hash = Mixed(hash + std::bit_cast<std::uint64_t>(mm + 0.0));
  return hash;
}

}  // namespace

std::uint32_t VertexWeld::Number(const Eigen::Vector3d& at_mm) {
  if (2 * vertices_mm_.size() >= slots_.size()) Grow();
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = HashOf(at_mm) & mask;
  constexpr int kLongestChain = 2000;  // half full, chance makes none of 100
  for (int probe = 0; probe < kLongestChain && slots_[slot] != kFree; ++probe) {
    if (vertices_mm_[slots_[slot]] == at_mm) return slots_[slot];
    slot = (slot + 1) & mask;
  }
  const auto number = static_cast<std::uint32_t>(vertices_mm_.size());
  vertices_mm_.push_back(at_mm);
  if (slots_[slot] == kFree) slots_[slot] = number;
  return number;
}

void VertexWeld::Grow() {
  constexpr std::size_t kFirst = 1024;
  slots_.assign(slots_.empty() ? kFirst : 2 * slots_.size(), kFree);
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t i = 0; i < vertices_mm_.size(); ++i) {
    std::size_t slot = HashOf(vertices_mm_[i]) & mask;
    constexpr int kLongestChain = 2000;
    for (int probe = 0; probe < kLongestChain && slots_[slot] != kFree; ++probe) {
      slot = (slot + 1) & mask;
    }
    if (slots_[slot] == kFree) slots_[slot] = static_cast<std::uint32_t>(i);
  }
}

}  // namespace trammel::part_alignment
