#include "pressure_advance/photo/photo_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/photo/photo_mark.h"
#include "pressure_advance/photo/photo_reader.h"
#include "vision/comb_finder.h"
#include "vision/filament_contrast.h"
#include "vision/frame_finder.h"
#include "vision/image.h"

namespace trammel::pressure_advance {
namespace {

constexpr const char* kAdvice =
    "All lines with some plate around them must be in the picture, sharp and without glare";

struct View {
  vision::Quad corners;  // of the frame in the picture, rotated so that rungs follow the rows
  int margin = 0;
  Frame picture;
  vision::GrayImage contrast;
};

// Returns the frame rectified to a top view, at its size in the photo, or reduced.
std::optional<View> LookAt(const Frame& photo, const vision::FoundFrame& frame,
                           const vision::Quad& corners, std::size_t wanted, double longest_px) {
  using vision::Distance_px;
  double width = std::max(Distance_px(corners[0], corners[1]), Distance_px(corners[3], corners[2]));
  double height =
      std::max(Distance_px(corners[1], corners[2]), Distance_px(corners[0], corners[3]));
  const double shrink = std::min(1.0, longest_px / std::max(width, height));
  width *= shrink;
  height *= shrink;
  constexpr double kSmallest_px = 60;
  if (std::min(width, height) < kSmallest_px) return std::nullopt;
  View view;
  view.corners = corners;
  view.margin = static_cast<int>(0.04 * std::min(width, height)) + 4;
  const double m = view.margin;
  const int w = static_cast<int>(width + 2 * m), h = static_cast<int>(height + 2 * m);
  const vision::Quad target{{{m, m}, {w - 1 - m, m}, {w - 1 - m, h - 1 - m}, {m, h - 1 - m}}};
  const auto photo_from_view = vision::TargetFromSource(corners, target);
  vision::Quad in_mask;
  for (std::size_t i = 0; i < 4; ++i) {
    const double to_mask = frame.filament_scale;
    in_mask[i] = {(corners[i].x + 0.5) * to_mask - 0.5, (corners[i].y + 0.5) * to_mask - 0.5};
  }
  const auto mask_from_view = vision::TargetFromSource(in_mask, target);
  if (!photo_from_view || !mask_from_view) return std::nullopt;
  view.picture = vision::Rectify(photo.view(), *photo_from_view, w, h);
  const vision::GrayImage mask = vision::Rectify(frame.filament, *mask_from_view, w, h);
  const int surroundings =
      std::max(5, static_cast<int>(2 * height / static_cast<double>(wanted + 1))) | 1;
  const auto weights = vision::FindContrast(view.picture.view(), mask, surroundings);
  if (!weights) return std::nullopt;
  view.contrast = vision::Mix(view.picture.view(), *weights);
  return view;
}

vision::Quad Turned(const vision::Quad& quad, std::size_t turns) {
  vision::Quad turned;
  for (std::size_t i = 0; i < 4; ++i) turned[i] = quad[(i + turns) % 4];
  return turned;
}

struct Candidate {
  View view;
  vision::LinePattern line_pattern;
  double strength = 0;
};

// Computes the difference of the two bars across the lines' ends, relative to the frame's width: an
// outline along a shadow or the plate's edge makes that bar appear wide.
double BarMismatch(const Candidate& candidate) {
  const double middle = candidate.view.picture.height / 2.0;
  const double left = candidate.line_pattern.left_inner(middle) - candidate.view.margin;
  const double width = candidate.view.picture.width - 1 - 2.0 * candidate.view.margin;
  const double right = candidate.view.margin + width - candidate.line_pattern.right_inner(middle);
  return std::abs(left - right) / width;
}

bool HasPlaces(const vision::LinePattern& line_pattern, std::size_t wanted) {
  return line_pattern.rungs.size() == wanted || PlacesOf(line_pattern) == wanted;
}

constexpr double kRightCount = 1000;
constexpr double kClear = 3;  // rows over columns

// Returns a rank, higher is better: a line pattern at all, the right number of rungs, the clearer
// rungs between bars that are alike.
double Rank(const Candidate& candidate, std::size_t wanted) {
  if (!candidate.line_pattern.problem.empty()) return -1;
  const double right = HasPlaces(candidate.line_pattern, wanted) ? 1 : 0;
  constexpr double kMaxMismatch = 0.1;
  const double alike = std::max(0.0, 1 - BarMismatch(candidate) / kMaxMismatch);
  return kRightCount * right + alike * std::min(candidate.strength, kRightCount - 1);
}

// Returns the size of a view for the selection, in px of its longer side: wide enough for each of
// the lines.
double ChoosingSize_px(std::size_t wanted) {
  constexpr double kMin_px = 1000, kPerLine_px = 24;
  return std::clamp(kPerLine_px * static_cast<double>(wanted), kMin_px, kLongestRectified_px);
}

// Frame with its reduced view for the selection.
struct Glance {
  const vision::FoundFrame* frame = nullptr;
  vision::Quad corners;  // turned so that the rungs lie along the rows
  Candidate candidate;
};

std::optional<Glance> GlanceAt(const Frame& photo, const vision::FoundFrame& frame,
                               std::size_t wanted) {
  std::optional<Glance> best;
  for (const std::size_t turns : {0, 1}) {
    const vision::Quad corners = Turned(frame.outer, turns);
    std::optional<View> view = LookAt(photo, frame, corners, wanted, ChoosingSize_px(wanted));
    if (!view) continue;
    const double strength = vision::RowsOverColumns(view->contrast, view->margin);
    if (best && best->candidate.strength >= strength) continue;
    best = Glance{&frame, corners, {std::move(*view), {}, strength}};
  }
  if (best) {
    Candidate& candidate = best->candidate;
    candidate.line_pattern =
        vision::FindLinePattern(candidate.view.contrast, candidate.view.margin, wanted);
  }
  return best;
}

// Rectifies the same frame with all of its pixels.
std::optional<Candidate> LookClosely(const Frame& photo, const Glance& glance, std::size_t wanted) {
  std::optional<View> view =
      LookAt(photo, *glance.frame, glance.corners, wanted, kLongestRectified_px);
  if (!view) return std::nullopt;
  const double strength = vision::RowsOverColumns(view->contrast, view->margin);
  Candidate candidate{std::move(*view), {}, strength};
  candidate.line_pattern =
      vision::FindLinePattern(candidate.view.contrast, candidate.view.margin, wanted);
  return candidate;
}

PhotoLines LinesInFrame(const Frame& measured, std::size_t wanted) {
  constexpr std::size_t kMaxClosely = 4;
  const std::vector<vision::FoundFrame> frames = vision::FindPrintedFrames(measured.view());
  std::vector<Glance> glances;
  for (const vision::FoundFrame& frame : frames) {
    std::optional<Glance> glance = GlanceAt(measured, frame, wanted);
    if (!glance) continue;
    glances.push_back(std::move(*glance));
    // Frames are sorted best first; there cannot be two clear line patterns with the right number
    // of rungs.
    if (Rank(glances.back().candidate, wanted) > kRightCount + kClear) break;
  }
  std::stable_sort(glances.begin(), glances.end(), [&](const Glance& a, const Glance& b) {
    return Rank(a.candidate, wanted) > Rank(b.candidate, wanted);
  });
  PhotoLines result;
  if (glances.empty()) {
    result.problem = fmt::format("no printed frame is seen in the photo. {}", kAdvice);
    return result;
  }
  std::optional<Candidate> best;
  for (std::size_t i = 0; i < std::min(kMaxClosely, glances.size()); ++i) {
    if (!glances[i].candidate.line_pattern.problem.empty()) break;
    std::optional<Candidate> candidate = LookClosely(measured, glances[i], wanted);
    if (candidate && (!best || Rank(*candidate, wanted) > Rank(*best, wanted))) {
      best = std::move(candidate);
    }
    if (best && Rank(*best, wanted) > kRightCount + kClear) break;
  }
  if (!best) best = std::move(glances.front().candidate);
  if (!best->line_pattern.problem.empty()) {
    result.problem =
        fmt::format("{} outline(s) were found, but none holds the pattern; of the best: {}. {}",
                    frames.size(), best->line_pattern.problem, kAdvice);
    return result;
  }
  result.corners = best->view.corners;
  result.picture = std::move(best->view.picture);
  result.contrast = std::move(best->view.contrast);
  result.line_pattern = std::move(best->line_pattern);
  return result;
}

// Drops an outer stripe further away than the line spacing if the wanted number of evenly spaced
// lines remains: a bar of the frame whose corner is outside the photo. A bar one step away looks
// like a line; only the rails distinguish it.
void DropLoneBars(vision::LinePattern& pattern, std::size_t wanted) {
  const auto even = [](const auto begin, const auto end) {
    return std::all_of(begin, end, [](int step) { return step == 1; });
  };
  for (const auto& [first, last] : {std::pair{1, 0}, std::pair{0, 1}, std::pair{1, 1}}) {
    if (pattern.rungs.size() != wanted + static_cast<std::size_t>(first + last)) continue;
    if ((first && pattern.steps.front() < 2) || (last && pattern.steps.back() < 2)) continue;
    if (!even(pattern.steps.begin() + first, pattern.steps.end() - last)) continue;
    const auto keep = [&](auto& of_rungs) {
      if (of_rungs.empty()) return;
      of_rungs.erase(of_rungs.end() - last, of_rungs.end());
      of_rungs.erase(of_rungs.begin(), of_rungs.begin() + first);
    };
    keep(pattern.rungs);
    keep(pattern.steps);
    keep(pattern.seen);
    if (first) pattern.first_cut = false;
    if (last) pattern.last_cut = false;
    return;
  }
}

void TakeView(CombView& view, PhotoLines& result) {
  result.corners = view.corners;
  result.picture = std::move(view.picture);
  result.contrast = std::move(view.contrast);
  result.line_pattern = std::move(view.line_pattern);
}

// Returns the combs that are looked at.
std::span<const vision::FoundComb> Clearest(PhotoSearch& photo) {
  constexpr std::size_t kMost = 8;
  const std::span<const vision::FoundComb> combs = photo.Combs();
  return combs.first(std::min(kMost, combs.size()));
}

// Selects the views that agree on the number of places: some views miss an outer line or mistake a
// shadow for one. The list does not decide, as it would select its own error.
PhotoLines LinesOfComb(PhotoSearch& photo, std::size_t wanted) {
  struct Seen {
    double sum = 0;  // total strength of all views with this number of places
    std::optional<CombView> clearest;
    const vision::FoundComb* comb = nullptr;  // comb that shows it
    double strength = 0;  // rows over columns of the clearest, of those that show both rails first
    bool both_rails = false;
  };
  std::map<std::size_t, Seen> by_places;
  std::string problem;
  const BgrView measured = photo.picture().view();
  for (const vision::FoundComb& comb : Clearest(photo)) {
    std::optional<CombView> view = LookAtComb(measured, comb, ChoosingSize_px(wanted), true);
    if (!view) continue;
    if (!view->line_pattern.problem.empty()) {
      if (problem.empty()) problem = view->line_pattern.problem;
      continue;
    }
    Seen& seen = by_places[PlacesOf(view->line_pattern)];
    const double strength = vision::RowsOverColumns(view->contrast, 0);
    seen.sum += strength;
    const vision::LinePattern& pattern = view->line_pattern;
    const bool both_rails = pattern.left_seen && pattern.right_seen;
    if (std::pair(both_rails, strength) <= std::pair(seen.both_rails, seen.strength)) continue;
    seen.strength = strength;
    seen.both_rails = both_rails;
    seen.clearest = std::move(view);
    seen.comb = &comb;
  }
  const auto most =
      std::max_element(by_places.begin(), by_places.end(),
                       [](const auto& a, const auto& b) { return a.second.sum < b.second.sum; });
  PhotoLines result;
  if (most == by_places.end()) {
    result.problem = problem.empty() ? "no equally spaced lines are seen" : problem;
    return result;
  }
  CombView& best = *most->second.clearest;
  std::optional<CombView> whole =
      LookAtComb(measured, *most->second.comb, kLongestRectified_px, true);
  if (whole && whole->line_pattern.problem.empty() &&
      PlacesOf(whole->line_pattern) == most->first) {
    best = std::move(*whole);
  }
  TakeView(best, result);
  return result;
}

// Comb as it is seen in a reduced picture, of a pattern without a frame of its own.
struct FreeComb {
  const vision::FoundComb* comb = nullptr;
  CombView view;
  double score = 0;
};

// Returns the length of lines seen whole in distances between neighbours; else nothing.
std::optional<double> LengthSeen_pitches(const vision::LinePattern& pattern) {
  if (!pattern.left_seen || !pattern.right_seen) return std::nullopt;
  const double middle = pattern.left_inner.centre;
  return (pattern.right_inner(middle) - pattern.left_inner(middle)) / pattern.pitch_px;
}

// Returns why lines seen whole are not those of the plan: a comb of every second line, of a part of
// the lines or of something else has another length. Empty: they may be.
std::string OtherLength(const vision::LinePattern& pattern, std::optional<double> length_pitches) {
  const auto seen = LengthSeen_pitches(pattern);
  if (!length_pitches || !seen) return {};
  // Perspective of 20 % changes the ratio by 5 %; lines may start late by a tenth.
  constexpr double kShortest = 0.82, kLongest = 1.1;
  const double share = *seen / *length_pitches;
  if (share > kShortest && share < kLongest) return {};
  return fmt::format(
      "{} lines are seen, {:.0f} times as long as the distance between them, and in the file they "
      "are {:.0f} times as long: is it the photo of this print, and are the whole lines in it?",
      pattern.rungs.size(), *seen, *length_pitches);
}

// Selects the clearest lines that end side by side, as long as the plan has them. One with the
// wanted number comes before clearer ones with fewer lines, which miss an outer line; but not
// before those with more.
PhotoLines LinesWithoutFrame(PhotoSearch& photo, const PhotoOptions& options) {
  const std::size_t wanted = options.pressure_advance_s.size();
  const BgrView measured = photo.picture().view();
  std::vector<FreeComb> found;
  std::string problem, other_length;
  for (const vision::FoundComb& comb : Clearest(photo)) {
    std::optional<CombView> view = LookAtComb(measured, comb, ChoosingSize_px(wanted), false);
    if (!view) continue;
    const vision::LinePattern& pattern = view->line_pattern;
    if (!pattern.problem.empty()) {
      if (problem.empty()) problem = pattern.problem;
      continue;
    }
    std::string other = OtherLength(pattern, options.length_pitches);
    if (!other.empty()) {
      if (other_length.empty()) other_length = std::move(other);
      continue;
    }
    const double score = comb.weight * pattern.ended;
    found.push_back({&comb, std::move(*view), score});
  }
  PhotoLines result;
  if (found.empty()) {
    result.problem = fmt::format(
        "{}. {}", problem.empty() ? "no equally spaced lines are seen" : problem, kAdvice);
    if (!other_length.empty()) result.problem = other_length;
    return result;
  }
  const auto places = [](const FreeComb& comb) { return PlacesOf(comb.view.line_pattern); };
  std::ranges::stable_sort(found, std::greater(), &FreeComb::score);
  std::size_t best = 0;
  for (std::size_t i = 1; i < found.size() && places(found[best]) < wanted; ++i) {
    constexpr double kMinScore = 0.1;
    if (places(found[i]) == wanted && found[i].score > kMinScore * found[0].score) best = i;
  }
  CombView& view = found[best].view;
  std::optional<CombView> whole =
      LookAtComb(measured, *found[best].comb, kLongestRectified_px, false);
  if (whole && whole->line_pattern.problem.empty() &&
      PlacesOf(whole->line_pattern) == places(found[best])) {
    view = std::move(*whole);
  }
  TakeView(view, result);
  return result;
}

}  // namespace

PhotoLines FindPhotoLines(PhotoSearch& photo, const PhotoOptions& options) {
  const std::size_t wanted = options.pressure_advance_s.size();
  constexpr int kSmallest_px = 16;
  PhotoLines result;
  if (std::min(photo.picture().width, photo.picture().height) < kSmallest_px) {
    result.problem =
        fmt::format("the photo has {} x {} px", photo.photo_width_px(), photo.photo_height_px());
    return result;
  }
  PhotoSearch& coloured = photo.InColours();
  result = options.framed ? LinesInFrame(coloured.picture(), wanted)
                          : LinesWithoutFrame(coloured, options);
  if (options.framed && (!result.problem.empty() || !HasPlaces(result.line_pattern, wanted))) {
    PhotoLines comb = LinesOfComb(coloured, wanted);
    if (comb.problem.empty()) DropLoneBars(comb.line_pattern, wanted);
    // A frame with another number of lines is closed by the picture's border, or a part.
    if (comb.problem.empty() && (!result.problem.empty() || comb.line_pattern.rungs.size() >=
                                                                result.line_pattern.rungs.size())) {
      result = std::move(comb);
    }
  }
  if (&coloured != &photo) vision::DropTexture(result.picture);
  return result;
}

std::size_t PlacesOf(const vision::LinePattern& line_pattern) {
  std::size_t places = line_pattern.rungs.empty() ? 0 : 1;
  for (const int step : line_pattern.steps) places += static_cast<std::size_t>(step);
  return places;
}

namespace {

std::string DescribeCount(const vision::LinePattern& line_pattern, std::size_t wanted) {
  const std::size_t places = PlacesOf(line_pattern);
  const std::size_t missing = places - line_pattern.rungs.size();
  const std::string found = fmt::format(
      "found {} lines{}, the PA list has {} values", line_pattern.rungs.size(),
      missing > 0 ? fmt::format(" and {} empty places between them", missing) : "", wanted);
  if (places < wanted && (line_pattern.first_cut || line_pattern.last_cut)) {
    return fmt::format(
        "{}: the other {} lie outside the photo, which ends beside the outer line that it shows. "
        "Which of the lines these are cannot be told: a print with the list shifted by a line "
        "would "
        "look the same. Take a photo that shows all of them",
        found, wanted - places);
  }
  return fmt::format(
      "{}: give the list of the lines in the photo, or take a photo that shows all of them", found);
}

// Returns the place of the first rung from the first value's side, if the photo shows the frame
// closing beyond one outer line and ends before the other: lines are then counted from the closed
// side, if most are there.
std::optional<std::size_t> FirstPlace(const vision::LinePattern& line_pattern, std::size_t wanted,
                                      bool first_at_bottom) {
  const vision::LinePattern& p = line_pattern;
  const std::size_t places = PlacesOf(p);
  constexpr double kMinShown = 2.0 / 3;
  if (places >= wanted || p.rungs.size() != places) return std::nullopt;
  if (static_cast<double>(places) < kMinShown * static_cast<double>(wanted)) return std::nullopt;
  const bool from_top = p.first_closed && !p.last_closed && p.last_cut;
  const bool from_bottom = p.last_closed && !p.first_closed && p.first_cut;
  if (!from_top && !from_bottom) return std::nullopt;
  return from_bottom == first_at_bottom ? 0 : wanted - places;
}

std::string ListText(const std::vector<double>& values_s) {
  std::string text;
  for (const double value : values_s)
    text += fmt::format("{}{:.4g}", text.empty() ? "" : ", ", value);
  return text;
}

// True if the list's gaps are exactly at the missing rungs.
bool JumpsAlike(const std::vector<int>& steps, const std::vector<double>& list) {
  std::vector<double> unit;
  for (std::size_t i = 0; i < steps.size(); ++i) unit.push_back((list[i + 1] - list[i]) / steps[i]);
  const double typical = Median(unit);
  constexpr double kUneven = 0.25;  // a list need not be quite even; a missing value doubles a step
  return std::all_of(unit.begin(), unit.end(),
                     [&](double u) { return typical != 0 && std::abs(u / typical - 1) < kUneven; });
}

}  // namespace

LineNames NameLines(const vision::LinePattern& line_pattern, const std::vector<double>& list,
                    bool first_at_bottom) {
  LineNames names;
  const std::size_t found = line_pattern.rungs.size();
  const std::size_t places = PlacesOf(line_pattern);
  std::vector<int> steps = line_pattern.steps;
  if (first_at_bottom) std::reverse(steps.begin(), steps.end());
  if (line_pattern.doubtful > 0) {
    names.refusal = fmt::format(
        "{} lines are seen, and {} more at the photo's border that may be lines or bars of the "
        "frame. {}",
        found, line_pattern.doubtful, kAdvice);
  } else if (places == list.size()) {
    std::size_t place = 0;
    std::vector<double> missing;
    for (std::size_t i = 0; i < found; ++i) {
      names.pressure_advance_s.push_back(list[place]);
      const std::size_t next = place + (i < steps.size() ? static_cast<std::size_t>(steps[i]) : 1);
      for (++place; place < next; ++place) missing.push_back(list[place]);
    }
    if (places > found) {
      names.notice = fmt::format(
          "{} of {} lines are not in the photo (those at {} s); the others were named by their "
          "places",
          places - found, places, ListText(missing));
    }
  } else if (found == list.size() && JumpsAlike(steps, list)) {
    names.pressure_advance_s = list;
  } else if (const auto first = FirstPlace(line_pattern, list.size(), first_at_bottom)) {
    const auto begin = list.begin() + static_cast<std::ptrdiff_t>(*first);
    names.pressure_advance_s.assign(begin, begin + static_cast<std::ptrdiff_t>(found));
    names.notice = fmt::format(
        "{} of {} lines lie outside of the photo; the others were counted from where the frame "
        "closes beside the {} line, and are those from {} to {} s",
        list.size() - found, list.size(), *first == 0 ? "first" : "last",
        names.pressure_advance_s.front(), names.pressure_advance_s.back());
  } else {
    names.refusal = DescribeCount(line_pattern, list.size());
    if (found == list.size()) {
      names.refusal = fmt::format(
          "{} lines with {} empty places between them do not fit the {} values "
          "of the PA list, whose steps are wide elsewhere: check the list",
          found, places - found, list.size());
    }
  }
  return names;
}

}  // namespace trammel::pressure_advance
