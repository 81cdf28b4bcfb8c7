#include "sim/klipper/machine_clock.h"

#include <algorithm>

namespace trammel::sim {
namespace {

constexpr std::size_t kMostBends = 100;

}  // namespace

double MachineClock::TimeAt(double host_s) const {
  auto bend = bends_.rbegin();
  while (bend->host_s > host_s && std::next(bend) != bends_.rend()) ++bend;
  return bend->machine_s + (host_s - bend->host_s) * bend->rate;
}

double MachineClock::At(double host_s) {
  const std::lock_guard lock(mutex_);
  latest_s_ = std::max(latest_s_, host_s);
  return TimeAt(host_s);
}

void MachineClock::SetRate(double rate) {
  const std::lock_guard lock(mutex_);
  if (bends_.back().rate == rate) return;
  bends_.push_back({latest_s_, TimeAt(latest_s_), rate});
  if (bends_.size() > kMostBends) bends_.pop_front();
}

}  // namespace trammel::sim
