// Allocates pieces of the caller's memory: a tap's analysis allocates nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>

namespace trammel::tap {

/// Bump allocator. Pieces are valid until the Workspace, or a Scope around them, ends.
class Workspace {
 public:
  explicit Workspace(std::span<std::byte> memory) : memory_(memory) {}

  /// @returns `count` values that are not initialised, or an empty span where they do not fit.
  template <class T>
  [[nodiscard]] std::span<T> Take(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    const auto address = reinterpret_cast<std::uintptr_t>(memory_.data()) + used_;
    const std::size_t pad = (kAlignment - address % kAlignment) % kAlignment;
    if (memory_.size() - used_ < pad || count > (memory_.size() - used_ - pad) / sizeof(T)) {
      return {};
    }
    T* first = reinterpret_cast<T*>(memory_.data() + used_ + pad);
    std::uninitialized_default_construct_n(first, count);
    used_ += pad + count * sizeof(T);
    return {first, count};
  }

  /// Returns the number of free bytes.
  [[nodiscard]] std::size_t Left() const { return memory_.size() - used_; }

  /// Releases at its end all that was allocated during its life.
  class Scope {
   public:
    explicit Scope(Workspace& workspace) : workspace_(workspace), used_(workspace.used_) {}
    ~Scope() { workspace_.used_ = used_; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Workspace& workspace_;
    std::size_t used_;
  };

 private:
  static constexpr std::size_t kAlignment = 32;  // for AVX's widest vectors

  std::span<std::byte> memory_;
  std::size_t used_ = 0;
};

}  // namespace trammel::tap
