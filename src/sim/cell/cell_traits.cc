#include "sim/cell/cell_traits.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/check.h"

namespace trammel::sim {

namespace {

// Force over k D and its slope, at a depth in units of D that is at most 1.
struct Relative {
  double force = 0;
  double slope = 0;
};

Relative At(const ContactStiffness& law, double x) {
  const double a = law.share;
  switch (law.kind) {
    case ContactKind::kLinear:
      break;
    case ContactKind::kQuadratic:
      return {x * (1 + a * x), 1 + 2 * a * x};
    case ContactKind::kCubic:
      return {x * (1 + a * x * x), 1 + 3 * a * x * x};
    case ContactKind::kPower:
      return {std::pow(x, law.exponent), law.exponent * std::pow(x, law.exponent - 1)};
    case ContactKind::kTwoSlope:
      return x < law.knee ? Relative{x, 1} : Relative{x + a * (x - law.knee), 1 + a};
    case ContactKind::kYielding:
      return {law.knee * (1 - std::exp(-x / law.knee)), std::exp(-x / law.knee)};
  }
  return {x, 1};
}

double BedForce(const ContactStiffness& law, double depth_mm) {
  if (depth_mm <= 0) return 0;
  const double x = depth_mm / law.reference_mm;
  const Relative at = At(law, std::min(x, 1.0));
  const double beyond = std::max(0.0, x - 1);
  return law.stiffness_g_mm * law.reference_mm * (at.force + at.slope * beyond);
}

// Solves d = x + (1 - s) T (1 - exp(-x / (s T))) for x by Newton's method, which from 0 converges
// monotonically, as the right side is concave.
double BehindExponentialToe(const ContactStiffness& law, double depth_mm) {
  constexpr double kToMm = 1e-12;
  constexpr int kMaxSteps = 100;
  const double film_mm = (1 - law.toe_share) * law.toe_mm;
  const double packed_mm = law.toe_share * law.toe_mm;
  double x_mm = 0;
  for (int i = 0; i < kMaxSteps; ++i) {
    const double left = std::exp(-x_mm / packed_mm);
    const double step_mm =
        (depth_mm - x_mm - film_mm * (1 - left)) / (1 + film_mm / packed_mm * left);
    x_mm += step_mm;
    if (!(step_mm > kToMm)) break;
  }
  return x_mm;
}

// Returns the law's depth behind the toe: the integral of the effective share of its stiffness.
double BehindToe(const ContactStiffness& law, double depth_mm) {
  if (law.toe_kind == ToeKind::kExponential && law.toe_mm > 0) {
    return BehindExponentialToe(law, depth_mm);
  }
  const double from_mm = law.toe_mm * (1 - law.toe_rounding);
  const double to_mm = law.toe_mm * (1 + law.toe_rounding);
  double soft_mm = std::min(depth_mm, law.toe_mm);
  if (depth_mm > from_mm && depth_mm < to_mm) {
    const double into_mm = depth_mm - from_mm;
    soft_mm = from_mm + into_mm - into_mm * into_mm / (2 * (to_mm - from_mm));
  }
  return depth_mm - (1 - law.toe_share) * soft_mm;
}

}  // namespace

double ContactForce(const ContactStiffness& law, double depth_mm) {
  if (depth_mm <= 0) return 0;
  depth_mm = BehindToe(law, depth_mm);
  const double sheet_mm = std::min(depth_mm, law.sheet_gap_mm);
  return law.sheet_stiffness_g_mm * sheet_mm + BedForce(law, depth_mm - law.sheet_gap_mm);
}

double ContactDepth(const ContactStiffness& law, double force_g) {
  if (!(force_g > 0)) return 0;
  constexpr double kDeepestMm = 1e6;
  constexpr double kToMm = 1e-9;
  double lo = 0;
  double hi = law.reference_mm;
  while (ContactForce(law, hi) < force_g && hi < kDeepestMm) hi *= 2;
  while (hi - lo > kToMm) {
    const double middle = 0.5 * (lo + hi);
    (ContactForce(law, middle) < force_g ? lo : hi) = middle;
  }
  return 0.5 * (lo + hi);
}

namespace {

// Appends a start, a cruise and, unless the move is cut short, an end, over a distance.
void AppendTrapezoid(std::vector<ZMove>& moves, double time_s, double z_mm, double direction,
                     double distance_mm, double speed_mm_s, double acceleration_mm_s2,
                     bool has_end) {
  const double ramps = has_end ? 2 : 1;
  const double reached_mm_s =
      std::min(speed_mm_s, std::sqrt(2 * acceleration_mm_s2 * distance_mm / ramps));
  const double ramp_s = reached_mm_s / acceleration_mm_s2;
  const double ramp_mm = 0.5 * reached_mm_s * ramp_s;
  const double cruise_s = std::max(0.0, distance_mm - ramps * ramp_mm) / reached_mm_s;
  moves.push_back({time_s, ramp_s, 0, acceleration_mm_s2, z_mm, direction});
  time_s += ramp_s;
  z_mm += direction * ramp_mm;
  if (cruise_s > 0) moves.push_back({time_s, cruise_s, reached_mm_s, 0, z_mm, direction});
  time_s += cruise_s;
  z_mm += direction * reached_mm_s * cruise_s;
  if (has_end) {
    moves.push_back({time_s, ramp_s, reached_mm_s, -acceleration_mm_s2, z_mm, direction});
  }
}

}  // namespace

std::vector<ZMove> ApproachMoves(const TapMotion& motion, double start_time_s, double start_z_mm,
                                 double halt_z_mm) {
  TRAMMEL_CHECK(start_z_mm > halt_z_mm, "start_z_mm = {}, halt_z_mm = {}", start_z_mm, halt_z_mm);
  std::vector<ZMove> moves;
  AppendTrapezoid(moves, start_time_s, start_z_mm, -1, start_z_mm - halt_z_mm,
                  motion.approach_speed_mm_s, motion.acceleration_mm_s2, false);
  return moves;
}

std::vector<ZMove> PullBackMoves(const TapMotion& motion, double stop_time_s, double halt_z_mm) {
  const double told_s = stop_time_s + motion.told_after_s;
  std::vector<ZMove> moves = {{told_s, 0, 0, 0, halt_z_mm, 0}};
  AppendTrapezoid(moves, told_s + motion.pause_s, halt_z_mm, 1, motion.pull_back_mm,
                  motion.pull_back_speed_mm_s, motion.acceleration_mm_s2, true);
  return moves;
}

ZState StateAt(std::span<const ZMove> moves, double time_s) {
  TRAMMEL_CHECK(!moves.empty(), "moves = 0");
  const auto after =
      std::upper_bound(moves.begin(), moves.end(), time_s,
                       [](double t, const ZMove& move) { return t < move.start_time_s; });
  if (after == moves.begin()) return {moves.front().start_z_mm, 0};
  const ZMove& move = *std::prev(after);
  const double dt = std::min(time_s - move.start_time_s, move.duration_s);
  const double speed = move.start_velocity_mm_s + move.acceleration_mm_s2 * dt;
  const bool moving = time_s - move.start_time_s < move.duration_s;
  return {move.start_z_mm + move.z_direction * dt *
                                (move.start_velocity_mm_s + 0.5 * move.acceleration_mm_s2 * dt),
          moving ? move.z_direction * speed : 0};
}

namespace {

CellTraits With(void (*change)(CellTraits&)) {
  CellTraits traits;
  change(traits);
  return traits;
}

// Laws have 3500 gf/mm x 45 um at 45 um, apart from the share that names them.
const std::map<std::string, CellTraits, std::less<>>& Named() {
  static const std::map<std::string, CellTraits, std::less<>> named = {
      {"reference", CellTraits{}},
      {"stiffening", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kQuadratic;
         t.press.law.share = 0.5;
       })},
      {"softening", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kQuadratic;
         t.press.law.share = -0.3;
       })},
      {"power-1.25", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kPower;
         t.press.law.exponent = 1.25;
       })},
      {"hertz", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kPower;
         t.press.law.exponent = 1.5;
       })},
      {"cubic", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kCubic;
         t.press.law.share = 0.5;
       })},
      {"noisy", With([](CellTraits& t) { t.disturbance.noise_g = 8; })},
      {"drifting", With([](CellTraits& t) { t.disturbance.drift_g_s = 20; })},
      {"humming", With([](CellTraits& t) {
         t.disturbance.hum_g = 4;
         t.disturbance.hum_second = 0.5;
         t.disturbance.hum_third = 0.3;
       })},
      {"heating", With([](CellTraits& t) { t.disturbance.heater_g = 4; })},
      {"creeping", With([](CellTraits& t) { t.press.creep_share = 0.08; })},
      {"backlash", With([](CellTraits& t) {
         t.press.onset = Onset::kFlat;
         t.press.onset_travel_mm = 0.004;
       })},
      {"friction", With([](CellTraits& t) {
         t.press.onset = Onset::kCurved;
         t.press.onset_travel_mm = 0.004;
       })},
      {"slow", With([](CellTraits& t) {
         t.converter.rate_hz = 80;
         t.converter.filter_order = 4;
       })},
      {"oozing", With([](CellTraits& t) {
         t.press.blob_g = 40;
         t.press.thread_g = 15;
       })},
      {"sticking", With([](CellTraits& t) { t.press.stick_g = 40; })},
      {"loose-sheet", With([](CellTraits& t) {
         t.press.law.sheet_gap_mm = 0.02;
         t.press.law.sheet_stiffness_g_mm = 700;
       })},
      {"soft-toe", With([](CellTraits& t) {
         t.press.law.toe_mm = 0.008;
         t.press.law.toe_share = 0.2;
         t.press.law.toe_rounding = 0.5;
       })},
      {"ringing", With([](CellTraits& t) {
         t.disturbance.mode_share = 0.1;
         t.disturbance.mode_mass_g = 100;
       })},
      {"swinging", With([](CellTraits& t) { t.disturbance.swing_g = 3; })},
      {"stringing", With([](CellTraits& t) { t.press.strand_g = 10; })},
      {"slipping", With([](CellTraits& t) { t.disturbance.slip_g = 8; })},
      {"late", With([](CellTraits& t) { t.converter.latency_s = 0.01; })},
      {"coarse", With([](CellTraits& t) { t.converter.counts_per_g = 0.5; })},
      {"held", With([](CellTraits& t) {
         t.faults.held_share = 0.5;
         t.faults.held_regularly = true;
       })},
      {"jittering", With([](CellTraits& t) { t.faults.jitter = 1; })},
      {"dropping", With([](CellTraits& t) { t.faults.drop_share = 0.1; })},
      {"minus-one", With([](CellTraits& t) {
         t.faults.minus_one_share = 0.02;
         t.converter.offset_g = 120;
       })},
  };
  return named;
}

PressTraits DrawPress(Random& random) {
  PressTraits press;
  ContactStiffness& law = press.law;
  law.stiffness_g_mm = random.Uniform(2000, 6000);
  law.kind = static_cast<ContactKind>(random.Below(4));
  law.share =
      law.kind == ContactKind::kCubic ? random.Uniform(-0.15, 0.5) : random.Uniform(-0.3, 0.5);
  law.exponent = random.Uniform(1, 1.5);
  press.onset = static_cast<Onset>(random.Below(3));
  press.onset_travel_mm = press.onset == Onset::kInstant ? 0 : random.Uniform(0.0005, 0.004);
  press.creep_share = random.Uniform(0, 0.04);
  press.creep_s = random.Uniform(0.05, 0.5);
  return press;
}

}  // namespace

CellTraits DrawCellTraits(Random& random) {
  constexpr double kRatesHz[] = {80, 320, 331.7, 400, 500, 1000, 2000};
  CellTraits traits;
  traits.press = DrawPress(random);
  traits.disturbance.noise_g = random.Uniform(0.8, 4);
  traits.disturbance.approach_noise_g = random.Uniform(0, 4);
  traits.disturbance.drift_g_s = random.Normal(0, 4);
  traits.disturbance.drift_g_mm = random.Normal(0, 10);
  traits.disturbance.wander_g = random.Uniform(0, 1);
  traits.disturbance.ring_g = random.Uniform(0, 6);
  traits.disturbance.ring_hz = random.Uniform(30, 120);
  traits.disturbance.hum_hz = random.Uniform() < 0.5 ? 50 : 60;
  traits.disturbance.hum_g = random.Uniform(0, 1);
  traits.converter.rate_hz = kRatesHz[random.Below(std::size(kRatesHz))];
  traits.converter.filter_order = static_cast<int>(random.Below(5));
  traits.converter.sign = random.Uniform() < 0.5 ? 1 : -1;
  traits.converter.offset_g = random.Uniform(-2000, 2000);
  return traits;
}

std::vector<std::string> CellNames() {
  std::vector<std::string> names;
  for (const auto& [name, traits] : Named()) names.push_back(name);
  return names;
}

Result<CellTraits> CellByName(std::string_view name) {
  const auto found = Named().find(name);
  if (found != Named().end()) return found->second;
  std::string known;
  for (const std::string& candidate : CellNames()) {
    known += (known.empty() ? "" : ", ") + candidate;
  }
  return Fail(
      fmt::format("there is no load cell \"{}\"; choose one of {}", name.substr(0, 60), known));
}

}  // namespace trammel::sim
