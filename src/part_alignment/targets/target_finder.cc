#include "part_alignment/targets/target_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/disc_search.h"
#include "part_alignment/targets/picture_check.h"
#include "part_alignment/targets/quieten.h"
#include "part_alignment/targets/ring_reader.h"
#include "part_alignment/targets/row_runs.h"
#include "part_alignment/targets/target_layout.h"

namespace trammel::part_alignment {
namespace {

constexpr int kCell_px = 4;
constexpr std::uint8_t kDone = 255;  ///< a cell of a disc that has been judged
constexpr double kSmallestSeen_px = 3;
constexpr double kNoisy = 2.4;   ///< grey levels from which on discs are looked for with less noise
constexpr double kFaintest = 6;  ///< grey levels of contrast of what is looked at
constexpr double kSmall_px = 6;  ///< below it, less noise would blur the ring too much

std::optional<std::string> FindProblem(const PageView& picture, const FinderOptions& options) {
  if (auto problem = PictureProblem(picture)) return problem;
  if (!(options.min_radius_px >= kSmallestSeen_px && options.min_radius_px <= 1000)) {
    return fmt::format("min_radius_px = {}: must be in {} ... 1000", options.min_radius_px,
                       kSmallestSeen_px);
  }
  if (!(options.max_radius_px >= options.min_radius_px && options.max_radius_px <= 5000)) {
    return fmt::format("max_radius_px = {}: must be in min_radius_px = {} ... 5000",
                       options.max_radius_px, options.min_radius_px);
  }
  if (!(options.min_contrast >= 8 && options.min_contrast <= 255)) {
    return fmt::format("min_contrast = {}: must be in 8 ... 255", options.min_contrast);
  }
  return std::nullopt;
}

double SemiMinor(const DiscModel& disc) {
  return 1 / (0.5 * (disc.wxx + disc.wyy) + std::hypot(0.5 * (disc.wxx - disc.wyy), disc.wxy));
}

/// What |I(x + 1) - I(x - 1)| must reach to be an edge and not noise.
int EdgeStep(double min_contrast, double difference_noise) {
  constexpr int kMost = 24;  // busy pictures are not noisy ones
  constexpr double kBlurredEdge = 0.3;
  constexpr double kSigmas = 3.5;
  return std::clamp(static_cast<int>(std::ceil(
                        std::max(kBlurredEdge * min_contrast, kSigmas * difference_noise))),
                    4, kMost);
}

/// One picture's search.
class Search {
 public:
  Search(const PageView& picture, const CodeBook& book, const FinderOptions& options,
         FinderWorkspace& workspace)
      : picture_(picture),
        book_(book),
        options_(options),
        workspace_(workspace),
        quiet_(picture),
        noise_(PixelNoise(picture)) {
    constexpr double kDifferenceNoise = 1.414;  // of two pixels
    edge_step_ = EdgeStep(kFaintest, kDifferenceNoise * noise_);
    if (noise_ > kNoisy) {
      Quieten(picture, workspace_.quiet);
      quiet_.data = workspace_.quiet.data();
      quiet_.stride = picture.width;
      constexpr double kQuietDifferenceNoise = 0.484;  // sqrt(10 / 16 * 6 / 16)
      edge_step_ = EdgeStep(kFaintest, kQuietDifferenceNoise * noise_);
    }
    columns_ = picture.width / kCell_px + 1;
    workspace_.seen.assign(static_cast<std::size_t>(columns_) *
                               static_cast<std::size_t>(picture.height / kCell_px + 1),
                           0);
  }

  FoundTargets Run() {
    RunRules rules;
    rules.min_px = static_cast<int>(kSmallestSeen_px);
    rules.max_px = static_cast<int>(2 * options_.max_radius_px) + 2;
    rules.min_contrast = static_cast<int>(kFaintest);
    rules.edge_step = edge_step_;
    // The widest chord of a disc of the least radius passes within half a step of its middle.
    const int step = std::max(2, static_cast<int>(options_.min_radius_px));
    std::vector<part_alignment::Run> runs;
    // Rows far apart first: they meet the large discs, whose targets are then done with before
    // every row of them is looked at.
    for (const auto& [first, spacing] : {std::pair{0, 8}, {4, 8}, {2, 4}, {1, 2}}) {
      for (int row = step / 2 + first * step; row < picture_.height; row += spacing * step) {
        RunsOfRow(quiet_, row, rules, workspace_.edges, runs);
        for (const part_alignment::Run& run : runs) Examine(run);
      }
    }
    RejectDoubled();
    std::sort(found_.targets.begin(), found_.targets.end(),
              [](const FoundTarget& a, const FoundTarget& b) {
                if (a.number != b.number) return a.number < b.number;
                return a.disc.row_px < b.disc.row_px;
              });
    std::sort(found_.rejected.begin(), found_.rejected.end(),
              [](const RejectedTarget& a, const RejectedTarget& b) { return a.row_px < b.row_px; });
    return std::move(found_);
  }

 private:
  [[nodiscard]] std::uint8_t& SeenAt(double column, double row) {
    const int x = std::clamp(static_cast<int>(column), 0, picture_.width - 1) / kCell_px;
    const int y = std::clamp(static_cast<int>(row), 0, picture_.height - 1) / kCell_px;
    return workspace_.seen[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                           static_cast<std::size_t>(x)];
  }

  void Examine(const part_alignment::Run& run) {
    const bool dark = run.inside < run.outside;
    if (options_.polarity == (dark ? Polarity::kBrightOnDark : Polarity::kDarkOnBright)) return;
    if (SeenAt(0.5 * (run.first + run.last), run.row) == kDone) return;
    const std::optional<Middle> middle = MiddleOf(run);
    if (!middle) return;
    std::uint8_t& seen = SeenAt(middle->column_px, middle->row_px);
    // A row close to a disc's rim may mislead; what misleads three rows is no disc.
    constexpr int kMostTries = 3;
    if (seen >= kMostTries) return;
    ++seen;
    const std::optional<DiscModel> disc = RoughDisc(quiet_, *middle, dark, kFaintest);
    if (!disc) {
      RejectRinged(ModelOf(*middle), RejectReason::kDamaged);
      return;
    }
    const double radius = MeanRadius(*disc);
    constexpr double kRoughError_px = 0.2;
    if (radius < kSmallestSeen_px - kRoughError_px || radius > options_.max_radius_px) return;
    if (SeenAt(disc->column_px, disc->row_px) == kDone) return;
    // Later rows cross the same disc, and the ring that was read.
    constexpr double kOfDisc = 0.85;
    constexpr double kOfTarget = 3.4;  // short of where another target may begin
    MarkDone(*disc, Judge(*disc) ? kOfTarget : kOfDisc);
  }

  /// With the threshold between the shades of disc and surroundings; where a shadow's edge is near,
  /// of the shaded ones.
  [[nodiscard]] std::optional<Middle> MiddleOf(const part_alignment::Run& run) const {
    const auto walked = WalkToMiddle(quiet_, run, kSmallestSeen_px, options_.max_radius_px);
    constexpr double kUnlike = 0.8;
    if (walked ||
        std::abs(run.nearer - run.inside) > kUnlike * std::abs(run.outside - run.inside)) {
      return walked;
    }
    part_alignment::Run shaded = run;
    shaded.outside = run.nearer;
    return WalkToMiddle(quiet_, shaded, kSmallestSeen_px, options_.max_radius_px);
  }

  [[nodiscard]] static DiscModel ModelOf(const Middle& middle) {
    const double det = middle.xx * middle.yy - middle.xy * middle.xy;
    DiscModel model;
    model.column_px = middle.column_px;
    model.row_px = middle.row_px;
    model.wxx = middle.yy / det;
    model.wxy = -middle.xy / det;
    model.wyy = middle.xx / det;
    return model;
  }

  /// Names what has ink in pieces about it, once; whether it has.
  bool RejectRinged(const DiscModel& disc, RejectReason reason) {
    const RingLike like = LooksRinged(quiet_, disc);
    if (like == RingLike::kNone) return false;
    Reject(like == RingLike::kUneven ? RejectReason::kUneven : reason, disc);
    constexpr double kOfTarget = 3;
    MarkDone(disc, kOfTarget);
    return true;
  }

  /// The cells whose middle is within so many radii, and the disc's own.
  void MarkDone(const DiscModel& disc, double radii) {
    SeenAt(disc.column_px, disc.row_px) = kDone;
    constexpr double kMiddle = 0.5 * (kCell_px - 1);
    // |W d| <= radii along a row: a dx² + 2 b dx dy + c dy² <= radii².
    const double a = disc.wxx * disc.wxx + disc.wxy * disc.wxy;
    const double b = disc.wxy * (disc.wxx + disc.wyy);
    const double det = disc.wxx * disc.wyy - disc.wxy * disc.wxy;
    const double half_y = radii * std::sqrt(a) / det;
    const auto cell = [](double place, int end) {
      return static_cast<int>(
          std::clamp((place - kMiddle) / kCell_px + 1, 0.0, static_cast<double>(end)));
    };
    const int rows = picture_.height / kCell_px + 1;
    const int last = cell(disc.row_px + half_y, rows);
    for (int row = cell(disc.row_px - half_y, rows); row < last; ++row) {
      const double dy = row * kCell_px + kMiddle - disc.row_px;
      const double middle = disc.column_px - b / a * dy;
      const double half =
          std::sqrt(std::max(0.0, radii * radii / a - det * det * dy * dy / (a * a)));
      const auto cells = workspace_.seen.begin() + static_cast<std::ptrdiff_t>(row) * columns_;
      const int begin = cell(middle - half, columns_);
      std::fill(cells + begin, cells + std::max(begin, cell(middle + half, columns_)), kDone);
    }
  }

  void Reject(RejectReason reason, const DiscModel& disc, std::optional<int> number = {}) {
    found_.rejected.push_back({reason, disc.column_px, disc.row_px, MeanRadius(disc), number});
  }

  /// In the picture with the noise that suits the ring's size; if that is unclear, in the other.
  [[nodiscard]] RingReading Read(const DiscModel& disc) const {
    const bool small = SemiMinor(disc) < kSmall_px;
    const RingReading reading = ReadRing(small ? picture_ : quiet_, disc, book_.bits);
    if (reading.state != RingState::kUnclear || noise_ <= kNoisy) return reading;
    const RingReading other = ReadRing(small ? quiet_ : picture_, disc, book_.bits);
    return other.state == RingState::kClear ? other : reading;
  }

  [[nodiscard]] bool IsFaint(const DiscModel& disc) const {
    return std::abs(disc.contrast) < options_.min_contrast;
  }

  /// Whether a member of the book was read.
  bool Judge(const DiscModel& disc) {
    const RingReading ring = Read(disc);
    switch (ring.state) {
      case RingState::kClutter:
        RejectRinged(disc, RejectReason::kHidden);
        return false;
      case RingState::kNone:
        if (options_.plain_discs && !IsFaint(disc)) Measure(disc, ring, std::nullopt);
        return false;
      case RingState::kUnclear:
        Reject(IsFaint(disc) ? RejectReason::kFaint : RejectReason::kHidden, disc);
        return false;
      case RingState::kCutOff:
        if (IsFaint(disc)) return false;  // of a faint thing half a ring tells nothing
        Reject(RejectReason::kAtBorder, disc);
        return false;
      case RingState::kClear:
        break;
    }
    if (IsFaint(disc)) {
      Reject(RejectReason::kFaint, disc);
      return false;
    }
    const std::uint32_t other_way = ReversedWord(book_.bits, ring.word);
    const std::optional<int> number =
        TargetNumber(book_, options_.mirrored ? other_way : ring.word);
    if (number) {
      Measure(disc, ring, number);
      return true;
    }
    const bool mirrored =
        TargetNumber(book_, options_.mirrored ? ring.word : other_way).has_value();
    Reject(mirrored ? RejectReason::kMirrored : RejectReason::kWrongCode, disc);
    return false;
  }

  void Measure(const DiscModel& rough, const RingReading& ring, std::optional<int> number) {
    if (MeanRadius(rough) < options_.min_radius_px) {
      Reject(RejectReason::kTooSmall, rough, number);
      return;
    }
    const RingShade shade = number ? ShadeOf(ring, book_.bits) : RingShade{};
    const std::optional<DiscFit> fit = FitDisc(picture_, rough, shade);
    if (!fit) {
      Reject(RejectReason::kDamaged, rough, number);
      return;
    }
    // An edge that light has driven to white within a pixel leaves next to nothing to fit.
    constexpr double kMostSaturated = 0.9;
    if (fit->saturated > kMostSaturated * fit->samples) {
      Reject(RejectReason::kSaturated, rough, number);
      return;
    }
    // What is no blurred ellipse fits worse than the picture's noise lets expect.
    const double most_noise = 3 + 0.06 * std::abs(fit->model.contrast) + noise_;
    if (fit->noise > most_noise) {
      Reject(RejectReason::kDamaged, rough, number);
      return;
    }
    found_.targets.push_back(Describe(*fit, ring, number));
  }

  static FoundTarget Describe(const DiscFit& fit, const RingReading& ring,
                              std::optional<int> number) {
    const DiscModel& m = fit.model;
    FoundTarget target;
    target.number = number;
    target.disc = EllipseOf(m);
    // Blur draws the half-way line of a convex edge inwards, by blur² / (2 r).
    const double drawn_in = 0.5 * m.blur_px * m.blur_px / MeanRadius(m);
    target.disc.semi_major_px += drawn_in;
    target.disc.semi_minor_px += drawn_in;
    target.sigma_column_px = fit.sigma_column_px;
    target.sigma_row_px = fit.sigma_row_px;
    target.contrast = m.contrast;
    target.noise = fit.noise;
    target.blur_px = m.blur_px;
    target.ring_start_rad = ring.start_rad;
    target.saturated_share = static_cast<double>(fit.saturated) / fit.samples;
    return target;
  }

  void RejectDoubled() {
    std::vector<FoundTarget> once;
    for (const FoundTarget& target : found_.targets) {
      const auto same =
          std::count_if(found_.targets.begin(), found_.targets.end(),
                        [&](const FoundTarget& other) { return other.number == target.number; });
      if (!target.number || same == 1) {
        once.push_back(target);
      } else {
        found_.rejected.push_back(
            {RejectReason::kDoubled, target.disc.column_px, target.disc.row_px,
             std::sqrt(target.disc.semi_major_px * target.disc.semi_minor_px), target.number});
      }
    }
    found_.targets = std::move(once);
  }

  const PageView& picture_;
  const CodeBook& book_;
  const FinderOptions& options_;
  FinderWorkspace& workspace_;
  PageView quiet_;  ///< the picture where it is little noisy, else with less noise
  double noise_ = 0;
  int edge_step_ = 0;
  int columns_ = 0;
  FoundTargets found_;
};

}  // namespace

std::string_view ToString(RejectReason reason) {
  switch (reason) {
    case RejectReason::kMirrored:
      return "mirrored";
    case RejectReason::kWrongCode:
      return "wrong_code";
    case RejectReason::kDoubled:
      return "doubled";
    case RejectReason::kHidden:
      return "hidden";
    case RejectReason::kAtBorder:
      return "at_border";
    case RejectReason::kTooSmall:
      return "too_small";
    case RejectReason::kSaturated:
      return "saturated";
    case RejectReason::kDamaged:
      return "damaged";
    case RejectReason::kFaint:
      return "faint";
    case RejectReason::kUneven:
      return "uneven_light";
  }
  return "";
}

Result<FoundTargets> FindTargets(const PageView& picture, const CodeBook& book,
                                 const FinderOptions& options, FinderWorkspace& workspace) {
  if (const auto problem = FindProblem(picture, options)) return Fail(*problem);
  if (book.bits != 12 && book.bits != 14 && book.bits != 20) {
    return Fail(fmt::format("code book of {} bits: must be one of MakeCodeBook", book.bits));
  }
  return Search(picture, book, options, workspace).Run();
}

}  // namespace trammel::part_alignment
