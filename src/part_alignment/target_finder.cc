#include "part_alignment/target_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "part_alignment/disc_fit.h"
#include "part_alignment/disc_search.h"
#include "part_alignment/ring_reader.h"
#include "part_alignment/target_layout.h"

namespace trammel::part_alignment {
namespace {

constexpr int kCell_px = 4;
constexpr std::uint8_t kDone = 255;  ///< a cell of a disc that has been judged
constexpr double kSmallestSeen_px = 3;

std::optional<std::string> FindProblem(const PageView& picture, const FinderOptions& options) {
  constexpr int kLeastSide = 16;
  constexpr int kMostSide = 32767;
  if (picture.data == nullptr || picture.channels != 1) {
    return fmt::format("picture with {} channels: targets are looked for in grey, 1 channel",
                       picture.channels);
  }
  if (std::min(picture.width, picture.height) < kLeastSide ||
      std::max(picture.width, picture.height) > kMostSide) {
    return fmt::format("picture of {} x {} px: must have {} ... {} px a side", picture.width,
                       picture.height, kLeastSide, kMostSide);
  }
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

/// The word of the ring's mirror image.
std::uint32_t Reversed(int bits, std::uint32_t word) {
  std::uint32_t reversed = 0;
  for (int k = 0; k < bits; ++k) reversed |= (word >> k & 1U) << (bits - 1 - k);
  return reversed;
}

/// What |I(x + 1) - I(x - 1)| must reach to be an edge and not noise: a blurred edge of the least
/// contrast, or 4.5 sigma of what most of the picture shows.
int EdgeStep(const PageView& picture, double min_contrast) {
  constexpr int kMost = 24;  // busy pictures are not noisy ones
  std::array<int, 256> histogram{};
  int count = 0;
  const int step = std::max(1, picture.height / 16);
  for (int y = step / 2; y < picture.height; y += step) {
    const std::uint8_t* row = picture.row(y);
    for (int x = 1; x < picture.width - 1; x += 4) {
      ++histogram[static_cast<std::size_t>(std::abs(row[x + 1] - row[x - 1]))];
      ++count;
    }
  }
  int median = 0;
  for (int below = histogram[0]; 2 * below < count; below += histogram[median]) ++median;
  constexpr double kSigmaOfMedian = 1.4826;
  const double noise = kSigmaOfMedian * median;
  return std::clamp(static_cast<int>(std::max(0.3 * min_contrast, 4.5 * noise)), 5, kMost);
}

/// One picture's search.
class Search {
 public:
  Search(const PageView& picture, const CodeBook& book, const FinderOptions& options,
         FinderWorkspace& workspace)
      : picture_(picture), book_(book), options_(options), workspace_(workspace) {
    columns_ = picture.width / kCell_px + 1;
    workspace_.seen.assign(static_cast<std::size_t>(columns_) *
                               static_cast<std::size_t>(picture.height / kCell_px + 1),
                           0);
  }

  FoundTargets Run() {
    RunRules rules;
    rules.min_px = static_cast<int>(kSmallestSeen_px);
    rules.max_px = static_cast<int>(2 * options_.max_radius_px) + 2;
    rules.min_contrast = static_cast<int>(options_.min_contrast);
    rules.edge_step = EdgeStep(picture_, options_.min_contrast);
    // The widest chord of a disc of the least radius passes within half a step of its middle.
    const int step = std::max(2, static_cast<int>(options_.min_radius_px));
    std::vector<part_alignment::Run> runs;
    for (int row = step / 2; row < picture_.height; row += step) {
      RunsOfRow(picture_, row, rules, workspace_.edges, runs);
      for (const part_alignment::Run& run : runs) Examine(run);
    }
    RejectDoubled();
    std::sort(found_.targets.begin(), found_.targets.end(),
              [](const FoundTarget& a, const FoundTarget& b) {
                if (a.number != b.number) return a.number < b.number;
                return a.disc.row_px < b.disc.row_px;
              });
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
    const std::optional<Middle> middle = WalkToMiddle(picture_, run, options_.max_radius_px);
    if (!middle) return;
    std::uint8_t& seen = SeenAt(middle->column_px, middle->row_px);
    // A row close to a disc's rim may mislead; what misleads three rows is no disc.
    constexpr int kMostTries = 3;
    if (seen >= kMostTries) return;
    ++seen;
    const std::optional<DiscModel> disc = RoughDisc(picture_, run, *middle);
    if (!disc || std::abs(disc->contrast) < options_.min_contrast) return;
    const double radius = MeanRadius(*disc);
    if (radius > options_.max_radius_px) return;
    if (SeenAt(disc->column_px, disc->row_px) == kDone) return;
    // Later rows cross the same disc.
    const double inner = 0.7 * radius;
    for (double y = -inner; y < inner + kCell_px; y += kCell_px) {
      for (double x = -inner; x < inner + kCell_px; x += kCell_px) {
        SeenAt(disc->column_px + std::min(x, inner), disc->row_px + std::min(y, inner)) = kDone;
      }
    }
    Judge(*disc);
  }

  void Reject(RejectReason reason, const DiscModel& disc, std::optional<int> number = {}) {
    found_.rejected.push_back({reason, disc.column_px, disc.row_px, MeanRadius(disc), number});
  }

  void Judge(const DiscModel& disc) {
    const RingReading ring = ReadRing(picture_, disc, book_.bits);
    switch (ring.state) {
      case RingState::kClutter:
        return;
      case RingState::kNone:
        if (options_.plain_discs) Measure(disc, ring, std::nullopt);
        return;
      case RingState::kUnclear:
        Reject(RejectReason::kHidden, disc);
        return;
      case RingState::kCutOff:
        Reject(RejectReason::kAtBorder, disc);
        return;
      case RingState::kClear:
        break;
    }
    const std::uint32_t other_way = Reversed(book_.bits, ring.word);
    const std::optional<int> number =
        TargetNumber(book_, options_.mirrored ? other_way : ring.word);
    if (!number) {
      const bool mirrored =
          TargetNumber(book_, options_.mirrored ? ring.word : other_way).has_value();
      Reject(mirrored ? RejectReason::kMirrored : RejectReason::kWrongCode, disc);
    } else {
      Measure(disc, ring, number);
    }
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
    // What is no blurred ellipse fits worse than noise of any camera.
    const double most_noise = 3 + 0.06 * std::abs(fit->model.contrast);
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
    const double mean = 0.5 * (m.wxx + m.wyy);
    const double spread = std::hypot(0.5 * (m.wxx - m.wyy), m.wxy);
    target.disc.column_px = m.column_px;
    target.disc.row_px = m.row_px;
    // Blur draws the half-way line of a convex edge inwards, by blur² / (2 r).
    const double drawn_in = 0.5 * m.blur_px * m.blur_px / MeanRadius(m);
    target.disc.semi_major_px = 1 / (mean - spread) + drawn_in;
    target.disc.semi_minor_px = 1 / (mean + spread) + drawn_in;
    // The long axis is where W is small.
    target.disc.angle_rad = 0.5 * std::atan2(-2 * m.wxy, m.wyy - m.wxx);
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
