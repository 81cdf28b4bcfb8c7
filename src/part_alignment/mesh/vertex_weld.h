// Equal corners of triangles made one vertex.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace trammel::part_alignment {

/// Numbers places in the order in which they first come; equal ones (to the last bit, -0 as 0) get
/// one number. Time is bounded for any input: where hashes collide more often than chance has it,
/// equal places may get numbers of their own.
class VertexWeld {
 public:
  [[nodiscard]] std::uint32_t Number(const Eigen::Vector3d& at_mm);
  [[nodiscard]] std::size_t size() const { return vertices_mm_.size(); }
  [[nodiscard]] std::vector<Eigen::Vector3d> Take() { return std::move(vertices_mm_); }

 private:
  void Grow();

  std::vector<Eigen::Vector3d> vertices_mm_;
  std::vector<std::uint32_t> slots_;  // a power of two of them
};

}  // namespace trammel::part_alignment
