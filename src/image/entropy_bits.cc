#include "image/entropy_bits.h"

namespace trammel::image {

// Where a marker is near. Not inlined: the loops that read bits are kept short.
[[gnu::noinline]] void EntropyBits::FillByByte(EntropyBits& bits) {
  while (bits.left_ < 56) {
    std::uint64_t byte = 0;
    if (bits.at_ == bits.end_) {
      bits.made_up_ += 8;
    } else if (*bits.at_ != 0xFF) {
      byte = *bits.at_++;
    } else if (bits.end_ - bits.at_ >= 2 && bits.at_[1] == 0) {
      byte = 0xFF;
      bits.at_ += 2;
    } else {  // a marker
      bits.made_up_ += 8;
    }
    bits.bits_ |= byte << (56 - bits.left_);
    bits.left_ += 8;
  }
}

}  // namespace trammel::image
