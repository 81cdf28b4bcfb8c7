#include "pressure_advance/photo/plate_patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "vision/comb_finder.h"

namespace trammel::pressure_advance {
namespace {

using vision::FoundChevrons;
using vision::PointPx;

// Parts of the plane beside a pattern's apexes that hold its arms and its frame, in spacings.
constexpr double kBefore = 6.5, kBehind = 1.5, kBeside = 6.5;

vision::Homography Moved(const vision::Homography& h, double x, double y) {
  return vision::Product(h, vision::Homography{{1, 0, x, 0, 1, y, 0, 0, 1}});
}

// Returns photo_from_plane of `other` as seen from `one`, which was found. Both have one heading.
vision::Homography Expected(const PlatePattern& other, const PlatePattern& one,
                            const FoundChevrons& found) {
  const double x = (other.x_mm - one.x_mm) / one.spacing_mm;
  const double y = (other.y_mm - one.y_mm) / one.spacing_mm;
  const double c = std::cos(one.heading_rad), s = std::sin(one.heading_rad);
  // The bed's y points up, the photo's down.
  return Moved(found.photo_from_plane, (one.count - other.count) / 2.0 + c * x + s * y,
               s * x - c * y);
}

// Returns the part of the photo that shows a pattern with some plate around it; nothing if a
// quarter of it lies outside.
// @param more  plate on each side beyond that, in spacings
std::optional<PixelRect> PlaceOf(const vision::Homography& h, int count, const BgrView& photo,
                                 double more) {
  double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9;
  for (const double x : {-kBefore, count - 1 + kBehind}) {
    for (const double y : {-kBeside, kBeside}) {
      const PointPx at = h({x, y});
      x0 = std::min(x0, at.x);
      x1 = std::max(x1, at.x);
      y0 = std::min(y0, at.y);
      y1 = std::max(y1, at.y);
    }
  }
  const double area = (x1 - x0) * (y1 - y0);
  const auto clamp = [&] {
    x0 = std::clamp<double>(x0, 0, photo.width);
    x1 = std::clamp<double>(x1, 0, photo.width);
    y0 = std::clamp<double>(y0, 0, photo.height);
    y1 = std::clamp<double>(y1, 0, photo.height);
  };
  clamp();
  constexpr double kLeast = 0.75, kSmallest_px = 64;
  if (!((x1 - x0) * (y1 - y0) > kLeast * area)) return std::nullopt;
  if (std::min(x1 - x0, y1 - y0) < kSmallest_px) return std::nullopt;
  const double more_px = more * vision::Distance_px(h({0, 0}), h({count - 1.0, 0})) / (count - 1);
  x0 -= more_px;
  x1 += more_px;
  y0 -= more_px;
  y1 += more_px;
  clamp();
  return PixelRect{static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1 - x0),
                   static_cast<int>(y1 - y0)};
}

std::optional<FoundChevrons> FindIn(const BgrView& photo, const PixelRect& rect) {
  const BgrView part = Crop(photo, rect);
  auto found = vision::FindChevrons(part, vision::FindCombs(part));
  if (found) {
    found->photo_from_plane =
        vision::Product(vision::Homography{{1, 0, static_cast<double>(rect.x), 0, 1,
                                            static_cast<double>(rect.y), 0, 0, 1}},
                        found->photo_from_plane);
  }
  return found;
}

PointPx MiddleOf(const vision::Homography& h, int count) { return h({(count - 1) / 2.0, 0}); }

PointPx MiddleOf(const FoundChevrons& found) {
  return MiddleOf(found.photo_from_plane, found.count);
}

double Spacing_px(const FoundChevrons& found) {
  const PointPx middle = MiddleOf(found);
  return vision::Distance_px(middle, found.photo_from_plane({(found.count + 1) / 2.0, 0}));
}

// True if so many corners may have been found: the space beside the last one may count as well.
bool IsCount(const FoundChevrons& found, int count) { return std::abs(found.count - count) <= 1; }

// Searches places of one photo, each once.
class Search {
 public:
  explicit Search(const BgrView& photo) : photo_(photo) {}

  // Returns a pattern of so many corners near where it should be. One pattern's perspective,
  // continued to the next one, is off by up to three spacings; they lie 13 and more apart.
  std::optional<FoundChevrons> At(const vision::Homography& expected, int count) {
    return At(expected, count, false);
  }
  // Does the same where nothing was found, with room for that error: one pattern's arms may have
  // been cut off.
  std::optional<FoundChevrons> Around(const vision::Homography& expected, int count) {
    return At(expected, count, true);
  }
  void Add(const FoundChevrons& found) { found_.push_back(found); }

 private:
  std::optional<FoundChevrons> At(const vision::Homography& expected, int count, bool around) {
    const PointPx middle = MiddleOf(expected, count);
    constexpr double kAway = 4;
    const auto fits = [&](const FoundChevrons& found) {
      return IsCount(found, count) &&
             vision::Distance_px(MiddleOf(found), middle) < kAway * Spacing_px(found);
    };
    const auto known = std::ranges::find_if(found_, fits);
    if (known != found_.end()) return *known;
    const auto place = PlaceOf(expected, count, photo_, around ? 3 : 0);
    if (!place) return std::nullopt;
    const auto searched = [&](const PixelRect& rect) {
      const double dx = rect.x + rect.width / 2.0 - place->x - place->width / 2.0;
      const double dy = rect.y + rect.height / 2.0 - place->y - place->height / 2.0;
      return std::hypot(dx, dy) < 0.1 * std::max(rect.width, rect.height);
    };
    if (!around && std::ranges::any_of(empty_, searched)) return std::nullopt;
    const auto found = FindIn(photo_, *place);
    if (found && fits(*found)) {
      found_.push_back(*found);
      return found;
    }
    empty_.push_back(*place);
    return std::nullopt;
  }

  BgrView photo_;
  std::vector<FoundChevrons> found_;
  std::vector<PixelRect> empty_;
};

// Looks for one pattern: in parts of the photo that hold about one, from the middle outwards.
std::optional<FoundChevrons> FindOne(const BgrView& photo, std::span<const PlatePattern> patterns) {
  const auto [left, right] = std::ranges::minmax(patterns, {}, &PlatePattern::x_mm);
  const auto [front, back] = std::ranges::minmax(patterns, {}, &PlatePattern::y_mm);
  const PlatePattern& one = patterns.front();
  const double long_mm = (one.count - 1 + kBefore + kBehind) * one.spacing_mm;
  const double plate_mm = std::max(right.x_mm - left.x_mm, back.y_mm - front.y_mm) + long_mm;
  constexpr double kPlateAround = 1.4, kSmallest = 0.35;
  const double part = std::clamp(kPlateAround * long_mm / plate_mm, kSmallest, 1.0);
  std::vector<std::pair<double, PixelRect>> parts;  // by their distance from the photo's middle
  const int steps = static_cast<int>(std::ceil((1 - part) / (part / 2)));
  for (int row = 0; row <= steps; ++row) {
    for (int column = 0; column <= steps; ++column) {
      const double u = steps == 0 ? 0 : (1 - part) * column / steps;
      const double v = steps == 0 ? 0 : (1 - part) * row / steps;
      parts.emplace_back(
          std::hypot(u + part / 2 - 0.5, v + part / 2 - 0.5),
          PixelRect{static_cast<int>(u * photo.width), static_cast<int>(v * photo.height),
                    static_cast<int>(part * photo.width), static_cast<int>(part * photo.height)});
    }
  }
  std::ranges::stable_sort(parts, {}, &std::pair<double, PixelRect>::first);
  for (const auto& [away, rect] : parts) {
    const auto found = FindIn(photo, rect);
    const auto whole = [&](const FoundChevrons& f) {
      return std::ranges::any_of(patterns,
                                 [&](const PlatePattern& p) { return IsCount(f, p.count); });
    };
    if (!found || !whole(*found)) continue;
    // Another pattern in the part may have bent the plane, and others' places follow from it.
    const auto place = PlaceOf(found->photo_from_plane, found->count, photo, 1);
    const auto alone = place ? FindIn(photo, *place) : std::nullopt;
    return alone && whole(*alone) ? alone : found;
  }
  return std::nullopt;
}

// Returns the pattern that is neither found nor given up and lies nearest to a found one, with that
// one; nothing if there is none.
std::optional<std::pair<std::size_t, std::size_t>> Nearest(
    std::span<const PlatePattern> patterns, const std::vector<std::optional<FoundChevrons>>& found,
    const std::vector<bool>& tried) {
  std::optional<std::pair<std::size_t, std::size_t>> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t next = 0; next < patterns.size(); ++next) {
    for (std::size_t from = 0; !tried[next] && from < patterns.size(); ++from) {
      if (!found[from]) continue;
      const double away = std::hypot(patterns[next].x_mm - patterns[from].x_mm,
                                     patterns[next].y_mm - patterns[from].y_mm);
      if (away >= least) continue;
      least = away;
      nearest = {next, from};
    }
  }
  return nearest;
}

// Searches the patterns that were not found, around the places that found ones name.
void FindRest(Search& search, std::span<const PlatePattern> patterns,
              std::vector<std::optional<FoundChevrons>>& found) {
  std::vector<bool> tried;
  for (const auto& one : found) tried.push_back(one.has_value());
  while (const auto nearest = Nearest(patterns, found, tried)) {
    const auto [next, from] = *nearest;
    tried[next] = true;
    found[next] =
        search.Around(Expected(patterns[next], patterns[from], *found[from]), patterns[next].count);
  }
}

}  // namespace

PlateView FindPlatePatterns(const BgrView& photo, std::span<const PlatePattern> patterns) {
  PlateView view;
  const auto one = FindOne(photo, patterns);
  if (!one) {
    view.problem =
        "no pattern of corners is seen as a whole: take a photo of all of them, sharp and without "
        "glare, or one of each in the order of their places";
    return view;
  }
  Search search(photo);
  search.Add(*one);
  std::size_t most = 0, equal = 0;
  for (std::size_t supposed = 0; supposed < patterns.size(); ++supposed) {
    if (!IsCount(*one, patterns[supposed].count)) continue;
    std::vector<std::optional<FoundChevrons>> found(patterns.size());
    std::vector<bool> tried(patterns.size(), false);
    found[supposed] = one;
    tried[supposed] = true;
    std::size_t seen = patterns.size();  // at most
    while (const auto nearest = Nearest(patterns, found, tried)) {
      const auto [next, from] = *nearest;
      tried[next] = true;
      found[next] =
          search.At(Expected(patterns[next], patterns[from], *found[from]), patterns[next].count);
      if (!found[next] && --seen < most) break;  // another supposition fits better
    }
    equal = seen == most ? equal + 1 : seen > most ? 1 : equal;
    if (seen > most) view.found = std::move(found);
    most = std::max(most, seen);
  }
  if (2 * most <= patterns.size() || equal > 1) {
    view.problem = fmt::format(
        "{} of {} patterns of corners are seen{}: is it the file that was printed, and is the "
        "photo not mirrored? Take a photo of all of them, or one of each in the order of their "
        "places",
        most, patterns.size(), equal > 1 ? ", and they fit more than one order of the file's" : "");
    return view;
  }
  FindRest(search, patterns, view.found);
  return view;
}

}  // namespace trammel::pressure_advance
