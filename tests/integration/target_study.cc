// Rings seen obliquely, from near and far, glossy, shaded, faint, noisy, blurred, covered and
// cut off: how many of twelve are read, how far off, and what is named of the others.
//
// TRAMMEL_STUDY_SEEDS: pictures of each target, 4 without it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string>

#include "alignment_study.h"
#include "part_alignment/targets/ring_finder.h"
#include "support/target_picture.h"

namespace trammel {
namespace {

using part_alignment::CodeBook;
using part_alignment::FoundTargets;
using test::DrawnTarget;
using test::GreyImage;
using test::Look;
using test::PinholeView;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kTargets = 12;

std::uint64_t Seed() { return test::FirstSeedOfStudy(); }
std::uint64_t Pictures() { return test::WorldsOfStudy(4); }

struct Condition {
  PinholeView view;
  double noise = 1;
  Look look;
  int bits = 14;
  /// Distance of the target's middle from the border of the picture, which cuts it, in radii; 0:
  /// the whole target is in it.
  double border_radii = 0;
  double gloss_grey = 0;   ///< a lamp's image somewhere about the disc's edge
  double shadow_left = 1;  ///< a shadow's edge somewhere across the disc
  /// A sector of the target under something plain, from so many radii outwards; 0: none.
  double cover_rad = 0;
  double cover_from_radii = 0;
  double cover_grey = 0;
};

struct Tally {
  int shown = 0;
  int read = 0;
  int wrong = 0;
  double squares = 0;    ///< squared errors of the centre, per axis
  double bound = 0;      ///< Cramér and Rao's, squared
  double in_sigmas = 0;  ///< squares of errors in stated sigmas, per axis
  double worst_sigmas = 0;
  std::map<std::string, int> reasons;
};

/// Computes the lower bound of every unbiased estimate: of the disc alone, all else known.
double BoundSquared(const DrawnTarget& target, const Condition& condition, int side) {
  constexpr double kStep_px = 0.05;
  DrawnTarget ahead = target;
  DrawnTarget behind = target;
  ahead.bits = behind.bits = 0;
  for (int j = 0; j < 3; ++j) {
    ahead.h[0][j] += kStep_px * target.h[2][j];
    behind.h[0][j] -= kStep_px * target.h[2][j];
  }
  const GreyImage a = test::Draw(side, side, {ahead}, condition.look);
  const GreyImage b = test::Draw(side, side, {behind}, condition.look);
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    sum += std::pow((a.values[i] - b.values[i]) / (2 * kStep_px), 2);
  }
  return (condition.noise * condition.noise + 1.0 / 12) / sum;
}

/// Lays the condition's cover on a picture, from a direction on.
void Cover(const DrawnTarget& target, const Condition& condition, double from_rad,
           GreyImage& image) {
  const test::Place middle = test::DiscMiddle(target);
  const auto& h = target.h;
  const double det = h[0][0] * h[1][1] - h[0][1] * h[1][0];
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double u = (h[1][1] * (x - middle.column) - h[0][1] * (y - middle.row)) / det;
      const double v = (h[0][0] * (y - middle.row) - h[1][0] * (x - middle.column)) / det;
      double angle = std::atan2(v, u) - from_rad;
      angle -= kTurn * std::floor(angle / kTurn);
      if (angle < condition.cover_rad && std::hypot(u, v) >= condition.cover_from_radii) {
        image.values[static_cast<std::size_t>(y) * image.width + x] = condition.cover_grey;
      }
    }
  }
}

void Look12(const Condition& condition, Tally& tally) {
  const CodeBook book = part_alignment::MakeCodeBook(condition.bits).value();
  Random random(Seed());
  part_alignment::FinderWorkspace workspace;
  part_alignment::FinderOptions options;
  options.max_radius_px = 300;
  for (int i = 0; i < kTargets; ++i) {
    Condition own = condition;
    PinholeView& view = own.view;
    view.tilt_towards_rad = random.Uniform(0, kTurn);
    view.turn_rad = random.Uniform(0, kTurn);
    view.off_axis_rad = random.Uniform(0, 0.35);
    view.off_towards_rad = random.Uniform(0, kTurn);
    const double radius_px = view.focal_px * view.radius / view.distance;
    const int side = static_cast<int>(9.2 * radius_px) + 24;
    const double column = own.border_radii > 0 ? own.border_radii * radius_px : 0.5 * side;
    DrawnTarget target =
        test::PinholeTarget(column + random.Uniform(0, 1), 0.5 * side + random.Uniform(0, 1), view);
    target.bits = book.bits;
    const int number = 1 + static_cast<int>(i * book.words.size() / kTargets);
    target.word = book.words[static_cast<std::size_t>(number - 1)];
    const test::Place middle = test::DiscMiddle(target);
    const double about = random.Uniform(0, kTurn);
    own.look.gloss = {middle.column + radius_px * std::cos(about),
                      middle.row + radius_px * std::sin(about), 0.5 * radius_px, own.gloss_grey};
    own.look.shadow = {middle.column + radius_px * random.Uniform(-1, 1), middle.row,
                       random.Uniform(0, kTurn), 1, own.shadow_left};
    GreyImage image = test::Draw(side, side, {target}, own.look);
    if (own.cover_rad > 0) Cover(target, own, random.Uniform(0, kTurn), image);
    const double bound = BoundSquared(target, own, side);
    for (std::uint64_t k = 0; k < Pictures(); ++k) {
      const auto page = test::Expose(image, own.noise, random);
      const auto found = part_alignment::FindTargets(page.view(), book, options, workspace);
      ASSERT_TRUE(found);
      ++tally.shown;
      const auto near = [&](double x, double y) {
        return std::hypot(x - middle.column, y - middle.row) < radius_px;
      };
      for (const auto& one : found->targets) {
        if (one.number != number || !near(one.disc.column_px, one.disc.row_px)) {
          ++tally.wrong;
          continue;
        }
        ++tally.read;
        const double x = one.disc.column_px - middle.column;
        const double y = one.disc.row_px - middle.row;
        tally.squares += 0.5 * (x * x + y * y);
        tally.bound += bound;
        const double sigmas2 =
            0.5 * (std::pow(x / one.sigma_column_px, 2) + std::pow(y / one.sigma_row_px, 2));
        tally.in_sigmas += sigmas2;
        tally.worst_sigmas = std::max(tally.worst_sigmas, std::sqrt(sigmas2));
      }
      for (const auto& one : found->rejected) {
        if (!near(one.column_px, one.row_px)) continue;
        ++tally.reasons[std::string(part_alignment::ToString(one.reason))];
      }
    }
  }
}

Tally Row(const std::string& name, const Condition& condition) {
  Tally tally;
  Look12(condition, tally);
  std::string reasons;
  for (const auto& [reason, count] : tally.reasons) reasons += fmt::format(" {} {}", count, reason);
  const double n = std::max(1, tally.read);
  fmt::print("| {} | {} of {} | {:.4f} | {:.2f} | {:.2f} ({:.1f}) | {} |{} |\n", name, tally.read,
             tally.shown, std::sqrt(tally.squares / n),
             std::sqrt(tally.squares / std::max(1e-300, tally.bound)),
             std::sqrt(tally.in_sigmas / n), tally.worst_sigmas, tally.wrong, reasons);
  std::fflush(stdout);
  EXPECT_EQ(tally.wrong, 0) << name;
  return tally;
}

void Head(const std::string& title) {
  fmt::print(
      "\n{}; seed {}, {} targets, {} pictures of each\n"
      "| | read | error px | / bound | / stated (worst) | wrong | rejected |\n"
      "|---|---|---|---|---|---|---|\n",
      title, Seed(), kTargets, Pictures());
}

TEST(TargetStudy, ObliqueAndNear) {
  constexpr double kMaxOfBound = 1.5;
  Head("Tilt and distance, radius 5 mm, f = 2813 px (1400 px to 300 mm)");
  for (const double distance : {150.0, 300.0, 450.0, 600.0, 1500.0}) {
    for (const double tilt_deg : {0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 65.0, 70.0}) {
      Condition condition;
      condition.view.distance = distance;
      if (distance <= 300) condition.view.focal_px = 1400;  // smaller picture at the same angle
      condition.view.tilt_rad = tilt_deg * std::numbers::pi / 180;
      const Tally tally = Row(fmt::format("{} mm, {} deg", distance, tilt_deg), condition);
      if (tilt_deg > 60 || distance < 300) continue;
      EXPECT_EQ(tally.read, tally.shown);
      EXPECT_LE(std::sqrt(tally.squares / tally.bound), kMaxOfBound);
    }
  }
}

TEST(TargetStudy, GlossAndShadow) {
  Head(
      "A lamp's image of half a radius about the edge, grey levels on top; 300 mm, 20 deg, radius "
      "2 mm");
  Condition condition;
  condition.view.radius = 2;
  condition.view.tilt_rad = 20 * std::numbers::pi / 180;
  constexpr double kMaxInSigmas = 2;
  for (const double grey : {0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0, 150.0, 250.0, 400.0}) {
    Condition glossy = condition;
    glossy.gloss_grey = grey;
    const Tally tally = Row(fmt::format("gloss {}", grey), glossy);
    EXPECT_LE(std::sqrt(tally.in_sigmas / std::max(1, tally.read)), kMaxInSigmas);
  }
  for (const double left : {0.98, 0.95, 0.9, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05}) {
    Condition shaded = condition;
    shaded.shadow_left = left;
    const Tally tally = Row(fmt::format("shadow {}", left), shaded);
    EXPECT_LE(std::sqrt(tally.in_sigmas / std::max(1, tally.read)), kMaxInSigmas);
  }
  condition.view.distance = 1000;
  for (const double left : {0.6, 0.4, 0.2, 0.1}) {
    Condition shaded = condition;
    shaded.shadow_left = left;
    Row(fmt::format("shadow {}, radius 5.6 px", left), shaded);
  }
}

TEST(TargetStudy, ContrastAndNoise) {
  Head("Contrast of so many times the noise; 300 mm, 30 deg, radius 2 mm");
  Condition condition;
  condition.view.radius = 2;
  condition.view.tilt_rad = 30 * std::numbers::pi / 180;
  for (const double noise : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    for (const double times : {2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0}) {
      Condition faint = condition;
      faint.noise = noise;
      faint.look.ink = 40;
      faint.look.paper = 40 + times * noise;
      Row(fmt::format("noise {}, contrast {}", noise, times * noise), faint);
    }
  }
  for (const double contrast : {2.0, 3.0, 4.0, 6.0}) {
    Condition quiet = condition;
    quiet.noise = 0;
    quiet.look.ink = 40.3;
    quiet.look.paper = 40.3 + contrast;
    Row(fmt::format("noise 0, contrast {}", contrast), quiet);
  }
}

TEST(TargetStudy, BlurAndRadius) {
  Head("Blur; 300 mm, 30 deg, radius 2 mm, which is 18.75 px");
  Condition condition;
  condition.view.radius = 2;
  condition.view.tilt_rad = 30 * std::numbers::pi / 180;
  for (const double blur_px : {0.0, 0.3, 1.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0}) {
    Condition blurred = condition;
    blurred.look.blur_px = blur_px;
    Row(fmt::format("blur {} px", blur_px), blurred);
  }
  Head("Radius; 30 deg");
  for (const double radius_px : {3.0, 4.0, 5.0, 7.0, 10.0, 30.0, 100.0}) {
    Condition sized = condition;
    sized.view.distance = sized.view.focal_px * sized.view.radius / radius_px;
    Row(fmt::format("radius {} px", radius_px), sized);
  }
}

TEST(TargetStudy, CoverAndBorder) {
  Head("Under something black or white, and cut off by the picture's border; 30 deg, 18.75 px");
  Condition condition;
  condition.view.radius = 2;
  condition.view.tilt_rad = 30 * std::numbers::pi / 180;
  for (const double grey : {0.0, 255.0}) {
    for (const double width_deg : {90.0, 180.0}) {
      for (const double from_radii : {1.9, 1.3, 0.8, 0.0}) {
        Condition covered = condition;
        covered.cover_rad = width_deg * std::numbers::pi / 180;
        covered.cover_from_radii = from_radii;
        covered.cover_grey = grey;
        Row(fmt::format("{} deg from {} radii on, grey {}", width_deg, from_radii, grey), covered);
      }
    }
  }
  for (const double radii : {3.6, 3.2, 2.8, 2.2, 1.6, 1.2}) {
    Condition cut = condition;
    cut.border_radii = radii;
    Row(fmt::format("border {} radii away", radii), cut);
  }
}

}  // namespace
}  // namespace trammel
