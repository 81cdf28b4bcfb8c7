#include "melt_world.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/square.h"
#include "extruder_world.h"

namespace trammel::test {
namespace {

namespace pa = pressure_advance;

constexpr double kStep_s = 5e-5;
constexpr double kNozzle_mm = 0.4;     // filament lands below the whole of the nozzle's bore
constexpr double kTravel_s = 0.1;      // between lines
constexpr double kRetract_mm = 10.9;   // 0.5 mm of filament, as mm of line
constexpr double kRetract_mm_s = 654;  // 30 mm/s of filament
constexpr double kNominalArea_mm2 = 0.11;
constexpr int kFillingLines = 2;

struct Phase {
  double acceleration_mm_s2, seconds;
};

// A line from rest to rest. Speed changes within the fast stretch, as firmware plans it.
std::vector<Phase> PhasesOf(const MeltLine& line) {
  const double a = line.acceleration_mm_s2;
  const double start_s = line.slow_mm_s / a, change_s = (line.fast_mm_s - line.slow_mm_s) / a;
  const double start_mm = line.slow_mm_s * start_s / 2;
  const double change_mm = (line.fast_mm_s + line.slow_mm_s) / 2 * change_s;
  const double first_mm = line.first_share * line.length_mm - start_mm;
  const double fast_mm = line.fast_share * line.length_mm - 2 * change_mm;
  const double last_mm = line.length_mm * (1 - line.first_share - line.fast_share) - start_mm;
  TRAMMEL_CHECK(first_mm > 0 && fast_mm > 0 && last_mm > 0, "stretches of {}, {} and {} mm",
                first_mm, fast_mm, last_mm);
  return {
      {a, start_s},   {0, first_mm / line.slow_mm_s}, {a, change_s}, {0, fast_mm / line.fast_mm_s},
      {-a, change_s}, {0, last_mm / line.slow_mm_s},  {-a, start_s}};
}

struct Head {
  double position_mm = 0, speed_mm_s = 0;
};

// The head once a step, from rest to rest.
std::vector<Head> HeadOf(const MeltLine& line) {
  std::vector<Head> heads{{}};
  Head begin;
  double begin_s = 0;
  for (const Phase& phase : PhasesOf(line)) {
    const double a = phase.acceleration_mm_s2;
    const auto at = [&](double t) {
      return Head{begin.position_mm + (begin.speed_mm_s + a * t / 2) * t, begin.speed_mm_s + a * t};
    };
    for (double t_s = kStep_s * static_cast<double>(heads.size()) - begin_s; t_s < phase.seconds;
         t_s = kStep_s * static_cast<double>(heads.size()) - begin_s) {
      heads.push_back(at(t_s));
    }
    begin = at(phase.seconds);
    begin_s += phase.seconds;
  }
  heads.push_back({line.length_mm, 0});
  return heads;
}

// A running mean over an odd number of steps, centred; the ends are continued.
std::vector<double> BoxMean(const std::vector<double>& values, std::size_t half) {
  std::vector<double> means(values.size());
  const auto at = [&](std::ptrdiff_t i) {
    return values[static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(i, 0, std::ssize(values) - 1))];
  };
  const auto reach = static_cast<std::ptrdiff_t>(half);
  double sum = 0;
  for (std::ptrdiff_t i = -reach; i <= reach; ++i) sum += at(i);
  for (std::ptrdiff_t i = 0; i < std::ssize(values); ++i) {
    means[static_cast<std::size_t>(i)] = sum / static_cast<double>(2 * half + 1);
    sum += at(i + reach + 1) - at(i - reach);
  }
  return means;
}

// Filament commanded, one value a step, and which line the head is on then (-1: on none).
struct Drive {
  std::vector<double> filament_mm;
  std::vector<Head> head;
  std::vector<int> line;
};

Drive DriveOf(const MeltLine& line, const std::vector<double>& advances_s) {
  Drive drive;
  double begin_mm = 0;
  const std::vector<Head> heads = HeadOf(line);
  const auto steps = static_cast<int>(std::lround(kTravel_s / kStep_s));
  for (std::size_t i = 0; i < advances_s.size(); ++i) {
    for (int k = 0; k < steps; ++k) {  // back at once, forward again just before the line
      const double away_mm = kRetract_mm_s * kStep_s * std::min(k, steps - k);
      drive.filament_mm.push_back(begin_mm - std::min(kRetract_mm, away_mm));
      drive.head.emplace_back();
      drive.line.push_back(-1);
    }
    for (const Head& head : heads) {
      drive.filament_mm.push_back(begin_mm + head.position_mm + advances_s[i] * head.speed_mm_s);
      drive.head.push_back(head);
      drive.line.push_back(static_cast<int>(i));
    }
    begin_mm += line.length_mm;
  }
  // Klipper's triangle: a box over a box, each half of the window long.
  const auto half = static_cast<std::size_t>(std::lround(line.smooth_time_s / kStep_s / 4));
  drive.filament_mm = BoxMean(BoxMean(drive.filament_mm, half), half);
  return drive;
}

std::size_t BinsOf(const MeltLine& line) {
  return static_cast<std::size_t>(std::ceil(line.length_mm / kBin_mm));
}

// Lays filament between two positions.
void Lay(double from_mm, double to_mm, double filament_mm, std::vector<double>& area) {
  const auto last = area.size() - 1;
  const auto bin_of = [&](double x) {
    return std::min(last, static_cast<std::size_t>(std::max(0.0, x / kBin_mm)));
  };
  const std::size_t first = bin_of(from_mm), end = bin_of(to_mm);
  if (first == end) {
    area[first] += filament_mm / kBin_mm;
    return;
  }
  for (std::size_t i = first; i <= end; ++i) {
    const double lo = i == first ? from_mm : static_cast<double>(i) * kBin_mm;
    const double hi = i == end ? to_mm : static_cast<double>(i + 1) * kBin_mm;
    area[i] += filament_mm * (hi - lo) / (to_mm - from_mm) / kBin_mm;
  }
}

double SpeedAt(const MeltLine& line, double position_mm) {
  const double begin_mm = line.first_share * line.length_mm;
  const double end_mm = begin_mm + line.fast_share * line.length_mm;
  const double inside_mm = std::min(position_mm - begin_mm, end_mm - position_mm);
  return std::min(line.fast_mm_s, std::sqrt(Square(line.slow_mm_s) + 2 * line.acceleration_mm_s2 *
                                                                         std::max(0.0, inside_mm)));
}

// Surplus behind the deceleration less that behind the acceleration, mm of line.
double Surplus(const MeltWorld& world, const std::vector<double>& settled, double advance_s) {
  const std::vector<double> area = PrintLines(world, {advance_s}).area.front();
  const MeltLine& line = world.line;
  const double begin_mm = line.first_share * line.length_mm / 2;
  const double middle_mm = (line.first_share + line.fast_share / 2) * line.length_mm;
  const double end_mm = line.length_mm - line.left_out_mm;
  double surplus = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const double x = (static_cast<double>(i) + 0.5) * kBin_mm;
    if (x < begin_mm || x > end_mm) continue;
    surplus += (area[i] - settled[i]) * kBin_mm * (x < middle_mm ? -1 : 1);
  }
  return surplus;
}

double StudentOf3(Random& random) {
  const double normal = random.Normal();
  double squares = 0;
  for (int i = 0; i < 3; ++i) squares += Square(random.Normal());
  return normal / std::sqrt(squares);  // unit variance: 3 degrees of freedom have 3
}

// The mean of a noisy bead below the nozzle, around a position.
double MeanAround(const std::vector<double>& area, double position_mm) {
  const auto last = static_cast<double>(area.size() - 1);
  const auto bin = [&](double x) {
    return static_cast<std::size_t>(std::clamp(x / kBin_mm, 0.0, last));
  };
  double sum = 0;
  const std::size_t begin = bin(position_mm - kNozzle_mm / 2);
  const std::size_t end = bin(position_mm + kNozzle_mm / 2);
  for (std::size_t i = begin; i <= end; ++i) sum += area[i];
  return sum / static_cast<double>(end - begin + 1);
}

double ReadingNoise(const MeltWorld& world, double area, Random& random) {
  switch (world.reading) {
    case MeltNoise::kEven:
      return world.reading_noise * random.Normal();
    case MeltNoise::kWithTheArea:
      return world.reading_noise * (0.3 + 0.7 * area) * random.Normal();
    case MeltNoise::kHeavyTails:
      return world.reading_noise * StudentOf3(random);
  }
  return 0;
}

pa::LineProfile ReadLine(const MeltWorld& world, std::vector<double> area, double advance_s,
                         Random& random) {
  const double keeps = std::exp(-kBin_mm / world.flow_noise_length_mm);
  const double flow = 1 + world.flow_scatter * random.Normal();
  double noise = world.flow_noise * random.Normal();
  for (double& value : area) {
    value *= flow * (1 + noise);
    noise = keeps * noise + std::sqrt(1 - keeps * keeps) * world.flow_noise * random.Normal();
  }
  pa::LineProfile profile;
  profile.pressure_advance_s = advance_s;
  for (double x = world.line.left_out_mm; x < world.line.length_mm - world.line.left_out_mm + 1e-9;
       x += world.line.reading_mm) {
    const double laid = MeanAround(area, x);
    pa::ProfileSample sample;
    sample.position = x;
    sample.area = {kNominalArea_mm2 * (laid + ReadingNoise(world, laid, random)),
                   kNominalArea_mm2 * world.reading_noise};
    profile.samples.push_back(sample);
  }
  return profile;
}

}  // namespace

pa::LineMotion MeltWorld::Motion() const {
  const double last = 1 - line.first_share - line.fast_share;
  return {.segments = {{line.first_share, line.slow_mm_s},
                       {line.fast_share, line.fast_mm_s},
                       {last, line.slow_mm_s}},
          .length_mm = line.length_mm,
          .acceleration_mm_s2 = line.acceleration_mm_s2};
}

MeltWorld MeltWorldOf(pa::PatternPreset preset) {
  const ExtruderWorld other = WorldOf(preset);
  MeltWorld world;
  world.line = {.length_mm = other.length_mm,
                .first_share = other.first_share,
                .fast_share = other.fast_share,
                .slow_mm_s = other.slow_mm_s,
                .fast_mm_s = other.fast_mm_s,
                .acceleration_mm_s2 = other.acceleration_mm_s2,
                .smooth_time_s = other.smooth_time_s,
                .left_out_mm = other.left_out_mm,
                .reading_mm = other.reading_mm};
  return world;
}

double SteadyPressureAdvance(const MeltWorld& world) {
  constexpr int kParts = 400;
  const MeltLine& line = world.line;
  const MeltExtruder extruder(world.physics, line.slow_mm_s, line.fast_mm_s);
  MeltSteady before = extruder.Steady(line.slow_mm_s);
  double driven_mm = 0;
  for (int i = 1; i <= kParts; ++i) {
    const MeltSteady after =
        extruder.Steady(std::lerp(line.slow_mm_s, line.fast_mm_s, static_cast<double>(i) / kParts));
    driven_mm += (after.stored_mm - before.stored_mm) / (1 - (before.slip + after.slip) / 2);
    before = after;
  }
  return driven_mm / (line.fast_mm_s - line.slow_mm_s);
}

double LinePressureAdvance(const MeltWorld& world) {
  const MeltExtruder extruder(world.physics, world.line.slow_mm_s, world.line.fast_mm_s);
  std::vector<double> settled(BinsOf(world.line));
  for (std::size_t i = 0; i < settled.size(); ++i) {
    const double speed_mm_s = SpeedAt(world.line, (static_cast<double>(i) + 0.5) * kBin_mm);
    settled[i] = world.physics.slip > 0 ? extruder.Steady(speed_mm_s).flow_mm_s / speed_mm_s : 1;
  }
  // False position: the surplus falls, and nearly straight.
  double lo = 0, hi = 2 * world.physics.lag_s;
  double at_lo = Surplus(world, settled, lo), at_hi = Surplus(world, settled, hi);
  double root = 0;
  for (int i = 0; i < 8; ++i) {
    root = std::clamp(lo + (hi - lo) * at_lo / (at_lo - at_hi), lo, hi);
    const double at_root = Surplus(world, settled, root);
    if (std::abs(at_root) < 1e-5 * (world.line.fast_mm_s - world.line.slow_mm_s)) break;
    if (at_root > 0) {
      lo = root, at_lo = at_root, at_hi /= 2;  // Illinois: let the other end come, too
    } else {
      hi = root, at_hi = at_root, at_lo /= 2;
    }
  }
  return root;
}

MeltPrint PrintLines(const MeltWorld& world, const std::vector<double>& advances_s,
                     const std::vector<double>& compliance) {
  std::vector<double> advances(kFillingLines, advances_s.front());
  advances.insert(advances.end(), advances_s.begin(), advances_s.end());
  const Drive drive = DriveOf(world.line, advances);
  MeltExtruder extruder(world.physics, world.line.slow_mm_s, world.line.fast_mm_s);
  MeltPrint print;
  print.area.assign(advances.size(), std::vector<double>(BinsOf(world.line)));
  print.swollen = print.area;
  for (std::size_t i = 1; i < drive.filament_mm.size(); ++i) {
    const int line = drive.line[i];
    if (line >= kFillingLines && drive.line[i - 1] < 0) {
      const auto at = static_cast<std::size_t>(line - kFillingLines);
      const auto lines = static_cast<double>(advances_s.size());
      const double drift = lines > 1 ? static_cast<double>(at) / (lines - 1) - 0.5 : 0;
      extruder.SetLine(compliance.empty() ? 1 : compliance[at], 1 + world.viscosity_drift * drift);
    }
    const double driven_mm = drive.filament_mm[i] - drive.filament_mm[i - 1];
    const double left_mm = extruder.Step(driven_mm, kStep_s);
    print.driven_mm += driven_mm;
    if (line < 0 || drive.line[i - 1] < 0) {
      print.oozed_mm += left_mm;
      continue;
    }
    const auto at = static_cast<std::size_t>(line);
    const double swell = world.swell * std::sqrt(extruder.Flow_mm_s() / world.line.fast_mm_s);
    const double from_mm = drive.head[i - 1].position_mm, to_mm = drive.head[i].position_mm;
    Lay(from_mm, to_mm, left_mm, print.area[at]);
    Lay(from_mm, to_mm, left_mm * (1 + swell), print.swollen[at]);
  }
  for (const std::vector<double>& line : print.area) {
    for (const double area : line) print.laid_mm += area * kBin_mm;
  }
  print.area.erase(print.area.begin(), print.area.begin() + kFillingLines);
  print.swollen.erase(print.swollen.begin(), print.swollen.begin() + kFillingLines);
  print.slipped_mm = extruder.Slipped_mm();
  print.stored_mm = extruder.Stored_mm();
  return print;
}

std::vector<pa::LineProfile> PrintMeltPattern(const MeltWorld& world, Random& random) {
  std::vector<double> compliance;
  for (std::size_t i = 0; i < world.pressure_advance_s.size(); ++i) {
    const double scatter = world.lag_tails ? StudentOf3(random) : random.Normal();
    compliance.push_back(std::max(0.02, 1 + world.lag_scatter_s / world.physics.lag_s * scatter));
  }
  const MeltPrint print = PrintLines(world, world.pressure_advance_s, compliance);
  std::vector<pa::LineProfile> profiles;
  for (std::size_t i = 0; i < print.swollen.size(); ++i) {
    profiles.push_back(ReadLine(world, print.swollen[i], world.pressure_advance_s[i], random));
  }
  return profiles;
}

}  // namespace trammel::test
