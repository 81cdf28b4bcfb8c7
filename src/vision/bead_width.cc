#include "vision/bead_width.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::vision {
namespace {

constexpr std::size_t kPlaces = 200;  // per line
constexpr double kMinContrast = 2.0;  // filament above plate, over the plate's grain in a cell
constexpr int kZones = 24;            // along a line, for the levels of filament and plate

double Sample(const GrayImage& image, double x, double y) {
  x = std::clamp(x, 0.0, image.width - 1.0);
  y = std::clamp(y, 0.0, image.height - 1.0);
  const int x0 = std::min(static_cast<int>(x), image.width - 2);
  const int y0 = std::min(static_cast<int>(y), image.height - 2);
  const double fx = x - x0, fy = y - y0;
  const float* a = image.row(y0) + x0;
  const float* b = image.row(y0 + 1) + x0;
  return (1 - fy) * ((1 - fx) * a[0] + fx * a[1]) + fy * ((1 - fx) * b[0] + fx * b[1]);
}

// Brightness around one line, straightened: rows are offsets across it, columns positions along it.
// Columns average the interval between two positions.
struct Strip {
  int half = 0;  // rows -half … half, one px apart
  std::size_t places = 0;
  std::vector<double> value;  // [row][place]
  std::vector<double> x_px;
  std::vector<bool> seen;  // per place: the photo shows it

  [[nodiscard]] double at(int offset, std::size_t place) const {
    return value[static_cast<std::size_t>(offset + half) * places + place];
  }
};

Strip Straighten(const GrayImage& image, const LinePattern& line_pattern, std::size_t rung,
                 std::size_t places) {
  const Curve& track = line_pattern.rungs[rung];
  const double middle_y = track(image.width / 2.0);
  const double left = line_pattern.left_inner(track(line_pattern.left_inner(middle_y)));
  const double right = line_pattern.right_inner(track(line_pattern.right_inner(middle_y)));
  const double cell = (right - left) / static_cast<double>(places);
  const int inside = std::max(1, static_cast<int>(std::ceil(cell)));
  Strip strip;
  strip.half = std::max(3, static_cast<int>(std::lround(0.62 * line_pattern.pitch_px)));
  strip.places = places;
  strip.value.assign(static_cast<std::size_t>(2 * strip.half + 1) * places, 0.0);
  for (std::size_t place = 0; place < places; ++place) {
    strip.x_px.push_back(left + cell * (static_cast<double>(place) + 0.5));
    strip.seen.push_back(line_pattern.seen.empty() ||
                         line_pattern.seen[rung].Hold(strip.x_px.back()));
    for (int k = 0; k < inside; ++k) {
      const double x = left + cell * (static_cast<double>(place) + (k + 0.5) / inside);
      const double y = track(x);
      for (int offset = -strip.half; offset <= strip.half; ++offset) {
        strip.value[static_cast<std::size_t>(offset + strip.half) * places + place] +=
            Sample(image, x, y + offset) / inside;
      }
    }
  }
  return strip;
}

// Levels at one stretch of one line.
struct Level {
  double plate = 0;     // mean
  double grain = 0;     // standard deviation of one cell of plate
  double filament = 0;  // above the plate; below 0 where light makes the plate the brighter one
  bool seen = true;
};

// Returns the mean without extremes: a mean, not a median, because the integral across a bead adds
// the texture's mean; without extremes, because a string of filament may cross.
double TrimmedMean(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t cut = values.size() / 20;
  double sum = 0;
  for (std::size_t i = cut; i < values.size() - cut; ++i) sum += values[i];
  return sum / static_cast<double>(values.size() - 2 * cut);
}

std::vector<Level> ZoneLevels(const Strip& strip, double pitch, double bead) {
  std::vector<Level> levels;
  const int plate_from = static_cast<int>(std::lround(0.40 * pitch));
  const int core = static_cast<int>(0.2 * bead);
  for (int zone = 0; zone < kZones; ++zone) {
    const auto edge = [&](double z) {
      return static_cast<std::size_t>(std::clamp(z / kZones, 0.0, 1.0) *
                                      static_cast<double>(strip.places));
    };
    std::vector<double> plate, filament;
    // Overlapping zones: the levels change slowly, the readings are grainy.
    for (std::size_t place = edge(zone - 1.0); place < edge(zone + 2.0); ++place) {
      if (!strip.seen[place]) continue;
      for (int offset = plate_from; offset <= strip.half; ++offset) {
        plate.push_back(strip.at(offset, place));
        plate.push_back(strip.at(-offset, place));
      }
      // Over most of the bead, whose crest and flanks differ: a track a little beside the middle
      // would read one or the other.
      double sum = 0;
      for (int offset = -core; offset <= core; ++offset) sum += strip.at(offset, place);
      filament.push_back(sum / (2 * core + 1));
    }
    Level level;
    level.seen = !plate.empty();
    if (!level.seen) {
      levels.push_back(level);
      continue;
    }
    level.plate = TrimmedMean(plate);
    level.grain = RobustStandardDeviation(plate);
    // A large part of a stretch may be broken; filament is beyond the median, on the side further
    // from the plate.
    const double above = Quantile(filament, 0.65) - level.plate;
    const double below = Quantile(filament, 0.35) - level.plate;
    level.filament = above >= -below ? above : below;
    levels.push_back(level);
  }
  return levels;
}

// Fills stretches that the photo does not show with the levels of the nearest visible ones.
void FillUnseen(std::vector<Level>& levels) {
  const std::vector<Level> own = levels;
  const auto zones = static_cast<std::ptrdiff_t>(own.size());
  for (std::ptrdiff_t zone = 0; zone < zones; ++zone) {
    for (std::ptrdiff_t away = 0; away < zones && !levels[zone].seen; ++away) {
      for (const std::ptrdiff_t near : {zone - away, zone + away}) {
        if (near >= 0 && near < zones && own[near].seen) levels[zone] = own[near];
      }
    }
  }
}

// Sets the filament's contrast to a median over a line and its neighbours, for each zone.
void ShareFilamentLevels(std::vector<std::vector<Level>>& levels) {
  const std::vector<std::vector<Level>> own = levels;
  const auto lines = static_cast<std::ptrdiff_t>(own.size());
  for (std::ptrdiff_t line = 0; line < lines; ++line) {
    for (std::ptrdiff_t zone = 0; zone < kZones; ++zone) {
      std::vector<double> near;
      for (std::ptrdiff_t i = line - 2; i <= line + 2; ++i) {
        for (std::ptrdiff_t k = zone - 1; k <= zone + 1; ++k) {
          if (i >= 0 && i < lines && k >= 0 && k < kZones && own[i][k].seen) {
            near.push_back(own[i][k].filament);
          }
        }
      }
      if (!near.empty()) levels[line][zone].filament = Median(near);
    }
  }
}

Level LevelAt(const std::vector<Level>& levels, std::size_t place, std::size_t places) {
  const double z = (static_cast<double>(place) + 0.5) / static_cast<double>(places) * kZones - 0.5;
  const double clamped = std::clamp(z, 0.0, kZones - 1.0);
  const auto i = static_cast<std::size_t>(std::min(clamped, kZones - 2.0));
  const double f = clamped - static_cast<double>(i);
  const auto mix = [f](double a, double b) { return (1 - f) * a + f * b; };
  const Level &a = levels[i], &b = levels[i + 1];
  return {mix(a.plate, b.plate), mix(a.grain, b.grain), mix(a.filament, b.filament), a.seen};
}

// Rows of the strip that belong to the bead: from half contrast outwards by the blur.
struct Span {
  int begin = 0, end = 0;  // offsets, inclusive
  double middle = 0;
};

Span BeadSpan(const Strip& strip, std::size_t place, const Level& level, double bead, int skirt) {
  const double half = 0.5;  // relative to the filament's contrast
  const auto share = [&](int offset) {
    return (strip.at(offset, place) - level.plate) / level.filament;
  };
  const int reach = static_cast<int>(0.3 * bead);
  int top = 0;
  for (int offset = -reach; offset <= reach; ++offset) {
    if (share(offset) > share(top)) top = offset;
  }
  const int nominal = std::max(1, static_cast<int>(std::lround(bead / 2)));
  if (share(top) <= half) return {-nominal, nominal, 0};
  int a = top, b = top;
  while (a > -strip.half && share(a - 1) > half) --a;
  while (b < strip.half && share(b + 1) > half) ++b;
  return {std::max(-strip.half, a - skirt), std::min(strip.half, b + skirt), (a + b) / 2.0};
}

BeadReading Read(const Strip& strip, std::size_t place, const Level& level, double bead,
                 double track_y) {
  BeadReading reading;
  reading.x_px = strip.x_px[place];
  reading.centre_px = track_y;
  reading.seen = strip.seen[place];
  if (!reading.seen || !level.seen) return reading;
  const double contrast = std::abs(level.filament);
  if (contrast < kMinContrast * level.grain || contrast == 0) return reading;
  const int skirt = std::max(2, static_cast<int>(std::lround(0.2 * bead)));
  const Span span = BeadSpan(strip, place, level, bead, skirt);
  double sum = 0;
  for (int offset = span.begin; offset <= span.end; ++offset) {
    sum += std::min((strip.at(offset, place) - level.plate) / level.filament, 1.25);
  }
  reading.centre_px = track_y + span.middle;
  reading.width_px = sum;
  // Texture is correlated over a few rows: its noise adds faster than the root of their number.
  constexpr double kAlikeRows = 3;
  reading.sigma_px = level.grain / contrast * std::sqrt(kAlikeRows * 2.0 * skirt);
  return reading;
}

// Returns the sigma of a Gaussian blur whose edge is as steep as the steepest step of a line's mean
// profile. At single positions the plate's grain would be steepest.
double EdgeBlur(const std::vector<Strip>& strips) {
  std::vector<double> blurs;
  for (const Strip& strip : strips) {
    std::vector<std::size_t> middle;
    for (std::size_t place = strip.places / 3; place < 2 * strip.places / 3; ++place) {
      if (strip.seen[place]) middle.push_back(place);
    }
    if (middle.empty()) continue;
    std::vector<double> profile;
    for (int offset = -strip.half; offset <= strip.half; ++offset) {
      double sum = 0;
      for (const std::size_t place : middle) sum += strip.at(offset, place);
      profile.push_back(sum / static_cast<double>(middle.size()));
    }
    double steepest = 0;
    for (std::size_t i = 0; i + 2 < profile.size(); ++i) {
      steepest = std::max(steepest, std::abs(profile[i + 2] - profile[i]) / 2);
    }
    const double height =
        *std::max_element(profile.begin(), profile.end()) - Quantile(profile, 0.1);
    if (steepest > 0) blurs.push_back(height / steepest / std::sqrt(2 * std::numbers::pi));
  }
  return blurs.empty() ? 0 : Median(blurs);
}

// Raises sigmas of readings to their scatter between neighbouring positions.
void RaiseSigmaToScatter(std::vector<BeadReading>& line) {
  std::vector<double> steps;
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    if (line[i - 1].sigma_px > 0 && line[i].sigma_px > 0 && line[i + 1].sigma_px > 0) {
      steps.push_back((line[i - 1].width_px + line[i + 1].width_px) / 2 - line[i].width_px);
    }
  }
  constexpr double kFloor_px = 0.05;
  // The mean of two neighbours minus the middle scatters by sqrt(3/2) sigma.
  const double scatter =
      std::max(kFloor_px, steps.size() < 3 ? 0 : RobustStandardDeviation(steps) / std::sqrt(1.5));
  for (BeadReading& reading : line) {
    if (reading.sigma_px > 0) reading.sigma_px = std::max(reading.sigma_px, scatter);
  }
}

}  // namespace

BeadWidths MeasureBeadWidths(const GrayImage& contrast, const LinePattern& line_pattern) {
  TRAMMEL_CHECK(line_pattern.problem.empty() && line_pattern.rungs.size() >= 2, "{} rungs, {}",
                line_pattern.rungs.size(), line_pattern.problem);
  std::vector<Strip> strips;
  std::vector<std::vector<Level>> levels;
  for (std::size_t rung = 0; rung < line_pattern.rungs.size(); ++rung) {
    strips.push_back(Straighten(contrast, line_pattern, rung, kPlaces));
    levels.push_back(ZoneLevels(strips.back(), line_pattern.pitch_px, line_pattern.bead_px));
  }
  ShareFilamentLevels(levels);
  for (std::vector<Level>& line : levels) FillUnseen(line);
  BeadWidths widths;
  widths.blur_px = EdgeBlur(strips);
  for (std::size_t rung = 0; rung < strips.size(); ++rung) {
    const Strip& strip = strips[rung];
    std::vector<BeadReading> line;
    for (std::size_t place = 0; place < strip.places; ++place) {
      line.push_back(Read(strip, place, LevelAt(levels[rung], place, strip.places),
                          line_pattern.bead_px, line_pattern.rungs[rung](strip.x_px[place])));
    }
    RaiseSigmaToScatter(line);
    widths.lines.push_back(std::move(line));
  }
  return widths;
}

}  // namespace trammel::vision
