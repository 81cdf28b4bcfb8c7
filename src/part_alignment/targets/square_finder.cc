#include "part_alignment/targets/square_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "part_alignment/targets/picture_check.h"
#include "part_alignment/targets/square_centre.h"
#include "part_alignment/targets/square_edge.h"
#include "part_alignment/targets/square_reader.h"

namespace trammel::part_alignment {
namespace {

using Corners = std::array<ImagePoint, 4>;

std::optional<std::string> FindProblem(const PageView& picture,
                                       const SquareFinderOptions& options) {
  constexpr double kSmallest_px = 14;
  constexpr double kLargest_px = 5000;
  if (auto problem = PictureProblem(picture)) return problem;
  if (!(options.min_side_px >= kSmallest_px && options.min_side_px <= kLargest_px)) {
    return fmt::format("min_side_px = {}: must be in {} ... {}", options.min_side_px, kSmallest_px,
                       kLargest_px);
  }
  if (!(options.max_side_px >= options.min_side_px && options.max_side_px <= kLargest_px)) {
    return fmt::format("max_side_px = {}: must be in min_side_px = {} ... {}", options.max_side_px,
                       options.min_side_px, kLargest_px);
  }
  if (!(options.min_contrast >= 8 && options.min_contrast <= 255)) {
    return fmt::format("min_contrast = {}: must be in 8 ... 255", options.min_contrast);
  }
  return std::nullopt;
}

double ShortestSide(const Corners& c) {
  double least = Distance(c[0], c[3]);
  for (std::size_t k = 0; k < 3; ++k) least = std::min(least, Distance(c[k], c[k + 1]));
  return least;
}

double MeanSide(const Corners& c) {
  double sum = Distance(c[0], c[3]);
  for (std::size_t k = 0; k < 3; ++k) sum += Distance(c[k], c[k + 1]);
  return sum / 4;
}

/// One edge of a marker that has been read, k from the first corner on clockwise.
EdgeStart StartOf(const Corners& corners, const SquareModules& modules, std::size_t k) {
  constexpr double kCertain = 0.8;  // of a module of white
  EdgeStart start;
  start.from = corners[k];
  start.to = corners[(k + 1) % 4];
  start.before = corners[(k + 3) % 4];
  start.after = corners[(k + 2) % 4];
  // As if this edge were the upper one.
  const SquarePlane plane(
      {corners[k], corners[(k + 1) % 4], corners[(k + 2) % 4], corners[(k + 3) % 4]});
  std::uint32_t word = modules.word;
  for (std::size_t turn = k; turn < 4 && k > 0; ++turn) word = QuarterTurned(word);
  for (std::size_t i = 0; i < start.behind.size(); ++i) {
    start.behind[i] = plane.At(1 + static_cast<double>(i), 1);
  }
  for (std::size_t i = 0; i < start.white_behind.size(); ++i) {
    start.white_behind[i] = (word >> i & 1U) != 0;
  }
  const ImagePoint above = plane.At(3.5, -kCertain);
  const ImagePoint span{start.to.x - start.from.x, start.to.y - start.from.y};
  start.outer_px = std::abs((above.x - start.from.x) * span.y - (above.y - start.from.y) * span.x) /
                   std::hypot(span.x, span.y);
  start.bright = modules.bright;
  start.dark = modules.dark;
  start.light_x = modules.light_x;
  start.light_y = modules.light_y;
  return start;
}

/// One picture's search.
class Finder {
 public:
  Finder(const PageView& picture, const SquareBook& book, const SquareFinderOptions& options)
      : picture_(picture), book_(book), options_(options) {}

  FoundTargets Run(const std::vector<DarkOutline>& things) {
    for (const DarkOutline& thing : things) {
      if (IsKnown(thing.corners)) continue;
      switch (thing.kind) {
        case DarkOutline::Kind::kQuad:
          Judge(thing.corners);
          break;
        case DarkOutline::Kind::kCutOff:
          Reject(RejectReason::kAtBorder, thing.corners);
          break;
        case DarkOutline::Kind::kOther:
          Reject(RejectReason::kHidden, thing.corners);
          break;
      }
    }
    RejectDoubled();
    ForgetRepeatedRejects();
    std::sort(found_.targets.begin(), found_.targets.end(),
              [](const FoundTarget& a, const FoundTarget& b) { return a.number < b.number; });
    return std::move(found_);
  }

 private:
  /// Whether a marker has been found there already.
  [[nodiscard]] bool IsKnown(const Corners& corners) const {
    constexpr double kSame = 0.35;
    const ImagePoint centre = CrossingOfDiagonals(corners);
    return std::any_of(found_.targets.begin(), found_.targets.end(),
                       [&](const FoundTarget& target) {
                         return Distance(centre, {target.disc.column_px, target.disc.row_px}) <
                                kSame * MeanSide(target.square->corners);
                       });
  }

  void Reject(RejectReason reason, const Corners& corners, std::optional<int> number = {}) {
    const ImagePoint centre = CrossingOfDiagonals(corners);
    found_.rejected.push_back({reason, centre.x, centre.y, 0.5 * MeanSide(corners), number});
  }

  void Judge(const Corners& corners) {
    const SquareModules modules = ReadSquareModules(picture_, corners, options_.min_contrast);
    switch (modules.state) {
      case SquareState::kNone:
        return;
      case SquareState::kUnclear:
        Reject(RejectReason::kHidden, corners);
        return;
      case SquareState::kCutOff:
        Reject(RejectReason::kAtBorder, corners);
        return;
      case SquareState::kClear:
        break;
    }
    const std::uint32_t other_way = MirrorImage(modules.word);
    const auto read = ReadSquareWord(book_, options_.mirrored ? other_way : modules.word);
    if (read) {
      Measure(corners, modules, *read);
      return;
    }
    if (ReadSquareWord(book_, options_.mirrored ? modules.word : other_way)) {
      Reject(RejectReason::kMirrored, corners);
      return;
    }
    Reject(RejectReason::kWrongCode, corners,
           AnySquareId(options_.mirrored ? other_way : modules.word));
  }

  void Measure(const Corners& corners, const SquareModules& modules, const SquareReading& read) {
    if (ShortestSide(corners) < options_.min_side_px) {
      Reject(RejectReason::kTooSmall, corners, read.id);
      return;
    }
    std::array<EdgeFit, 4> edges;
    if (const auto problem = FitEdges(corners, modules, edges)) {
      Reject(*problem, corners, read.id);
      return;
    }
    // Once more, now that it is known where the modules behind the edges are.
    const Corners known = CentreOf(edges).corners;
    const auto problem = FitEdges(known, modules, edges);
    const SquareCentre centre = CentreOf(edges);
    bool elsewhere = false;
    for (std::size_t k = 0; k < 4; ++k) {
      elsewhere =
          elsewhere || !(Distance(centre.corners[k], corners[k]) < 2 + 0.05 * MeanSide(corners));
    }
    if (problem || elsewhere) {
      Reject(problem.value_or(RejectReason::kDamaged), corners, read.id);
      return;
    }
    found_.targets.push_back(Describe(edges, centre, read));
  }

  /// @param edges  of an earlier fit, or as they come by default
  /// @returns What is wrong with an edge.
  [[nodiscard]] std::optional<RejectReason> FitEdges(const Corners& corners,
                                                     const SquareModules& modules,
                                                     std::array<EdgeFit, 4>& edges) const {
    for (std::size_t k = 0; k < 4; ++k) {
      EdgeStart start = StartOf(corners, modules, k);
      start.rough = edges[k].samples == 0;
      if (!start.rough) {
        start.blur_px = edges[k].blur_px;
        start.bright = edges[k].bright;
        start.dark = edges[k].dark;
      }
      const auto fit = FitSquareEdge(picture_, start);
      if (!fit || !IsAnEdge(*fit, modules)) return RejectReason::kDamaged;
      // Light that drives an edge to white or black within a pixel leaves next to nothing to fit.
      constexpr double kMostSaturated = 0.9;
      if (fit->saturated > kMostSaturated * fit->samples) return RejectReason::kSaturated;
      edges[k] = *fit;
    }
    return std::nullopt;
  }

  /// Whether it is as straight and as clean as an edge of a flat sheet.
  [[nodiscard]] static bool IsAnEdge(const EdgeFit& fit, const SquareModules& modules) {
    const double contrast = fit.bright - fit.dark;
    const double most_bow_px = 0.3 + 0.02 * fit.half_length_px;
    return contrast > 0.5 * (modules.bright - modules.dark) && fit.noise < 3 + 0.06 * contrast &&
           std::abs(fit.bow_px) < most_bow_px + 4 * fit.bow_sigma_px;
  }

  [[nodiscard]] FoundTarget Describe(const std::array<EdgeFit, 4>& edges,
                                     const SquareCentre& centre, const SquareReading& read) const {
    FoundTarget target;
    target.number = read.id;
    target.disc.column_px = centre.centre.x;
    target.disc.row_px = centre.centre.y;
    target.sigma_column_px = centre.sigma_column_px;
    target.sigma_row_px = centre.sigma_row_px;
    SquareShape shape;
    for (std::size_t i = 0; i < 4; ++i) {
      // A mirrored marker's corners run the other way round.
      const std::size_t at = (i + static_cast<std::size_t>(read.quarter_turns)) % 4;
      shape.corners[i] = centre.corners[options_.mirrored ? at ^ 1U : at];
      const EdgeFit& edge = edges[options_.mirrored ? (4 - at) % 4 : at];
      shape.bows_px[i] = edge.bow_px;
      shape.bow_sigma_px = std::max(shape.bow_sigma_px, centre.unevenness * edge.bow_sigma_px);
    }
    int samples = 0;
    int saturated = 0;
    for (const EdgeFit& edge : edges) {
      target.contrast += (edge.dark - edge.bright) / 4;
      target.blur_px += edge.blur_px / 4;
      target.noise += edge.noise * edge.noise / 4;
      samples += edge.samples;
      saturated += edge.saturated;
    }
    target.noise = std::sqrt(target.noise);
    target.saturated_share = static_cast<double>(saturated) / samples;
    const Corners& c = shape.corners;
    const double across = 0.25 * (Distance(c[0], c[1]) + Distance(c[3], c[2]));
    const double down = 0.25 * (Distance(c[0], c[3]) + Distance(c[1], c[2]));
    target.disc.semi_major_px = std::max(across, down);
    target.disc.semi_minor_px = std::min(across, down);
    target.ring_start_rad = std::atan2(c[1].y - c[0].y, c[1].x - c[0].x);
    const ImagePoint longer = across >= down ? ImagePoint{c[1].x - c[0].x, c[1].y - c[0].y}
                                             : ImagePoint{c[3].x - c[0].x, c[3].y - c[0].y};
    target.disc.angle_rad = std::atan(longer.y / longer.x);
    target.square = shape;
    return target;
  }

  void RejectDoubled() {
    std::vector<FoundTarget> once;
    for (const FoundTarget& target : found_.targets) {
      const auto same =
          std::count_if(found_.targets.begin(), found_.targets.end(),
                        [&](const FoundTarget& other) { return other.number == target.number; });
      if (same == 1) {
        once.push_back(target);
      } else {
        Reject(RejectReason::kDoubled, target.square->corners, target.number);
      }
    }
    found_.targets = std::move(once);
  }

  /// Other thresholds may have met the same thing. What says most comes first.
  void ForgetRepeatedRejects() {
    std::stable_partition(found_.rejected.begin(), found_.rejected.end(),
                          [](const RejectedTarget& rejected) {
                            return rejected.reason != RejectReason::kHidden &&
                                   rejected.reason != RejectReason::kAtBorder;
                          });
    std::vector<RejectedTarget> kept;
    for (const RejectedTarget& rejected : found_.rejected) {
      const ImagePoint at{rejected.column_px, rejected.row_px};
      const bool repeated =
          std::any_of(kept.begin(), kept.end(),
                      [&](const RejectedTarget& other) {
                        return Distance(at, {other.column_px, other.row_px}) < other.radius_px;
                      }) ||
          std::any_of(found_.targets.begin(), found_.targets.end(), [&](const FoundTarget& t) {
            return Distance(at, {t.disc.column_px, t.disc.row_px}) < t.disc.semi_minor_px;
          });
      if (!repeated) kept.push_back(rejected);
    }
    found_.rejected = std::move(kept);
  }

  const PageView& picture_;
  const SquareBook& book_;
  const SquareFinderOptions& options_;
  FoundTargets found_;
};

}  // namespace

Result<FoundTargets> FindSquares(const PageView& picture, const SquareBook& book,
                                 const SquareFinderOptions& options, SquareWorkspace& workspace) {
  if (const auto problem = FindProblem(picture, options)) return Fail(*problem);
  if (book.ids.empty() || book.ids.size() != book.words.size()) {
    return Fail("book without markers: must be one of MakeSquareBook");
  }
  const SquareRules rules{options.min_side_px, options.max_side_px,
                          static_cast<int>(options.min_contrast)};
  return Finder(picture, book, options).Run(FindDarkOutlines(picture, rules, workspace.outlines));
}

}  // namespace trammel::part_alignment
