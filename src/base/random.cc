#include "base/random.h"

#include <bit>
#include <cmath>

#include "base/check.h"

namespace trammel {
namespace {

std::uint64_t SplitMix64(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

Random::Random(std::uint64_t seed) {
  for (std::uint64_t& word : state_) word = SplitMix64(seed);
}

std::uint64_t Random::Bits() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Random::Uniform() { return static_cast<double>(Bits() >> 11) * 0x1.0p-53; }

double Random::Uniform(double lo, double hi) { return lo + (hi - lo) * Uniform(); }

double Random::Normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  double u = 0;
  double v = 0;
  double s = 0;
  do {
    u = Uniform(-1, 1);
    v = Uniform(-1, 1);
    s = u * u + v * v;
  } while (s >= 1 || s == 0);
  const double scale = std::sqrt(-2 * std::log(s) / s);
  spare_ = v * scale;
  has_spare_ = true;
  return u * scale;
}

double Random::Normal(double mean, double standard_deviation) {
  return mean + standard_deviation * Normal();
}

std::uint64_t Random::Below(std::uint64_t n) {
  TRAMMEL_CHECK(n > 0, "n = {}", n);
  const std::uint64_t reject_below = (0 - n) % n;  // 2^64 mod n: keeps every residue equally likely
  std::uint64_t bits = Bits();
  while (bits < reject_below) bits = Bits();
  return bits % n;
}

Random Random::Fork(std::uint64_t stream) const {
  std::uint64_t seed = state_[0] ^ std::rotl(state_[2], 17) ^ (stream * 0xd1342543de82ef95ULL);
  return Random(SplitMix64(seed));
}

}  // namespace trammel
