#include "machine/camera/wall_stamps.h"

#include <cmath>

namespace trammel::machine {
namespace {

// A scheduler may come between the two readings; a clock that is being steered runs off by at most
// 500 ppm (adjtimex), by twice that against another one that is.
constexpr double kApart_s = 0.005;
constexpr double kSteered = 1e-3;
// More than the frames that wait in a queue take to be fetched.
constexpr double kDoubtful_s = 2;

}  // namespace

std::optional<double> WallStamps::OnHostClock(double wall_s, double wall_now_s, double host_now_s) {
  const double offset_s = wall_now_s - host_now_s;
  const double allowed_s = kApart_s + kSteered * (host_now_s - compared_s_);
  if (offset_s_ && std::abs(offset_s - *offset_s_) > allowed_s) set_s_ = host_now_s;
  offset_s_ = offset_s;
  compared_s_ = host_now_s;
  if (set_s_ && host_now_s - *set_s_ < kDoubtful_s) return std::nullopt;
  if (!(wall_s > 0) || wall_s > wall_now_s) return std::nullopt;
  return wall_s - offset_s;
}

}  // namespace trammel::machine
