#include "pressure_advance/response/lag_model.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace trammel::pressure_advance {

HeadMotion::HeadMotion(const LineMotion& motion)
    : slow_mm_s_(motion.segments[0].speed_mm_s), fast_mm_s_(motion.segments[1].speed_mm_s) {
  const double length_mm = *motion.length_mm;
  const double a = *motion.acceleration_mm_s2;
  const double last_mm_s = motion.segments[2].speed_mm_s;
  const double fast_mm = motion.segments[1].fraction * length_mm;
  // A short fast stretch ends before its speed is reached.
  const double peak_mm_s = std::min(
      fast_mm_s_, std::sqrt(a * fast_mm + (slow_mm_s_ * slow_mm_s_ + last_mm_s * last_mm_s) / 2));
  const double rise_s = (peak_mm_s - slow_mm_s_) / a;
  const double fall_s = (peak_mm_s - last_mm_s) / a;
  const double ramps_mm =
      rise_s * (peak_mm_s + slow_mm_s_) / 2 + fall_s * (peak_mm_s + last_mm_s) / 2;
  const double even_s = std::max(0.0, fast_mm - ramps_mm) / peak_mm_s;
  // Time 0 is the first change of speed; before it the head moves at constant speed.
  phases_.push_back({0, {0, 0, motion.segments[0].fraction * length_mm / 2, slow_mm_s_ / 6, 0}});
  Continue(0, slow_mm_s_, a);
  Continue(rise_s, peak_mm_s, 0);
  Continue(rise_s + even_s, peak_mm_s, -a);
  const double fallen_s = rise_s + even_s + fall_s;
  Continue(fallen_s, last_mm_s, 0);
  constexpr double kBeyond_mm = 1;
  DivideTime(fallen_s + (motion.segments[2].fraction * length_mm + kBeyond_mm) / last_mm_s);
}

HeadMotion::Way HeadMotion::At(double time_s) const {
  auto phase = phases_.end() - 1;
  while (phase != phases_.begin() && time_s < phase->begin_s) --phase;
  const double t = time_s - phase->begin_s;
  const auto& c = phase->twice_integrated;
  return {c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * c[4]))),
          c[1] + t * (2 * c[2] + t * (3 * c[3] + t * 4 * c[4])),
          2 * c[2] + t * (6 * c[3] + t * 12 * c[4]), 6 * c[3] + t * 24 * c[4]};
}

void HeadMotion::Continue(double from_s, double speed_mm_s, double acceleration_mm_s2) {
  const Way way = At(from_s);
  phases_.push_back({from_s,
                     {way.twice_integrated, way.integrated, way.mm / 2, speed_mm_s / 6,
                      acceleration_mm_s2 / 24}});
}

void HeadMotion::DivideTime(double end_s) {
  constexpr double kBefore_s = 0.15;  // before the first change: averaging looks ahead
  constexpr double kShortest_s = 0.002;
  // Time steps are short from kAhead_s before a change of speed until kAfter_s after it; then they
  // grow with the time passed.
  constexpr double kAhead_s = 0.06, kAfter_s = 0.03, kGrowth = 0.05;
  for (double t = -kBefore_s; t < end_s;) {
    times_s_.push_back(t);
    double cell_s = end_s - t;
    for (const Phase& phase : phases_) {
      const double ahead_s = phase.begin_s - kAhead_s - t;
      const double behind_s = t - phase.begin_s - kAfter_s;
      cell_s = std::min(cell_s, std::max(kShortest_s, ahead_s > 0 ? ahead_s : kGrowth * behind_s));
    }
    t += cell_s;
  }
  times_s_.push_back(end_s);
  for (const double t : times_s_) positions_mm_.push_back(At(t).mm);
}

HeadMotion::Drive HeadMotion::Averaged(double width_s) const {
  constexpr double kNoWidth_s = 1e-6;
  Drive drive;
  const double half_s = width_s / 2;
  for (const double t : times_s_) {
    const Way here = At(t);
    if (width_s < kNoWidth_s) {
      drive.position_mm.push_back(here.mm);
      drive.speed_mm_s.push_back(here.mm_s);
      continue;
    }
    const Way before = At(t - half_s), after = At(t + half_s);
    drive.position_mm.push_back(
        (before.twice_integrated - 2 * here.twice_integrated + after.twice_integrated) /
        (half_s * half_s));
    drive.speed_mm_s.push_back((before.integrated - 2 * here.integrated + after.integrated) /
                               (half_s * half_s));
  }
  return drive;
}

namespace {

constexpr std::size_t kTable = 512;
constexpr double kTableEnd = 2;  // over what is stored at the fast flow

// Returns the mean of exp(-t) over t from 0 to x.
double MeanDecay(double x) {
  constexpr double kSeries = 0.7;  // below it right to 4e-6
  if (x < kSeries) return 1 / (1 + x * (1.0 / 2 + x * (1.0 / 12 - x * x / 720)));
  return (1 - std::exp(-x)) / x;
}

// Melt of one line: a stage with the law, followed by a linear one.
struct Melt {
  const HeadMotion::Drive* drive = nullptr;
  double pressure_advance_s = 0;
  double scale = 1, per_scale = 1;  // stored here over stored by the law
  double second_s = 0;
  double stored_mm = 0, second_mm = 0;
  double flow_mm_s = 0;
  double laid_mm = 0;

  [[nodiscard]] double AskedMm(std::size_t i) const {
    return drive->position_mm[i] + pressure_advance_s * drive->speed_mm_s[i];
  }
};

// Returns the output of the first stage in a step; exact for a law that is linear over the step.
double PushFirst(const StoredModel& law, double loss, double filament_mm, double step_s,
                 Melt& melt) {
  if (melt.stored_mm <= 0) {
    melt.stored_mm += filament_mm < 0 ? (1 - loss) * filament_mm : filament_mm;
    return 0;
  }
  const StoredModel::Flow flow = law.At(melt.stored_mm * melt.per_scale);
  const double change_mm =
      (filament_mm - flow.mm_s * step_s) * MeanDecay(step_s * flow.per_s * melt.per_scale);
  const double out_mm = filament_mm - change_mm;
  if (out_mm < 0) {
    melt.stored_mm += filament_mm;
    if (melt.stored_mm < 0) melt.stored_mm *= 1 - loss;
    return 0;
  }
  melt.stored_mm += change_mm;
  return out_mm;
}

double PushSecond(double in_mm, double step_s, Melt& melt) {
  constexpr double kNoStage_s = 1e-5;
  if (melt.second_s <= kNoStage_s) return in_mm;
  const double share = step_s / melt.second_s;
  const double change_mm = (in_mm - melt.second_mm * share) * MeanDecay(share);
  melt.second_mm += change_mm;
  return in_mm - change_mm;
}

}  // namespace

double StoredModel::Piece::Stored(double flow) const {
  return stored + lag_s * anchor / n * (std::pow(flow / anchor, n) - at_anchor);
}

double StoredModel::Piece::LagAt(double flow) const {
  return lag_s * std::pow(flow / anchor, n - 1);
}

StoredModel::Flow StoredModel::Piece::At(double level) const {
  const double power = at_anchor + (level - stored) * n / (lag_s * anchor);
  const double ratio = std::pow(power, 1 / n);
  return {anchor * ratio, ratio / power / lag_s};
}

StoredModel::StoredModel(const HeadMotion& motion, const std::array<double, 4>& exponent) {
  const double fast_mm_s = motion.fast_mm_s();
  double lag_s = 1, begin = 0, stored = 0;
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    const double anchor = fast_mm_s * kStorageBreaks[k == 0 ? 0 : k - 1];
    pieces_[k] = {begin, stored, anchor, exponent[k], lag_s, k == 0 ? 0.0 : 1.0};
    if (k + 1 == pieces_.size()) break;
    begin = fast_mm_s * kStorageBreaks[k];
    stored = pieces_[k].Stored(begin);
    lag_s *= std::pow(begin / anchor, exponent[k] - 1);
  }
  const double secant_s =
      (Stored(fast_mm_s) - Stored(motion.slow_mm_s())) / (fast_mm_s - motion.slow_mm_s());
  for (Piece& piece : pieces_) {
    piece.lag_s /= secant_s;
    piece.stored /= secant_s;
  }
  const double end_mm = kTableEnd * Stored(fast_mm_s);
  cells_per_mm_ = kTable / end_mm;
  flow_mm_s_.push_back(0);
  for (std::size_t i = 1; i <= kTable; ++i) {
    flow_mm_s_.push_back(Exact(static_cast<double>(i) / cells_per_mm_).mm_s);
  }
}

const StoredModel::Piece& StoredModel::PieceOf(double flow_mm_s) const {
  std::size_t k = pieces_.size() - 1;
  while (k > 0 && flow_mm_s < pieces_[k].begin) --k;
  return pieces_[k];
}

double StoredModel::Stored(double flow_mm_s) const { return PieceOf(flow_mm_s).Stored(flow_mm_s); }

double StoredModel::LagAt(double flow_mm_s) const { return PieceOf(flow_mm_s).LagAt(flow_mm_s); }

StoredModel::Flow StoredModel::Exact(double stored_mm) const {
  std::size_t k = pieces_.size() - 1;
  while (k > 0 && stored_mm < pieces_[k].stored) --k;
  return pieces_[k].At(stored_mm);
}

StoredModel::Flow StoredModel::At(double stored_mm) const {
  const double at = stored_mm * cells_per_mm_;
  if (!(at < kTable)) return Exact(stored_mm);
  const auto i = static_cast<std::size_t>(at);
  const double rise = flow_mm_s_[i + 1] - flow_mm_s_[i];
  return {flow_mm_s_[i] + rise * (at - static_cast<double>(i)), rise * cells_per_mm_};
}

LagModel::LagModel(const HeadMotion& motion, const Lag& lag)
    : motion_(&motion),
      lag_(lag),
      law_(std::make_shared<StoredModel>(motion, lag.exponent)),
      even_(std::make_shared<HeadMotion::Drive>(motion.Averaged(0))),
      averaged_(std::make_shared<HeadMotion::Drive>(motion.Averaged(lag.smooth_s))) {}

LagModel LagModel::With(const Lag& lag) const {
  LagModel model = *this;
  model.lag_ = lag;
  if (lag.exponent != lag_.exponent) {
    model.law_ = std::make_shared<StoredModel>(*motion_, lag.exponent);
  }
  if (lag.smooth_s != lag_.smooth_s) {
    model.averaged_ = std::make_shared<HeadMotion::Drive>(motion_->Averaged(lag.smooth_s));
  }
  return model;
}

double LagModel::Kept(double flow_mm_s) const {
  const double ratio = flow_mm_s / motion_->fast_mm_s();
  return 1 - lag_.slip * ratio * ratio;
}

// Returns the filament laid by the end of each time step, line by line in each.
std::vector<double> LagModel::Extrude(std::span<const Line> lines) const {
  const std::vector<double>& times_s = motion_->times_s();
  const double begin_mm_s = motion_->slow_mm_s() * Kept(motion_->slow_mm_s());
  std::vector<Melt> melts;
  for (const Line& line : lines) {
    Melt melt;
    // Klipper smooths no line without advance.
    melt.drive = line.pressure_advance_s > 0 ? averaged_.get() : even_.get();
    melt.pressure_advance_s = line.pressure_advance_s;
    melt.scale = line.lag_s * (1 - lag_.second);
    melt.per_scale = 1 / melt.scale;
    melt.second_s = lag_.second * line.lag_s;
    melt.stored_mm = melt.scale * law_->Stored(begin_mm_s);
    melt.second_mm = melt.second_s * begin_mm_s;
    melt.flow_mm_s = begin_mm_s;
    melts.push_back(melt);
  }
  std::vector<double> laid_mm(lines.size(), 0);
  laid_mm.reserve(lines.size() * times_s.size());
  for (std::size_t i = 0; i + 1 < times_s.size(); ++i) {
    const double step_s = times_s[i + 1] - times_s[i];
    const double per_step = 1 / step_s;
    for (Melt& melt : melts) {
      const double in_mm = (melt.AskedMm(i + 1) - melt.AskedMm(i)) * Kept(melt.flow_mm_s);
      const double out_mm =
          PushSecond(PushFirst(*law_, lag_.loss, in_mm, step_s, melt), step_s, melt);
      melt.flow_mm_s = out_mm * per_step;
      melt.laid_mm += out_mm;
      laid_mm.push_back(melt.laid_mm);
    }
  }
  return laid_mm;
}

std::vector<std::vector<double>> LagModel::Lay(std::span<const Line> lines) const {
  const std::vector<double> laid_mm = Extrude(lines);
  const std::vector<double>& at = motion_->positions_mm();
  const double even = Kept(motion_->slow_mm_s());
  std::vector<std::vector<double>> areas;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    std::size_t i = 1;
    const auto laid = [&](std::size_t cell) { return laid_mm[cell * lines.size() + k]; };
    const auto upto = [&](double s) {
      if (s <= at.front()) return (s - at.front()) * even;
      while (i > 1 && at[i - 1] > s) --i;
      while (i + 1 < at.size() && at[i] <= s) ++i;
      const double share = (s - at[i - 1]) / (at[i] - at[i - 1]);
      return laid(i - 1) + (laid(i) - laid(i - 1)) * share;
    };
    std::vector<double>& line = areas.emplace_back();
    line.reserve(lines[k].positions_mm.size());
    for (const double s : lines[k].positions_mm) {
      const double before_mm = upto(s - lag_.smear_mm / 2);
      line.push_back((upto(s + lag_.smear_mm / 2) - before_mm) / lag_.smear_mm);
    }
  }
  return areas;
}

double LagModel::RightPressureAdvance() const {
  const double fast_mm_s = motion_->fast_mm_s(), slow_mm_s = motion_->slow_mm_s();
  const double delivered_mm_s = fast_mm_s * (1 - lag_.slip);
  const double stored_s =
      (1 - lag_.second) * (law_->Stored(delivered_mm_s) - law_->Stored(slow_mm_s)) +
      lag_.second * (delivered_mm_s - slow_mm_s);
  // Advance also passes through the slipping drive: a third of the slip on average.
  return lag_.lag_s * stored_s / (fast_mm_s - slow_mm_s) / (1 - lag_.slip / 3);
}

double LagModel::LagAt(double flow_mm_s) const {
  return lag_.lag_s * ((1 - lag_.second) * law_->LagAt(flow_mm_s) + lag_.second);
}

}  // namespace trammel::pressure_advance
