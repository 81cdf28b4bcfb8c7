#include "part_alignment/targets/ring_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/page.h"
#include "part_alignment/targets/blob_search.h"
#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/quieten.h"
#include "part_alignment/targets/ring_reader.h"
#include "part_alignment/targets/target.h"

namespace trammel::part_alignment {
namespace {

class SeenCells {
 public:
  static constexpr std::uint8_t kDone = 255;  ///< disc already judged

  /// @param cells  memory, kept by the caller.
  SeenCells(int width, int height, std::vector<std::uint8_t>& cells)
      : columns_(width / kCell_px + 1), rows_(height / kCell_px + 1), cells_(cells) {
    cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
  }

  /// Returns the nearest cell.
  [[nodiscard]] std::uint8_t& At(double column_px, double row_px) {
    const int x = std::clamp(static_cast<int>(column_px) / kCell_px, 0, columns_ - 1);
    const int y = std::clamp(static_cast<int>(row_px) / kCell_px, 0, rows_ - 1);
    return cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(x)];
  }

  [[nodiscard]] bool IsDone(double column_px, double row_px) {
    return At(column_px, row_px) == kDone;
  }

  /// Marks the cells whose middle is within so many radii of a disc, and the disc's own.
  void MarkDone(const DiscModel& disc, double radii) {
    At(disc.column_px, disc.row_px) = kDone;
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
    const int last = cell(disc.row_px + half_y, rows_);
    for (int row = cell(disc.row_px - half_y, rows_); row < last; ++row) {
      const double dy = row * kCell_px + kMiddle - disc.row_px;
      const double middle = disc.column_px - b / a * dy;
      const double half =
          std::sqrt(std::max(0.0, radii * radii / a - det * det * dy * dy / (a * a)));
      const auto cells = cells_.begin() + static_cast<std::ptrdiff_t>(row) * columns_;
      const int begin = cell(middle - half, columns_);
      std::fill(cells + begin, cells + std::max(begin, cell(middle + half, columns_)), kDone);
    }
  }

 private:
  static constexpr int kCell_px = 4;
  int columns_;
  int rows_;
  std::vector<std::uint8_t>& cells_;
};

/// Returns the fault of a picture: not 8-bit grey, a side below 16 or above 32,767 px; absent if it
/// is usable.
std::optional<std::string> PictureProblem(const PageView& picture) {
  constexpr int kMinSide = 16;
  constexpr int kMaxSide = 32767;
  if (picture.data == nullptr || picture.channels != 1) {
    return fmt::format("picture with {} channels: targets are looked for in grey, 1 channel",
                       picture.channels);
  }
  if (std::min(picture.width, picture.height) < kMinSide ||
      std::max(picture.width, picture.height) > kMaxSide) {
    return fmt::format("picture of {} x {} px: must have {} ... {} px a side", picture.width,
                       picture.height, kMinSide, kMaxSide);
  }
  return std::nullopt;
}

constexpr double kSmallestSeen_px = 3;
constexpr double kFaintest = 6;    ///< grey levels of contrast of what is looked at
constexpr double kOfTarget = 3.4;  ///< radii, short of where another target may begin
constexpr double kSmall_px = 6;    ///< below it, less noise would blur the ring too much

// Flags of a cell that is not finished.
constexpr std::uint8_t kRingSeen = 128;  ///< something with a ring, in the middle of which it lies

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

/// Clear ring that is not in the book: for example one read in a target's ring around a gap of it.
struct WrongCode {
  DiscModel disc;
  RejectReason reason;
};

/// Search of one picture.
class Search {
 public:
  Search(const PageView& picture, const CodeBook& book, const FinderOptions& options,
         FinderWorkspace& workspace)
      : picture_(picture),
        book_(book),
        options_(options),
        seen_(picture.width, picture.height, workspace.seen),
        noise_(PixelNoise(picture)),
        quiet_(Quieten(picture, workspace.quiet)),
        shown_(noise_ > kNoisy ? quiet_ : picture) {}

  FoundTargets Run() {
    const BlobRules blobs{noise_, kSmallestSeen_px, options_.max_radius_px};
    for (const Blob& blob : FindBlobs(quiet_, blobs)) Examine(blob);
    // All codes are read by now: wrong ones inside a read target are dropped.
    RejectWrong();
    RejectUnread();
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
  void Examine(const Blob& blob) {
    const Middle& middle = blob.middle;
    if (seen_.IsDone(middle.column_px, middle.row_px)) return;
    const std::optional<DiscModel> disc = RoughDisc(shown_, middle, blob.dark, kFaintest);
    if (!disc) {
      NoteUnread(ModelOf(middle, blob.dark), RejectReason::kDamaged);
      return;
    }
    const double radius = MeanRadius(*disc);
    constexpr double kRoughError_px = 0.2;
    if (radius < kSmallestSeen_px - kRoughError_px || radius > options_.max_radius_px) return;
    if (!seen_.IsDone(disc->column_px, disc->row_px)) Judge(*disc);
  }

  [[nodiscard]] static DiscModel ModelOf(const Middle& middle, bool dark) {
    const double det = middle.xx * middle.yy - middle.xy * middle.xy;
    DiscModel model;
    model.column_px = middle.column_px;
    model.row_px = middle.row_px;
    model.wxx = middle.yy / det;
    model.wxy = -middle.xy / det;
    model.wyy = middle.xx / det;
    model.contrast = dark ? -1 : 1;
    return model;
  }

  /// Notes a disc with pieces of ink about it, to be named after the search.
  void NoteUnread(const DiscModel& disc, RejectReason reason) {
    std::uint8_t& seen = seen_.At(disc.column_px, disc.row_px);
    if ((seen & kRingSeen) != 0) return;
    const std::optional<RingEvidence> ring = FindRingEvidence(picture_, disc, noise_);
    if (!ring) return;
    unread_.push_back({disc, *ring, reason});
    seen |= kRingSeen;
  }

  void RejectWrong() {
    for (const WrongCode& one : wrong_) {
      if (seen_.IsDone(one.disc.column_px, one.disc.row_px)) continue;
      Reject(one.reason, one.disc);
      seen_.MarkDone(one.disc, kOfTarget);
    }
  }

  void RejectUnread() {
    std::erase_if(unread_, [this](const UnreadTarget& one) {
      return seen_.IsDone(one.disc.column_px, one.disc.row_px);
    });
    LeaveOutParts(unread_);
    for (const UnreadTarget& one : unread_) {
      const bool faint = std::abs(one.ring.contrast) < options_.min_contrast;
      Reject(one.ring.uneven ? RejectReason::kUneven
             : faint         ? RejectReason::kFaint
                             : one.reason,
             one.disc);
    }
  }

  void Reject(RejectReason reason, const DiscModel& disc, std::optional<int> number = {}) {
    found_.rejected.push_back({reason, disc.column_px, disc.row_px, MeanRadius(disc), number});
  }

  /// Reads the ring in the picture with the noise that suits its size; if unclear, in the other.
  [[nodiscard]] RingReading Read(const DiscModel& disc) const {
    const bool small = SemiMinor(disc) < kSmall_px;
    const RingReading reading = ReadRing(small ? picture_ : shown_, disc, book_.bits);
    if (reading.state != RingState::kUnclear || noise_ <= kNoisy) return reading;
    const RingReading other = ReadRing(small ? shown_ : picture_, disc, book_.bits);
    return other.state == RingState::kClear ? other : reading;
  }

  [[nodiscard]] bool IsFaint(const DiscModel& disc) const {
    return std::abs(disc.contrast) < options_.min_contrast;
  }

  [[nodiscard]] std::uint32_t AsPrinted(std::uint32_t seen) const {
    return options_.mirrored ? ReversedWord(book_.bits, seen) : seen;
  }

  /// Returns the reason for a clear ring that is not in the book.
  [[nodiscard]] RejectReason ReasonFor(const DiscModel& disc, const RingReading& ring) const {
    if (IsFaint(disc)) return RejectReason::kFaint;
    const std::uint32_t in_mirror = ReversedWord(book_.bits, AsPrinted(ring.word));
    return TargetNumber(book_, in_mirror) ? RejectReason::kMirrored : RejectReason::kWrongCode;
  }

  /// Reads and measures the disc's target, or records the reason why not.
  void Judge(const DiscModel& disc) {
    constexpr double kOfDisc = 0.85;
    const RingReading ring = Read(disc);
    std::optional<int> number;
    double done_radii = kOfDisc;
    switch (ring.state) {
      case RingState::kClutter:
        NoteUnread(disc, RejectReason::kHidden);
        return;
      case RingState::kNone:
        if (!options_.plain_discs || IsFaint(disc)) return;
        Measure(disc, ring, std::nullopt);
        break;
      case RingState::kUnclear:
        Reject(IsFaint(disc) ? RejectReason::kFaint : RejectReason::kHidden, disc);
        break;
      case RingState::kCutOff:
        if (IsFaint(disc)) return;  // half a ring of a faint disc proves nothing
        Reject(RejectReason::kAtBorder, disc);
        break;
      case RingState::kClear:
        if (!IsFaint(disc)) number = TargetNumber(book_, AsPrinted(ring.word));
        if (!number) {
          wrong_.push_back({disc, ReasonFor(disc, ring)});
          return;
        }
        done_radii = kOfTarget;
        Measure(disc, ring, number);
        break;
    }
    // Others may show the same disc, and the ring that was read.
    seen_.MarkDone(disc, done_radii);
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
    // An edge that light saturates within a pixel has next to nothing to fit.
    constexpr double kMaxSaturated = 0.9;
    if (fit->saturated > kMaxSaturated * fit->samples) {
      Reject(RejectReason::kSaturated, rough, number);
      return;
    }
    // Anything but a blurred ellipse fits worse than the picture's noise explains.
    const double max_noise = 3 + 0.06 * std::abs(fit->model.contrast) + noise_;
    if (fit->noise > max_noise) {
      Reject(RejectReason::kDamaged, rough, number);
      return;
    }
    found_.targets.push_back(Describe(*fit, number));
  }

  static FoundTarget Describe(const DiscFit& fit, std::optional<int> number) {
    const DiscModel& m = fit.model;
    FoundTarget target;
    target.number = number;
    target.disc = EllipseOf(m);
    // Blur shifts the half-way line of a convex edge inwards, by blur² / (2 r).
    const double drawn_in = 0.5 * m.blur_px * m.blur_px / MeanRadius(m);
    target.disc.semi_major_px += drawn_in;
    target.disc.semi_minor_px += drawn_in;
    target.sigma_column_px = fit.sigma_column_px;
    target.sigma_row_px = fit.sigma_row_px;
    target.contrast = m.contrast;
    target.noise = fit.noise;
    target.blur_px = m.blur_px;
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
  SeenCells seen_;
  std::vector<UnreadTarget> unread_;
  std::vector<WrongCode> wrong_;
  double noise_;
  PageView quiet_;  ///< the picture with less noise
  PageView shown_;  ///< smoothed picture if noisy, else the original
  FoundTargets found_;
};

}  // namespace

Page GreyPicture(int width, int height, std::span<const std::uint8_t> bgr) {
  Page page{width, height, 1, {}, {}, {}};
  page.samples.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  TRAMMEL_CHECK(bgr.size() == 3 * page.samples.size(), "{} bytes of {} x {} px", bgr.size(), width,
                height);
  for (std::size_t i = 0; i < page.samples.size(); ++i) {
    const std::uint8_t* pixel = &bgr[3 * i];
    page.samples[i] =
        static_cast<std::uint8_t>((29 * pixel[0] + 150 * pixel[1] + 77 * pixel[2] + 128) >> 8U);
  }
  return page;
}

Result<FoundTargets> FindTargets(const PageView& picture, const CodeBook& book,
                                 const FinderOptions& options, FinderWorkspace& workspace) {
  if (const auto problem = FindProblem(picture, options)) return Fail(*problem);
  // Pixel positions have 31 bits: rows that are far apart are copied together.
  constexpr std::ptrdiff_t kFarthest = 65535;
  if (picture.stride > kFarthest) {
    Page together{picture.width, picture.height, 1, {}, {}, {}};
    for (int row = 0; row < picture.height; ++row) {
      together.samples.insert(together.samples.end(), picture.row(row),
                              picture.row(row) + picture.width);
    }
    return FindTargets(together.view(), book, options, workspace);
  }
  if (book.bits != 12 && book.bits != 14 && book.bits != 20) {
    return Fail(fmt::format("code book of {} bits: must be one of MakeCodeBook", book.bits));
  }
  return Search(picture, book, options, workspace).Run();
}

}  // namespace trammel::part_alignment
